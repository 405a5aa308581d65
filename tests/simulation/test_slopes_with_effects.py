"""Derivatives that a simulation with effects and own terms carries along: against differences of whole simulations."""

from __future__ import annotations

import dis
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from linid.physics.effects.effect import term
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation import run
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Segments, Simulator
from tests.simulation.axis_with_effects import AXIS, SAMPLES, simulate, start_of_run, synchronous_run

STEP = 1e-6  # of each parameter, to both sides
MARKS = {name for effect in EFFECTS for name in effect.preset}  # where an effect acts: no number to be differentiated
KNOWN = [
    "cogging",
    "force_ripple",
    "asymmetric_friction",
    "constant_force",
    "quadratic_drag",
    "end_effect",
    "encoder_periodic_error",
    "external_disturbance",
    "friction_drift",
    "payload_change",
    "eddy_current_drag",
    "gravity",
    "friction_level_change",
    "load_dependent_friction",
    "force_constant_change",
    "breakaway_change",
    "viscous_friction_change",
    "phase_gain_imbalance",
    "current_offset",
    "force_saturation",
    "pole_pitch_error",
    "commutation_change",
    "input_delay",
    "position_dependent_friction",
    "cable_force",
    "flexible_load",
    "backlash",
    "drive_train_backlash",
    "dwell_stiction",
    "thermal_derating",
]
COASTING = [
    "cable_force",
    "flexible_load",
    "backlash",
    "drive_train_backlash",
    "dwell_stiction",
    "cogging",
    "asymmetric_friction",
    "quadratic_drag",
    "friction_drift",
    "gravity",
    "position_dependent_friction",
]
OWN: dict[str, dict[str, float]] = {
    "drag: -c*v*abs(v)": {"c": 2.0},
    "grip: c*F*sin(300*y)": {"c": 0.2},
    "rub: -stribeck*sign(v)*c*cos(120*y)": {"c": 0.3},
    "sway: c*acceleration": {"c": 0.05},
}
REMEMBERING: dict[str, dict[str, float]] = {
    "wake: -c*stribeck*sign(v)*exp(-travel/0.004)": {"c": 0.4},
    "grip: -c*exp(-slid/0.003)*tanh(v/0.01)": {"c": 1.5},
    "tired: -c*v*exp(-since_reversal/0.05)": {"c": 3.0},
    "drawn: c*travel*cos(400*y)": {"c": 20.0},
}


def driven(effects: tuple[str, ...]) -> tuple[Recording, Segments]:
    """The axis driven to and fro, with windows over reversals and a rest."""
    recording = synchronous_run(0.5)
    recording = replace(recording, y=simulate(effects, recording, start_of_run(), 4))
    return recording, Segments(np.zeros(8, dtype=np.int64), np.arange(8) * 50 + 20, np.full(8, 60))


def coasting() -> tuple[Recording, Segments]:
    """A free wheel that comes to rest."""
    t = np.arange(0.0, 0.4, 1e-3)
    recording = Recording("wheel", t, 0.05 * np.sin(3.0 * t), kind="free_wheel", number=5, elapsed=4.0)
    return recording, Segments(np.array([0]), np.array([0]), np.array([400]))


def swinging() -> tuple[Recording, Segments]:
    """A fast free wheel, which on a spring turns some times."""
    recording, windows = coasting()
    return replace(recording, y=20.0 * recording.y), windows


