"""Predictions of axes with hidden states start from what the samples before tell."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from linid.api import read
from linid.diagnosis.measures import measure_gaps
from linid.identification.fit import fit
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.start_states import predicted_from_before, slopes_from_before
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.shared_data import shared
from tests.simulation.axis_with_effects import AXIS, SAMPLES, campaign_with

MODEL = Model("force", ("flexible_load",))
PLANT = {
    "force_constant": 100.0,
    "coulomb_force": 10.0,
    "static_force": 10.0,
    "stribeck_velocity": 0.05,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1e5,
    "bristle_damping": 100.0,
    "viscous_friction": 10.0,
    "mass": 1.0,
    "load_mass": 0.5,
    "load_frequency": 53.0,
    "load_damping": 0.01,
}
VECTOR = MODEL.vector(PLANT)[None, :]


def recording(encoder: float = 0.0, step: float = 0.0) -> Recording:
    """Two seconds at 2 kHz of an axis with a swinging load under a multisine; encoder: noise, m; step: of it, m."""
    generator = np.random.default_rng(7)
    t = np.arange(4001) * 5e-4
    lines = np.arange(10.0, 200.0, 1.5)
    phases = generator.uniform(0.0, 2.0 * np.pi, lines.size)
    current = np.sum(np.sin(2.0 * np.pi * lines[:, None] * t + phases[:, None]), axis=0)
    exact = Recording("run", np.asarray(t), np.zeros(t.size), drive_input=np.asarray(current))
    simulator = Simulator(MODEL, pack_inputs([exact]), 8)
    y = simulator.run(VECTOR, whole_recordings(simulator.inputs), np.array([[[0.0, 0.0, np.nan]]]))[0][0]
    y = np.asarray(y + encoder * generator.standard_normal(t.size))
    return replace(exact, y=np.asarray(np.round(y / step) * step) if step else y)


def part(one: Recording) -> Ahead:
    return Ahead(MODEL, (one,), 4, 1, project=False, skip_jumps=False, guided=False)


def end_error(ahead: Ahead, predicted: np.ndarray) -> float:
    ends = ahead.segments.out_offsets[1:] - 1
    return float(np.sqrt(np.mean((predicted[0] - ahead.measured)[ends][2:] ** 2)))  # the first have no stretch before


def from_the_smoothed_motion(ahead: Ahead) -> np.ndarray:
    """Predictions from measured position and speed and the states that follow from the smoothed motion alone."""
    motion = ahead.motion
    along = ahead.simulator.along(VECTOR, motion.y, motion.v, motion.standstill, np.full((1, 1), np.nan))
    starts = along.starts(ahead.flat_first, motion.y, motion.v, ahead.simulator.inputs)
    return ahead.simulator.run(VECTOR, ahead.segments, starts)[0]


@pytest.mark.parametrize(("encoder", "step"), [(1e-6, 0.0), (1e-5, 0.0), (1e-4, 0.0), (0.0, 5e-5), (0.0, 2e-4)])
def test_a_swinging_load_starts_better_than_from_the_smoothed_motion(encoder: float, step: float) -> None:
    ahead = part(recording(encoder, step))
    error = end_error(ahead, ahead.simulate(VECTOR))
    assert error < 0.4 * end_error(ahead, from_the_smoothed_motion(ahead))
    noise = np.hypot(encoder, step / np.sqrt(12.0))
    assert error < 4.0 * max(noise, 3e-5)  # of which one is the reading at the window's end itself


def test_what_comes_after_a_window_has_begun_has_no_say() -> None:
    one = recording(1e-5)
    ahead = part(one)
    first = int(ahead.flat_first[10])
    later = one.y + np.where(np.arange(one.y.size) > first, 5e-3 * np.sin(np.arange(one.y.size) / 50.0), 0.0)
    other = part(replace(one, y=later))
    rows = slice(0, int(ahead.segments.out_offsets[11]))
    change = other.simulate(VECTOR)[0, rows] - ahead.simulate(VECTOR)[0, rows]
    assert float(np.max(np.abs(change))) < 2e-5  # by the RMS of the swing, which the prior takes from the whole run


def test_without_hidden_states_predictions_start_from_the_measured_motion() -> None:
    """To the last bit: fits of such models are what they were."""
    one, model = recording(1e-5), Model("force")
    ahead = Ahead(model, (one,), 4, 1, project=False, skip_jumps=False, guided=False)
    vector = model.vector(PLANT)[None, :]
    motion = ahead.motion
    along = ahead.simulator.along(vector, motion.y, motion.v, motion.standstill, np.full((1, 1), np.nan))
    starts = along.starts(ahead.flat_first, motion.y, motion.v, ahead.simulator.inputs)
    np.testing.assert_array_equal(ahead.simulate(vector), ahead.simulator.run(vector, ahead.segments, starts)[0])


def test_the_flexible_shaft_of_two_mass_predicts_what_a_stiff_one_cannot() -> None:
    """Held out; fitted to 1 s. The antiresonance is known to be at 53 Hz, half of the inertia to be the load's."""
    fitted, held = (cut(r, 1.0) for r in read(shared("real", "two_mass", "file_a.yaml")))
    errors = {}
    for effects in ((), ("flexible_load",)):
        settings = FitSettings(search=SearchSettings(generations=3))
        result = fit("force", [fitted], settings=settings, effects=effects, known={"mass": 1.0})
        errors[effects] = measure_gaps(result, [replace(held, split="held_out")], floors=False)[0][0].ahead
        if effects:
            assert result.value("load_frequency") == pytest.approx(53.0, rel=0.05)
            assert result.value("load_mass") == pytest.approx(0.52, rel=0.1)
    assert errors["flexible_load",] < 0.5 * errors[()]


