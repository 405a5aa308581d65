"""Real axes against their published values (EMPS: Janot, Gautier, Brunot 2019; mn4004: a brushless servo)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, decimate, filtfilt

from linid.identification.fit import fit
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.recording.mapping import ChannelMapping
from linid.recording.read import read_recording
from linid.recording.recording import Recording
from tests.shared_data import shared

SETTINGS = FitSettings(objective="acceleration", search=SearchSettings(generations=60), jobs=2)
DRIVE_GAIN = 35.150651882  # N/V, stored in the file as gtau


def emps(name: str) -> Recording:
    channels = ChannelMapping.model_validate(
        {
            "time": {"column": "t", "unit": "s"},
            "position": {"column": "qm", "unit": "m"},
            "command": {"column": "vir", "unit": "V"},
        }
    )
    return read_recording(shared("emps", f"{name}.mat"), channels=channels)


def force_error(result: FitResult, recording: Recording) -> float:
    """Relative force error with the filtering of the published values."""
    values = {e.name: e.value for e in result.estimates}
    dt = recording.period
    speed = np.gradient(filtfilt(*butter(4, 100.0 * 2.0 * dt), recording.y), dt)
    assert recording.drive_input is not None
    force = values["force_constant"] * recording.drive_input
    direction = np.sign(speed)
    model = values["mass"] * np.gradient(speed, dt) + values["viscous_friction"] * speed
    model += values["coulomb_force"] * direction * (1.0 + values.get("friction_asymmetry", 0.0) * direction)
    model += values.get("viscous_asymmetry", 0.0) * np.abs(speed) - values.get("constant_force", 0.0)
    error = decimate(force - model, 10)[5:-5]
    return float(np.linalg.norm(error) / np.linalg.norm(decimate(force, 10)[5:-5]))


@pytest.fixture(scope="module")
def emps_fit() -> FitResult:
    return fit(
        "force",
        [emps("DATA_EMPS")],
        settings=SETTINGS,
        effects=("constant_force",),
        known={"force_constant": DRIVE_GAIN},
    )


def test_emps_parameters_agree_with_the_published_ones(emps_fit: FitResult) -> None:
    assert emps_fit.value("mass") == pytest.approx(95.11, rel=0.005)
    assert emps_fit.value("viscous_friction") == pytest.approx(203.5, rel=0.02)
    assert emps_fit.value("coulomb_force") == pytest.approx(20.4, rel=0.03)
    # Published as an offset on the drive's side: the force on the axis has the opposite sign.
    assert emps_fit.value("constant_force") == pytest.approx(3.16, abs=0.2)


def test_emps_is_found_from_random_candidates() -> None:
    """No regression and no first mass: the search from scratch ends where the usual one does, without the effect."""
    usual, scratch = (
        fit("force", [emps("DATA_EMPS")], settings=settings, known={"force_constant": DRIVE_GAIN})
        for settings in (SETTINGS, replace(SETTINGS, search=SearchSettings(method="scratch", seed=3)))
    )
    assert scratch.history[-1].best < 1.001 * usual.history[-1].best
    for name in ("mass", "viscous_friction", "coulomb_force"):
        assert scratch.value(name) == pytest.approx(usual.value(name), rel=1e-3)


def test_emps_held_out_force_error(emps_fit: FitResult) -> None:
    assert force_error(emps_fit, emps("DATA_EMPS")) <= 0.041
    assert force_error(emps_fit, emps("DATA_EMPS_PULSES")) <= 0.060


def test_mn4004_inertia_and_coulomb_torque() -> None:
    recording = read_recording(shared("real", "mn4004", "accelerate.csv"), axis="rotary")
    constant = 0.0318
    result = fit("force", [recording], settings=SETTINGS, known={"force_constant": constant})
    assert result.value("mass") / constant == pytest.approx(1.93e-4, rel=0.02)
    assert result.value("coulomb_force") / constant == pytest.approx(0.082, rel=0.05)