def both(
    effects: tuple[str, ...], known: dict[str, float], recording: Recording, windows: Segments, jumping: float = 0.01
) -> tuple[Any, Any, list[str]]:
    """Derivatives (samples, K) carried along and by central differences, by each parameter that is not zero, relative;
    their names. The positions are compared on the way. jumping: share of the samples that differences may not tell."""
    model = Model("sine", effects)
    simulator = Simulator(model, pack_inputs([recording]), 3)
    params, guided = model.vector(AXIS | known), recording.kind != "free_wheel"
    names = [p.name for p in model.parameters if p.name not in MARKS and params[model.slot(p.name)] != 0.0]
    slots, count = [model.slot(name) for name in names], windows.count.size
    tangents = np.zeros((len(names), params.size))
    tangents[np.arange(len(names)), slots] = params[slots]
    starts = np.full((count, 3), np.nan)
    starts[:, 0], starts[:, 1] = recording.y[windows.first], np.gradient(recording.y, 1e-3)[windows.first]
    starts[1::2, 2] = 1e-5
    assert simulator.has_slopes(guided)
    nothing = np.zeros((count, 3, len(names)))
    y, found = simulator.slopes(params, tangents, windows, starts, nothing, guided=guided)
    np.testing.assert_array_equal(y, simulator.run(params[None], windows, starts[None], guided=guided)[0][0])
    expected = []
    for step in (STEP, 0.1 * STEP):
        moved = np.concatenate([params + step * tangents, params - step * tangents])
        runs = simulator.run(moved, windows, np.repeat(starts[None], len(moved), axis=0), guided=guided)[0]
        expected.append((runs[: len(names)] - runs[len(names) :]).T / (2.0 * step))
    # Where one of two runs jumps, as over the end of a gap, a tenth of the step jumps ten times as far, or no more.
    told = np.abs(expected[0] - expected[1]) < 1e-2 * np.maximum(np.abs(expected[0]).max(axis=0), 1e-7)
    assert np.all(told.mean(axis=0) > 1.0 - jumping)
    return np.where(told, found, expected[0]), expected[0], names


def check(found: Any, expected: Any, names: list[str], most: float) -> None:
    """Compare columns, in parts of their largest value, 0.1 um at least; a step that is halved in one of the two runs
    only shows in the differences."""
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-7)
    worst = np.abs(found - expected).max(axis=0) / scale
    assert np.all(worst < most), dict(zip(names, worst, strict=True))
    usual = np.sqrt(np.mean((found - expected) ** 2, axis=0)) / scale
    assert np.median(usual) < 0.1 * most


@pytest.mark.parametrize("effect", KNOWN)
def test_slopes_of_a_driven_axis_with_an_effect(effect: str) -> None:
    found, expected, names = both((effect,), SAMPLES[effect], *driven((effect,)))
    assert set(SAMPLES[effect]) - MARKS - {k for k, x in SAMPLES[effect].items() if x == 0.0} <= set(names)
    check(found, expected, names, 1e-2)


@pytest.mark.parametrize("effect", COASTING)
def test_slopes_of_a_coast_down_with_an_effect(effect: str) -> None:
    """Forces act at the simulated position here."""
    check(*both((effect,), SAMPLES[effect], *coasting()), 1e-3)


@pytest.mark.parametrize("effect", ["thermal_derating", "force_saturation", "end_effect", "cable_force"])
@pytest.mark.parametrize("text", ["grip: c*F*sin(300*y)", "rub: -abs(F)*sign(v)*c", "sway: c*acceleration"])
def test_slopes_with_an_own_term_beside_an_effect(text: str, effect: str) -> None:
    """What an effect makes of the motor's force, terms that hang on it hear of."""
    values = {f"{text.partition(':')[0]}_c": 0.05} | SAMPLES[effect]
    check(*both((effect, text), values, *driven((effect,))), 1e-2)


@pytest.mark.parametrize("text", OWN)
def test_slopes_with_an_own_term(text: str) -> None:
    name = text.partition(":")[0]
    values = {f"{name}_{key}": value for key, value in OWN[text].items()}
    found, expected, names = both((text,), values, *driven(()))
    assert set(values) <= set(names)
    check(found, expected, names, 1e-2)


