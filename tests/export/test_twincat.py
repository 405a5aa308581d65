"""The TwinCAT target: its function block, run from its parsed text, is the inverse of the model that linid names."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from linid.diagnosis.measures import measure_gaps, model_of
from linid.export.target import Exported, reshaped
from linid.export.targets.twincat import TARGET
from linid.export.targets.twincat.along import feed_forward_along
from linid.export.targets.twincat.tables import FRICTION_ENTRIES, friction_table
from linid.identification.result import FitResult
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator
from tests.export.axes import FRICTION, HELD, LOST, axis, exported, made
from tests.export.structured_text import block_of

PLACES = tuple(k for k in range(1, 12) if k != 6)
TIGHT = {
    "position_dependent_friction": {f"friction_at_{k}": 0.03 * k for k in PLACES}
    | {f"friction_place_{k}": 0.02 * (k - 6) for k in range(1, 12)},
    "end_effect": {
        "end_loss_low": 0.2,
        "end_loss_high": 0.1,
        "end_reach_low": 0.02,
        "end_reach_high": 0.03,
        "end_length": 0.01,
        "end_low": -0.1,
        "end_high": 0.1,
    },
}
STATIC = ("cogging", "constant_force", "cable_force", "quadratic_drag")
RESTLESS = ("force_ripple", "load_dependent_friction", "asymmetric_friction", "eddy_current_drag")
CASES = {
    "no effect": axis(),
    "ten effects": axis({k: HELD[k] for k in STATIC}, {k: LOST[k] for k in RESTLESS}, TIGHT),
    "another curve": axis(stribeck_exponent=1.2),
    "own term of position": reshaped(axis(), effects=("wave: c * sin(60 * y)",), values={"wave_c": 3.0}),
    "offset": axis({"current_offset": {"current_offset_1": 0.2}}),
    "rotary": replace(axis({"gravity": {"gravity_sine": 3.0, "gravity_cosine": -2.0}}), axis="rotary"),
}
# Straight lines in the tables, and a bristle that follows within a hundredth of a second: of the largest acceleration.
NEAR = 0.01
SAME_LOSS = 0.05
MOVING = 0.02  # m/s


def course(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A commanded motion to and fro: position in m, speed in m/s, acceleration in m/s^2."""
    omega, size = 2.0 * np.pi * 0.6, 0.1
    return size * np.sin(omega * t), size * omega * np.cos(omega * t), -size * omega**2 * np.sin(omega * t)


