"""The MuJoCo target: MuJoCo runs what linid says it holds, and loses what linid says it loses."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from linid.api import Fit, simulate
from linid.errors import UsageError
from linid.export.loss import measure_loss, measure_model
from linid.export.simpler import square_stribeck
from linid.export.target import reshaped
from linid.export.targets.mujoco import TARGET
from linid.export.targets.mujoco.mjcf import step_of
from linid.identification.result import FitResult
from linid.physics.laws.registry import LAWS
from linid.recording.recording import Recording
from tests.export.axes import FRICTION, HELD, LOST, ahead, axis, exported, free_run, made

mujoco = pytest.importorskip("mujoco", minversion="3.7", reason="needs mujoco, of the extra mujoco")

# MuJoCo's steps are of first order: this share of the stroke may be missed at the file's own step ...
NEAR = 2e-3
# ... and a quarter of the step misses at most this share of it.
FIRST_ORDER = 0.4
# Of the gap between a model without effects and the whole one.
SAME_LOSS = 0.05
# Of the stroke, that the d-current which the one winding lacks may take.
ONE_WINDING = 0.01
SINE = {"electrical_wavenumber": 200.0, "winding_displacement": 2.0944, "commutation_offset": 0.3}
THETA = {k: 0.5 * x for k, x in SINE.items()} | {"winding_length": 0.7, "nome": 0.5}


def text_of(model: FitResult, *recordings: Recording) -> str:
    return TARGET.files(exported(model, *recordings))["axis.xml"].decode()


def run_in_mujoco(text: str, recording: Recording, finer: int = 1) -> np.ndarray:
    """Positions (n,) in m of an exported file under a recording's inputs, at a part of its own step."""
    from linid.export.targets.mujoco.run_axis import run

    step = float(re.search(r'timestep="([^"]*)"', text)[1])  # type: ignore[index]
    text = text.replace(f'timestep="{step!r}"', f'timestep="{step / finer!r}"')
    text = re.sub(r'nsample="(\d+)"', lambda found: f'nsample="{finer * int(found[1])}"', text)
    inputs = recording.phase_currents if recording.drive_input is None else [recording.drive_input]
    return np.asarray(run(mujoco.MjModel.from_xml_string(text), recording.t, inputs)[0])


def some(*names: str) -> dict[str, dict[str, float]]:
    return {name: HELD[name] for name in names}


BUMP = "bump: c * exp(-((y - 0.1) / 0.03) ** 2)"
HEATLESS = {name: values for name, values in HELD.items() if name not in ("thermal_derating", "gravity")}
CASES = {
    "no effect": axis(),
    "waves and springs": axis(some("cogging", "constant_force", "cable_force")),
    "late, dragged, with a load": axis(some("input_delay", "quadratic_drag", "flexible_load")),
    "learned over position": reshaped(
        axis(some("constant_force")), effects=("constant_force", BUMP), values={"bump_c": 3.0}
    ),
    "rotary": replace(axis(HEATLESS, some("gravity")), axis="rotary"),
    "sine": axis(HEATLESS, kind="sine", **SINE),
    "theta": axis(HEATLESS, kind="theta", **THETA),
    "coulomb": replace(axis(HEATLESS), law="coulomb"),
}


@pytest.mark.parametrize("case", CASES)
def test_mujoco_follows_linid_to_the_order_of_its_steps(case: str) -> None:
    (recording,) = made(CASES[case], 1.3)
    text, stroke = text_of(CASES[case], recording), np.ptp(recording.y)
    coarse, fine = (np.max(np.abs(run_in_mujoco(text, recording, k) - recording.y)) for k in (1, 4))
    assert coarse < NEAR * stroke and fine < FIRST_ORDER * coarse
    assert np.max(np.abs(free_run(TARGET.simplified(exported(CASES[case])), recording) - recording.y)) < 1e-6 * stroke


def test_eight_effects_at_once_are_held() -> None:
    model = axis(HELD)
    (recording,) = made(model, 1.3)
    assert len(model.effects) == 8 and TARGET.lacks(exported(model)) != ()
    error = run_in_mujoco(text_of(model, recording), recording) - recording.y
    assert np.max(np.abs(error)) < 2.0 * NEAR * np.ptp(recording.y)  # heat is held to first order