def cut(one: Recording, seconds: float) -> Recording:
    n = round(seconds / one.period)
    assert one.drive_input is not None
    return replace(one, t=one.t[:n], y=one.y[:n], v=None, drive_input=one.drive_input[:n])


TOLD = [effect.name for effect in EFFECTS if effect.told]


@pytest.mark.parametrize("name", [name for name in TOLD if find_effect(name).states_are_driven_by("v")])
def test_what_the_motion_tells_forgets_how_it_began(name: str) -> None:
    """Two starts that differ by as much as the state ever moves end in the same state, along any driven recording."""
    effect = find_effect(name)
    values = [SAMPLES[name].get(p.name, p.default) for p in effect.parameters]
    for one in (r for r in campaign_with((name,)) if r.phase_currents is not None):
        state = np.array([0.0, 1.0])
        for y, travel in zip(one.y[:-1], np.diff(one.y), strict=True):
            moved = (one.period, 0.0, y, travel / one.period, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            state = np.array([effect.advance.py_func(*moved, start, *values)[0] for start in state])
        assert abs(state[1] - state[0]) < 1e-4


@pytest.mark.parametrize("name", [name for name in TOLD if not find_effect(name).play])  # see test_behind_play.py
def test_the_true_model_predicts_to_the_noise_where_its_states_are_told(name: str) -> None:
    """Hidden states estimated from the samples before would add a quarter of the noise (cable force)."""
    noise = 1e-6
    recordings = campaign_with((name,), noise=noise)
    errors = {}
    for effects in ((), (name,)):
        model = Model("sine", effects)
        assert not model.untold_states
        vector = model.vector({p.name: (AXIS | SAMPLES[name]).get(p.name, p.default) for p in model.parameters})
        left = Ahead(model, tuple(recordings), 8, 1).residuals(vector[None], np.zeros((1, 0)))
        errors[effects] = float(np.sqrt(np.mean(left**2)))
    assert errors[name,] < 1.25 * noise
    assert errors[()] > 3.0 * noise


OTHERS = {
    "cable_force": {
        "cable_preload": 3.0,
        "cable_stiffness": 200.0,
        "cable_hysteresis": 4.0,
        "cable_hysteresis_length": 2e-3,
    },
    "drive_train_backlash": {"backlash_load_mass": 0.3, "backlash_load_gap": 2e-4, "backlash_load_frequency": 40.0},
    "dwell_stiction": {"dwell_growth": 0.2, "dwell_length": 1e-3, "dwell_time": 0.05},
}


@pytest.mark.parametrize("effects", [("flexible_load",), *((name, "flexible_load") for name in OTHERS)])
def test_derivatives_of_predictions_are_those_of_differences(effects: tuple[str, ...]) -> None:
    """By all parameters, where differences of two steps agree: they jump where a step of one run alone is halved, or
    where a stretch gets worse by the step to better start states."""
    model = Model("force", effects)
    known = {p.name for p in model.parameters}
    values = {key: value for key, value in (PLANT | {"static_force": 12.0}).items() if key in known}
    vector = model.vector(values | {key: x for name in effects for key, x in OTHERS.get(name, {}).items()})
    ahead = Ahead(model, (recording(1e-6),), 4, 1, project=False, skip_jumps=False)
    names = [p.name for p in model.parameters if vector[model.slot(p.name)] != 0.0]
    tangents = np.zeros((len(names), vector.size))
    slots = [model.slot(name) for name in names]
    tangents[np.arange(len(names)), slots] = vector[slots]
    given = ahead.simulator, ahead.motion, ahead.segments
    y, slopes = slopes_from_before(given[0], vector, tangents, *given[1:], guided=True)
    moved = [vector[None], *(vector + sign * step * tangents for step in (1e-5, 2e-6, 4e-7) for sign in (1.0, -1.0))]
    runs = predicted_from_before(given[0], np.concatenate(moved), *given[1:], guided=True)
    np.testing.assert_array_equal(y, runs[0])
    up_and_down = runs[1:].reshape(3, 2, len(names), -1)
    by_step = [(up - down).T / (2.0 * step) for (up, down), step in zip(up_and_down, (1e-5, 2e-6, 4e-7), strict=True)]
    found = []
    for rough, expected in pairwise(by_step):
        scale = np.median(np.abs(expected), axis=0) + 1e-12
        smooth = np.abs(expected - rough) <= 1e-2 * scale
        size = np.sqrt(np.nanmean(np.where(smooth, expected, np.nan) ** 2, axis=0))
        off = np.nanquantile(np.where(smooth, np.abs(slopes - expected), np.nan), 0.9, axis=0) / size
        found.append((smooth.mean(axis=0), off))
    (share, usual), (share_of_little, usual_of_little) = found
    # Small steps leave rounding where a parameter hardly matters, large ones jumps: what tells more is taken.
    usual = np.where(share_of_little > share, usual_of_little, usual)
    assert np.all(np.maximum(share, share_of_little) > 0.1)
    assert np.all(usual < 5e-2), dict(zip(names, usual, strict=True))
    assert np.all(np.linalg.norm(slopes, axis=0) < 1.1 * np.linalg.norm(rough, axis=0))
