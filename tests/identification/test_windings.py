"""Windings from phase voltages: recovery, coverage of the intervals, the noise that would bias them, refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom

from linid.errors import DataError
from linid.identification.fit import fit
from linid.identification.fit_windings import first_winding_values, fit_windings
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.objectives.winding_currents import CURRENT_AXES, WindingCurrents, between_steps
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.uncertainty.voltage_noise import noise_gain
from linid.physics.electrical import STAR
from linid.physics.model import Model
from linid.recording.noise import white_level
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.simulation.winding_currents import currents_along
from linid.stand.generate import resample_noise, true_parameters
from tests.identification.stand import stand

CONFIG = "stand_voltage.yaml"
SETTINGS = FitSettings(search=SearchSettings(population=32, generations=20), jobs=2)


def recordings(seed: int = 1) -> list[Recording]:
    made = stand(CONFIG) if seed == 1 else resample_noise(stand(CONFIG), seed)
    return [r for r in made.recordings if r.split == "fit"]


def truth() -> dict[str, float]:
    """The true parameters with a positive force constant: poles exchanged are a field phase of half a turn."""
    values = true_parameters(stand(CONFIG).description)
    if values["force_constant"] < 0.0:
        values |= {
            "force_constant": -values["force_constant"],
            "commutation_offset": values["commutation_offset"] - math.pi,
        }
    return values


@cache
def by_currents(kind: ModelKind = "sine") -> FitResult:
    """The motor by its currents alone."""
    found = recordings()
    friction = fit("friction", [r for r in found if r.kind == "free_wheel"], settings=SETTINGS)
    return fit(kind, found, settings=SETTINGS, start=friction)


@cache
def with_windings() -> FitResult:
    return fit_windings(by_currents(), recordings(), STAR, settings=SETTINGS)


def test_windings_and_motor_are_recovered() -> None:
    result, true = with_windings(), truth()
    for estimate in result.estimates:
        if estimate.status == "fitted":
            assert abs(estimate.value - true[estimate.name]) < 4.0 * estimate.std, estimate
    for name, share in (("phase_resistance", 0.002), ("phase_inductance", 0.02), ("force_constant", 2e-4)):
        estimate = next(e for e in result.estimates if e.name == name)
        assert estimate.std < share * estimate.value, estimate
    derived = {e.name: e for e in result.derived}
    constant = true["force_constant"] / true["phase_inductance"]
    assert abs(derived["back_emf_over_inductance"].value - constant) < 4.0 * derived["back_emf_over_inductance"].std
    time_constant = true["phase_inductance"] / true["phase_resistance"]
    assert (
        abs(derived["electrical_time_constant"].value - time_constant) < 4.0 * derived["electrical_time_constant"].std
    )


def test_a_theta_motor_has_the_same_windings() -> None:
    """Though the currents alone hardly tell its shape, which the back-EMF of this sine then must."""
    result, true = fit_windings(by_currents("theta"), recordings(), STAR, settings=SETTINGS), truth()
    known = {e.name: e for e in (*result.estimates, *result.derived)}
    for name, value in (
        ("phase_resistance", true["phase_resistance"]),
        ("phase_inductance", true["phase_inductance"]),
        ("fundamental_force_constant", true["force_constant"]),
    ):
        assert abs(known[name].value - value) < 4.0 * known[name].std, known[name]
    assert known["phase_inductance"].std < 0.1 * true["phase_inductance"]


def test_voltages_sharpen_the_force_constant() -> None:
    """The back-EMF is the force constant in other units, and it is measured without any mass."""
    before = next(e for e in by_currents().estimates if e.name == "force_constant")
    after = next(e for e in with_windings().estimates if e.name == "force_constant")
    assert after.std < 0.05 * before.std


def test_first_values_are_near() -> None:
    """Of the motor they need the pole pitch alone: its fit to the currents may have a wrong shape or spacing."""
    driven = [r for r in recordings() if r.kind != "free_wheel"]
    resistance, inductance = first_winding_values(truth()["electrical_wavenumber"], driven)
    assert resistance == pytest.approx(truth()["phase_resistance"], rel=0.05)
    assert inductance == pytest.approx(truth()["phase_inductance"], rel=0.3)


def test_the_model_file_keeps_the_windings() -> None:
    again = model_from_text(model_to_text(with_windings()), "here")
    assert again.winding == STAR and again.value("phase_inductance") == with_windings().value("phase_inductance")


@pytest.mark.exhaustive
def test_intervals_cover_over_fifty_draws_of_the_noise() -> None:
    true, seeds = truth(), range(200, 250)
    names = ("phase_resistance", "phase_inductance", "force_constant", "back_emf_over_inductance")
    true["back_emf_over_inductance"] = true["force_constant"] / true["phase_inductance"]
    hits = dict.fromkeys(names, 0)
    for seed in seeds:
        result = fit_windings(by_currents(), recordings(seed), STAR, settings=SETTINGS)
        known = {e.name: e for e in (*result.estimates, *result.derived)}
        for name in names:
            hits[name] += known[name].low <= true[name] <= known[name].high
    least = binom.ppf(0.001, len(seeds), 0.95)
    assert all(hit >= least for hit in hits.values()), hits


def test_the_noise_gain_is_that_of_noise() -> None:
    """White noise in the voltages of a resting motor against the answer to single samples."""
    model = Model("sine", (), STAR)
    vector = model.vector(truth())
    n, dt, size = 20_001, 1e-3, 0.02
    rest = np.zeros(n)
    noise = size * np.random.default_rng(3).standard_normal((3, n))
    inputs = pack_inputs([Recording("noise", np.arange(n) * dt, rest, phase_voltages=noise)], voltages=True)
    currents = currents_along(model, vector[None], inputs, rest, rest, np.zeros((1, 3)))[0]
    along = CURRENT_AXES[STAR] @ currents
    assert along.var(axis=1) == pytest.approx(size**2 * noise_gain(model, vector, dt).sum(axis=1), rel=0.03)


def test_the_noise_level_does_not_count_the_commutation() -> None:
    t = np.arange(4000) * 1e-3
    random = np.random.default_rng(4)
    fast = 60.0 * np.sin(350.0 * t + 3.0 * np.sin(2.0 * t))
    assert white_level(fast + 0.02 * random.standard_normal(t.size)) == pytest.approx(0.02, rel=0.1)
    assert white_level(fast) < 0.002
    assert white_level(fast[:10]) == 0.0


def test_currents_along_a_motion_are_those_of_the_simulation() -> None:
    """What the voltage-driven simulation gives for the currents, from its own motion."""
    one = next(r for r in recordings() if r.name == "sine_current_1")
    model = Model("sine", (), STAR)
    vector = model.vector(truth())[None]
    inputs = pack_inputs([one], voltages=True)
    y, v, i, _ = Simulator(model, inputs, 8).run_by_voltage(
        vector, whole_recordings(inputs), np.array([[[one.y[0], 0.0, np.nan]]]), np.full((1, 1, 3), np.nan)
    )
    along = currents_along(model, vector, inputs, y[0], v[0], i[0, :, 0][None])
    # Noise of the voltages bends the motion within a sample, which its samples do not tell.
    error, size = np.abs(along[0] - i[0]), float(np.max(np.abs(i)))
    assert np.median(error) < 3e-4 * size and np.max(error) < 5e-3 * size


def test_residuals_at_the_truth_are_the_sensors_noise() -> None:
    driven = tuple(r for r in recordings() if r.kind != "free_wheel")
    model = Model("sine", (), STAR)
    part = WindingCurrents(model, driven)
    rest = part.residuals(model.vector(truth())[None], np.zeros((1, 0)))[0]
    gain = noise_gain(model, model.vector(truth()), 1e-3).sum(axis=1).mean()
    assert float(np.std(rest)) == pytest.approx(math.hypot(0.003, 0.02 * math.sqrt(gain)), rel=0.05)


def test_without_voltages_there_are_no_windings() -> None:
    bare = [replace(r, phase_voltages=None) for r in recordings()]
    with pytest.raises(DataError, match="voltage_u"):
        fit_windings(by_currents(), bare, STAR, settings=SETTINGS)


@cache
def imposed() -> tuple[FitResult, FitResult]:
    """The motor by its currents, and with its windings, where voltages were imposed, square waves among them."""
    found = [r for r in stand("stand_by_voltage.yaml").recordings if r.split == "fit"]
    friction = fit("friction", [r for r in found if r.kind == "free_wheel"], settings=SETTINGS)
    motor = fit("sine", found, settings=SETTINGS, start=friction)
    return motor, fit_windings(motor, found, STAR, settings=SETTINGS)


def test_a_stand_driven_by_voltages_is_recovered() -> None:
    """Steps of the voltages come between samples: an inductance that takes their lag for its own would be 40 % off."""
    _, result = imposed()
    true = true_parameters(stand("stand_by_voltage.yaml").description)
    told = [e for e in result.estimates if e.status == "fitted"]
    assert {"phase_resistance", "phase_inductance", "force_constant", "mass", "coulomb_force"} <= {e.name for e in told}
    for estimate in told:
        assert abs(estimate.value - true[estimate.name]) < 4.0 * estimate.std, estimate
    for name, share in (("phase_resistance", 0.001), ("phase_inductance", 0.02), ("force_constant", 1e-4)):
        estimate = next(e for e in told if e.name == name)
        assert abs(estimate.value - true[name]) < share * true[name], estimate


def test_recordings_are_cut_where_their_voltages_step() -> None:
    made = stand("stand_by_voltage.yaml")
    smooth, steps = (next(r for r in made.recordings if r.name == n) for n in ("sine_voltage_1", "square_voltage_1"))
    assert between_steps(smooth) == [smooth]
    pieces = between_steps(steps)
    edges = [piece.t[0] for piece in pieces[1:]]
    # Square waves of 4 Hz whose first pulse is a half one step at odd sixteenths of a second.
    assert edges == pytest.approx([(2 * k + 1) / 16 + 0.0035 for k in range(24)], abs=1e-9)
    assert between_steps(replace(steps, between_samples="hold"))[0].t.size == steps.t.size