@pytest.mark.parametrize("text", REMEMBERING)
@pytest.mark.parametrize("wheel", [False, True])
@pytest.mark.parametrize("beside", [(), ("friction_drift",), ("cable_force", "end_effect")])
def test_slopes_with_an_own_term_that_remembers(text: str, wheel: bool, beside: tuple[str, ...]) -> None:
    """Turning points move with the motion; when an axis turns, in whole steps, does not."""
    values = {f"{text.partition(':')[0]}_{key}": value for key, value in REMEMBERING[text].items()} | {"spring_k": 2e3}
    for effect in beside:
        values |= SAMPLES[effect]
    effects = (*beside, text, "spring: -k*y") if wheel else (*beside, text)
    axis, jumping = (swinging(), 0.3) if wheel else (driven(beside), 0.1)
    check(*both(effects, values, *axis, jumping), 1e-2)


@pytest.mark.parametrize(
    "others",
    [
        ("cogging", "end_effect"),
        ("cogging", "input_delay"),
        ("end_effect", "position_dependent_friction"),
        ("flexible_load", "cable_force"),
        ("dwell_stiction", "end_effect"),
    ],
)
def test_many_effects_at_once(others: tuple[str, ...]) -> None:
    effects = (*others, "load_dependent_friction", "asymmetric_friction", "gravity", "current_offset")
    known = {name: value for effect in effects for name, value in SAMPLES[effect].items()}
    check(*both(effects, known, *driven(effects)), 1e-2)


@pytest.mark.parametrize("effects", [("flexible_load",), ("cable_force", "flexible_load"), ("backlash",)])
def test_slopes_by_hidden_states_at_the_start(effects: tuple[str, ...]) -> None:
    """By the place alone they are not told: the very first force acts there, all others at the measured place."""
    recording, windows = driven(effects)
    model = Model("sine", effects)
    simulator = Simulator(model, pack_inputs([recording]), 3)
    params = model.vector(AXIS | {name: value for effect in effects for name, value in SAMPLES[effect].items()})
    states = len(model.states)
    starts = np.full((windows.count.size, 3 + states), 1e-5)
    starts[:, 0], starts[:, 1] = recording.y[windows.first], np.gradient(recording.y, 1e-3)[windows.first]
    count = 1 + states
    moved = np.zeros((windows.count.size, 3 + states, count))
    moved[:, [1, *range(3, 3 + states)], np.arange(count)] = 1e-5
    nothing = np.zeros((count, params.size))
    found = simulator.slopes(params, nothing, windows, starts, moved)[1]
    shifted = np.concatenate([starts + 1e-2 * moved.transpose(2, 0, 1), starts - 1e-2 * moved.transpose(2, 0, 1)])
    runs = simulator.run(np.repeat(params[None], len(shifted), axis=0), windows, shifted, guided=True)[0]
    expected = (runs[:count] - runs[count:]).T / 2e-2
    scale = np.abs(expected).max(axis=0)
    assert np.all(np.median(np.abs(found - expected), axis=0) < 1e-5 * scale)
    assert np.all(np.abs(found - expected).max(axis=0) < 1e-2 * scale)


def test_hidden_states_that_decide_what_the_motor_gets_are_differenced(monkeypatch: pytest.MonkeyPatch) -> None:
    @term
    def drive(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, derating, thermal_time):  # type: ignore[no-untyped-def]
        return i_1 - derating * s_1, i_2, i_3

    simulator = Simulator(Model("sine", ("thermal_derating",)), pack_inputs([synchronous_run(0.1)]), 2)
    assert simulator.has_slopes(True)
    driven_by_heat = replace(find_effect("thermal_derating"), thrust=None, drive=drive)
    monkeypatch.setattr(run, "find_effect", lambda name: driven_by_heat)
    assert not simulator.has_slopes(True)


def test_what_the_motor_gets_hangs_on_no_speed() -> None:
    """Derivatives take it at the measured place, whatever the speed there."""
    for effect in EFFECTS:
        for name in ("drive", "field"):
            term = getattr(effect, name)
            if term is not None and not effect.states:
                loaded = {i.argval for i in dis.get_instructions(term.py_func) if i.opname == "LOAD_FAST"}
                assert "v" not in loaded, effect.name