def test_a_free_wheel_starts_with_its_bristles_bent() -> None:
    from linid.export.targets.mujoco.run_axis import run

    model = axis(kind="friction")
    t = np.arange(400) * 1e-3
    simple = mujoco.MjModel.from_xml_string(text_of(model))
    y, v = run(simple, t, [], 0.1, 0.2)
    # m v' = -F_C - sigma_2 v from v_0, until it stops: above ten Stribeck velocities the curve is level.
    mass, force, slope = (FRICTION[name] for name in ("mass", "coulomb_force", "viscous_friction"))
    wanted = (0.2 + force / slope) * np.exp(-slope * t / mass) - force / slope
    assert np.max(np.abs(v - wanted)[wanted > 0.1]) < 5e-4
    assert v[-1] == pytest.approx(0.0, abs=1e-4) and y[-1] > 0.1


def shares(model: FitResult, recordings: Sequence[Recording]) -> tuple[float, float]:
    """What the MuJoCo form keeps of the closed gap, by linid on the form and by MuJoCo on the file."""
    text, form = text_of(model, *recordings), TARGET.simplified(exported(model, *recordings))
    base = axis()

    def rms(errors: Sequence[np.ndarray]) -> float:
        return float(np.sqrt(np.mean(np.square(errors))))

    gap = rms([free_run(base, one) - one.y for one in recordings])
    said = rms([free_run(form, one) - one.y for one in recordings])
    measured = rms([run_in_mujoco(text, one) - one.y for one in recordings])
    return 1.0 - said / gap, 1.0 - measured / gap


@pytest.mark.parametrize("lost", [*LOST, "all", "all, with heat"])
def test_the_loss_that_linid_states_is_the_one_that_mujoco_shows(lost: str) -> None:
    warm = some("thermal_derating") if "heat" in lost else {}
    model = axis(HEATLESS, warm, LOST if "all" in lost else {lost: LOST[lost]})
    said, measured = shares(model, made(model, 1.0, 1.5))
    assert measured == pytest.approx(said, abs=SAME_LOSS)
    assert "all" not in lost or said < 0.99  # there is a loss to be told


def test_the_loss_0_1_s_ahead_that_the_export_states_is_the_one_that_mujoco_shows() -> None:
    model = axis(some("cogging", "constant_force", "cable_force", "quadratic_drag"), LOST)
    recordings = made(model, 1.0, 1.5)
    text, form = text_of(model, *recordings), TARGET.simplified(exported(model, *recordings))
    stated = measure_loss(measure_model(model, None, recordings), form, recordings).kept[0]
    base, by_linid, by_mujoco = (
        np.sqrt(np.mean(np.square([ahead(one, recording, file) for recording in recordings])))
        for one, file in ((axis(), ""), (form, ""), (form, text))
    )
    assert stated.measure == "ahead" and stated.share < 0.95
    assert 1.0 - by_mujoco / base == pytest.approx(1.0 - by_linid / base, abs=0.2 * SAME_LOSS)
    assert 1.0 - by_mujoco / base == pytest.approx(stated.share, abs=SAME_LOSS)


@pytest.mark.parametrize("law", LAWS)
def test_other_laws_are_run_as_the_lugre_friction_that_is_named(law: str) -> None:
    model = replace(axis(), law=law)
    (recording,) = made(model, 1.3)
    model = reshaped(model)  # with the law's own parameters
    wanted = free_run(TARGET.simplified(exported(model, recording)), recording)
    found = run_in_mujoco(text_of(model, recording), recording)
    assert np.max(np.abs(found - wanted)) < NEAR * np.ptp(wanted)


def test_what_is_folded_is_nearer_than_what_is_left_out() -> None:
    for name in ("eddy_current_drag", "asymmetric_friction"):
        model = axis({name: LOST[name]})
        (recording,) = made(model, 1.3)
        form = TARGET.simplified(exported(model, recording))
        errors = [np.std(free_run(one, recording) - recording.y) for one in (form, axis())]
        assert errors[0] < 0.5 * errors[1]


def test_a_curve_of_another_exponent_is_met_by_the_nearest_square_one() -> None:
    values = FRICTION | {"stribeck_exponent": 1.0}
    static, speed = square_stribeck(values)
    v = np.linspace(0.0, 0.1, 500)
    wanted = 8.0 + 4.0 * np.exp(-v / 0.01)
    assert np.sqrt(np.mean((8.0 + (static - 8.0) * np.exp(-((v / speed) ** 2)) - wanted) ** 2)) < 0.25
    assert square_stribeck(FRICTION | {"stribeck_exponent": 2.0}) == (12.0, 0.01)