def run_block(one: Exported, y: np.ndarray, v: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force in N and input in A (n,) that the function block asks for along a motion."""
    block = block_of(TARGET.files(one)["FB_AxisFeedForward.st"].decode())
    rows = []
    for k in range(y.size):
        found = block(Position=float(y[k]), Velocity=float(v[k]), Acceleration=float(a[k]))
        rows.append((found["Force"], found.get("Input", np.nan)))
    force, current = np.array(rows).T
    return force, current


@pytest.mark.parametrize("case", CASES)
def test_the_model_moves_as_commanded_under_what_the_function_block_asks_for(case: str) -> None:
    model = CASES[case]
    t = np.arange(2001) * 1e-3
    y, v, a = course(t)
    command = Recording("command", t, y, drive_input=np.zeros_like(t), axis=model.axis)
    one = exported(model, command)
    _, current = run_block(one, y, v, a)
    form, vector = model_of(TARGET.simplified(one))
    simulator = Simulator(form, pack_inputs([replace(command, drive_input=current)]), 8)
    start = np.full((1, 1), FRICTION["static_force"] / (FRICTION["mass"] * 5e3**2))
    found = simulator.along(vector, y, v, np.zeros(t.size, dtype=bool), start).acceleration[0]
    moving = (np.abs(v) > 0.05) & (t > 0.02) & (t < t[-1])
    assert np.max(np.abs(found - a)[moving]) < NEAR * np.max(np.abs(a))
    assert TARGET.simplified(one).effects == model.effects


@pytest.mark.parametrize("case", CASES)
def test_a_whole_motion_is_asked_for_what_the_text_says(case: str) -> None:
    """The tables of the text have nine digits."""
    model = CASES[case]
    t = np.arange(601) * 3e-3
    y, v, a = course(t)
    one = exported(model, Recording("command", t, 0.9 * y, drive_input=np.zeros_like(t), axis=model.axis))
    for told, asked in zip(feed_forward_along(one, y, v, a), run_block(one, y, v, a), strict=True):
        np.testing.assert_allclose(told, asked, rtol=1e-7, atol=1e-7 * np.max(np.abs(asked)))


def test_phase_currents_follow_from_the_q_current() -> None:
    values = {"electrical_wavenumber": 100.0, "winding_displacement": 1.0472, "commutation_offset": 0.15}
    model = axis({"constant_force": {"constant_force": 2.0}}, kind="theta", **values, winding_length=0.7, nome=0.5)
    t = np.arange(1001) * 1e-3
    y, v, a = course(t)
    force, current = run_block(exported(model), y, v, a)
    phases = 2.0 * (100.0 * y + 0.15 + np.array([[-1.0], [0.0], [1.0]]) * 1.0472)
    harmonic = 30.0 * 8.0 * 0.5 * np.sin(2.0 * 0.7)  # of theta's field, per phase (37)
    assert np.sum(harmonic * np.sin(phases) * np.sin(phases) * current, axis=0) == pytest.approx(force, rel=1e-4)


def derivatives(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    v = np.gradient(recording.y, recording.period, edge_order=2)
    return v, np.gradient(v, recording.period, edge_order=2)


def test_the_loss_that_linid_states_is_what_the_function_block_leaves_to_the_controller() -> None:
    model = axis({k: HELD[k] for k in (*STATIC, "thermal_derating")}, LOST, TIGHT)
    recordings = made(model, 0.9, 1.2)
    said: dict[str, list[np.ndarray]] = {"base": [], "target": []}
    left: dict[str, list[np.ndarray]] = {"base": [], "target": []}
    for name, one in (("base", exported(axis(), *recordings)), ("target", exported(model, *recordings))):
        form = TARGET.simplified(one)
        for recording, trace in zip(recordings, measure_gaps(form, recordings, floors=False)[1], strict=True):
            v, a = derivatives(recording)
            _, current = run_block(one, recording.y, v, a)
            # Where the axis rests, the force that friction takes is anyone's guess: for the model too.
            moving = np.abs(v) > MOVING
            left[name].append(FRICTION["force_constant"] * (current - recording.drive_input)[moving])
            said[name].append(trace.force_residual[np.interp(trace.force_t, recording.t, np.abs(v)) > MOVING])
    shares = []
    for errors in (said, left):
        rms = {name: np.sqrt(np.mean(np.concatenate(rows) ** 2)) for name, rows in errors.items()}
        shares.append(1.0 - rms["target"] / rms["base"])
    assert len(model.effects) > 8 and shares[1] == pytest.approx(shares[0], abs=SAME_LOSS)
    assert shares[0] < 0.95  # there is a loss to be told


def entries(text: str) -> np.ndarray:
    """Speeds in m/s and currents in A (2, n) of a list of TF5200."""
    found = [[float(x) for x in re.findall(rf"^frict_comp\.table\[\d+\]\.{key} (\S+)$", text, re.M)] for key in
             ("in", "out")]  # fmt: skip
    assert f"frict_comp.table_entries {len(found[0])}\n" in text
    return np.array(found) * 1e-6


def test_the_friction_table_has_the_error_that_it_states() -> None:
    model = axis({"eddy_current_drag": LOST["eddy_current_drag"]})
    (recording,) = made(model, 1.2)
    text = TARGET.files(exported(model, recording))["friction.lis"].decode()
    places, currents = entries(text)
    assert places.size <= FRICTION_ENTRIES and np.all(np.diff(places) > 0.0)
    v = np.geomspace(places[0], places[-1], 20000)
    friction = 8.0 + 4.0 * np.exp(-((v / 0.01) ** 2)) + 12.0 * v + 6.0 * v / (1.0 + v**2)
    missed = np.max(np.abs(30.0 * np.interp(v, places, currents) - friction))
    stated = float(re.search(r"by at most (\S+) N", text)[1])  # type: ignore[index]
    assert missed == pytest.approx(stated, rel=0.02)
    for others in (np.geomspace, np.linspace):
        nodes = others(places[0], places[-1], FRICTION_ENTRIES)
        assert np.max(np.abs(np.interp(v, nodes, np.interp(nodes, v, friction)) - friction)) > 2.0 * missed


def test_no_two_entries_can_be_saved() -> None:
    one = exported(axis())
    errors = [friction_table(one, count).error for count in (5, 10, 20)]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]  # falls with the square of the number of pieces


def test_the_project_file_holds_the_same_text() -> None:
    files = {name: content.decode() for name, content in TARGET.files(exported(CASES["ten effects"])).items()}
    pou = ElementTree.fromstring(files["FB_AxisFeedForward.TcPOU"]).find("POU")
    assert pou is not None and pou.attrib["Name"] == "FB_AxisFeedForward"
    together = f"{pou.findtext('Declaration')}\n{pou.findtext('Implementation/ST')}END_FUNCTION_BLOCK\n"
    assert together == files["FB_AxisFeedForward.st"]


def test_what_is_not_held_is_named_and_forces_may_be_per_kilogram() -> None:
    model = axis(HELD, LOST)
    form = TARGET.simplified(exported(model))
    lacking = " ".join(TARGET.lacks(exported(model)))
    assert [name for name in model.effects if name not in form.effects and name not in lacking] == []
    assert "thermal_derating" in lacking and "tables reach half a metre" in lacking
    text = TARGET.files(exported(replace(axis(), per_mass=True)))["FB_AxisFeedForward.st"].decode()
    assert "N/kg" in text


def test_an_axis_that_never_moved_has_tables_of_the_usual_stroke() -> None:
    t = np.arange(100) * 1e-3
    still = Recording("still", t, np.zeros_like(t), drive_input=np.zeros_like(t))
    text = TARGET.files(exported(axis({"cogging": HELD["cogging"]}), still))["FB_AxisFeedForward.st"].decode()
    assert "TableLow : LREAL := -0.5;" in text


def test_friction_far_beyond_the_thrust_is_written_all_the_same() -> None:
    text = TARGET.files(exported(axis(force_constant=1e-3, viscous_friction=1e10)))["friction.lis"].decode()
    assert len(re.findall("[.]out", text)) == 1 + len(entries(text)[0])


def in_text(model: FitResult) -> str:
    return TARGET.files(exported(model))["FB_AxisFeedForward.st"].decode()


def test_the_block_has_no_more_than_the_model_needs() -> None:
    bare, full = in_text(axis()), in_text(CASES["ten effects"])
    assert not re.search("Table|Cable|Drag|Asymmetry", bare) and len(re.findall("ARRAY", full)) == 3
    assert max(len(line) for line in full.splitlines() if "Not held" not in line) < 140