def test_every_effect_is_held_or_named() -> None:
    model = axis(HELD, LOST)
    lacking = " ".join(TARGET.lacks(exported(model))).lower()
    kept = TARGET.simplified(exported(model)).effects
    named = re.sub(r"[-_]", " ", lacking)
    untold = [name for name in model.effects if name not in kept and name.replace("_", " ")[:9] not in named]
    assert untold == []
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    note = ElementTree.fromstring(text_of(model), parser=parser)
    assert sum("Not held whole" in (one.text or "") for one in note) == len(TARGET.lacks(exported(model)))


def test_a_stiff_bristle_takes_shorter_steps() -> None:
    assert step_of(FRICTION) == 1e-4
    stiff = FRICTION | {"bristle_stiffness": 2e8}
    assert 1e4 * step_of(stiff) <= 0.25 < 2e4 * step_of(stiff)


def test_a_load_heavier_than_the_axis_leaves_it_the_mass_that_the_simulation_does() -> None:
    model = axis({"flexible_load": {"load_mass": 5.0, "load_frequency": 25.0, "load_damping": 0.05}})
    (recording,) = made(model, 1.3)
    found = run_in_mujoco(text_of(model), recording, 4)
    assert np.max(np.abs(found - recording.y)) < NEAR * np.ptp(recording.y)


def test_no_motor_needs_what_mujoco_3_7_has_not() -> None:
    model = replace(reshaped(axis(HELD, kind="sine", **SINE), values={"phase_resistance": 5.0}), winding="star")
    for text in (text_of(axis(HELD)), TARGET.files(exported(model))["axis_by_voltage.xml"].decode()):
        motors = ElementTree.fromstring(text).findall("actuator/dcmotor")
        assert motors and all("input" not in one.attrib and float(one.attrib["motorconst"]) > 0.0 for one in motors)


def test_a_model_per_kilogram_is_refused() -> None:
    with pytest.raises(UsageError, match="mass"):
        TARGET.files(exported(replace(axis(), per_mass=True)))


def test_the_script_beside_the_file_runs_it(tmp_path: Path) -> None:
    model = axis(some("cogging", "input_delay"))
    (recording,) = made(model, 1.3)
    for name, content in TARGET.files(exported(model, recording)).items():
        (tmp_path / name).write_bytes(content)
    table = np.column_stack([recording.t, recording.drive_input])
    np.savetxt(tmp_path / "record.csv", table, "%.12g", ",", header="t,i", comments="")
    done = subprocess.run(
        [sys.executable, "run_axis.py", "axis.xml", "record.csv"], cwd=tmp_path, capture_output=True, text=True
    )
    found = np.loadtxt(done.stdout.splitlines(), delimiter=",", skiprows=1)
    assert np.max(np.abs(found[:, 1] - recording.y)) < NEAR * np.ptp(recording.y)


@pytest.mark.parametrize("winding", ["star", "separate"])
def test_windings_of_one_axis_push_as_three_phases_do(winding: str) -> None:
    from linid.export.targets.mujoco.run_axis import run

    more = {"phase_resistance": 5.0, "phase_inductance": 1.7e-3, "mutual_inductance": -4e-4}
    model = reshaped(replace(axis(some("cogging"), kind="sine", **SINE), winding=winding), values=more)
    t = np.arange(2001) * 1e-3
    path = 0.12 * np.sin(1.5 * np.pi * t) ** 2
    size = 6.0 * np.cos(3.0 * np.pi * t) + 30.0 * np.gradient(path, t)
    angles = 200.0 * path + 0.3 + np.array([[-1.0], [0.0], [1.0]]) * SINE["winding_displacement"]
    driven = Recording("run", t, np.zeros_like(t), phase_voltages=size * np.sin(angles), kind="motor")
    wanted = simulate(Fit(model), driven, position=0.0, speed=0.0, by_voltage=True).y_simulated
    text = TARGET.files(exported(model))["axis_by_voltage.xml"].decode()
    found = run(mujoco.MjModel.from_xml_string(text), t, driven.phase_voltages)[0]
    assert np.ptp(wanted) > 0.05 and np.max(np.abs(found - wanted)) < ONE_WINDING * np.ptp(wanted)
