"""Simulations side by side with their derivatives: as the kernel of one at a time has them, whatever stands beside."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.physics.effects.registry import canonical
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording
from linid.simulation.forces import Bristles
from linid.simulation.friction_slopes import level_slopes, phi_slopes
from linid.simulation.inputs import pack_inputs
from linid.simulation.lane_slopes import level_slopes_lanes, phi_slopes_lanes
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.run import Segments, Simulator, whole_recordings
from tests.identification.stand import FREE_WHEELS, stand
from tests.simulation.test_lockstep import ahead, scattered


@njit(error_model="numpy")
def phi_of_lanes(half_trace: Any, square: Any, out: Any) -> None:
    """All values of `phi_slopes_lanes` into the rows of out (18 n,)."""
    n = half_trace.size
    for k in range(0, n, LANES):
        x, z = lanes_at(half_trace, k), lanes_at(square, k)
        row = 0
        for values in phi_slopes_lanes(x, z, x == x):
            for value in values:
                put_lanes(out, row * n + k, value)
                row += 1


@njit(error_model="numpy")
def level_of_lanes(v: Any, exponent: Any, out: Any) -> None:
    """The derivatives of `level_slopes_lanes` into the rows of out (10 n,)."""
    for k in range(0, v.size, LANES):
        x = lanes_at(v, k)
        one = 0.0 * x
        bristles = Bristles(2.0 + one, 3.0 + one, 5e-3 + one, lanes_at(exponent, k), one, one, one, one)
        found = level_slopes_lanes(x, bristles, True)
        row = 0
        for values in (found.level_by, found.fall_by):
            for value in values:
                put_lanes(out, row * v.size + k, value)
                row += 1


@njit
def one_phi(half_trace: float, square: float) -> Any:
    return phi_slopes(half_trace, square)


@njit
def one_level(v: float, exponent: float) -> Any:
    return level_slopes(v, 2.0, 3.0, 5e-3, exponent, True)


def test_phi_functions_and_their_slopes_for_lanes() -> None:
    """Over all branches, against the doubles' own, which are checked in sixty digits."""
    generator = np.random.default_rng(1)
    half_trace = -(10.0 ** generator.uniform(-8, 3, 4096))
    square = 10.0 ** generator.uniform(-12, 5, 4096) * generator.choice([-1.0, 1.0], 4096)
    square = np.minimum(square, half_trace**2)
    expected = np.array([np.ravel(one_phi(*pair)) for pair in zip(half_trace, square, strict=True)]).T
    found = np.zeros(expected.shape)
    phi_of_lanes(half_trace, square, found.reshape(-1))
    size = np.maximum(np.abs(expected), 1e-3 * np.minimum(1.0, 1.0 / np.maximum(1.0, np.abs(square))))
    assert (np.abs(found - expected) / size).max() < 1e-9


def test_slopes_of_the_stribeck_curve_for_lanes() -> None:
    v = np.concatenate([[0.0, -0.0, 1e-250, -1e-200], np.geomspace(1e-9, 1.0, 196), -np.geomspace(1e-9, 1.0, 200)])
    for exponent in (0.5, 0.83, 1.0, 1.9, 2.0):
        found = np.zeros((10, v.size))
        level_of_lanes(v, np.full(v.size, exponent), found.reshape(-1))
        of = [one_level(one, exponent) for one in v]
        expected = np.array([[*one.level_by, *one.fall_by] for one in of]).T
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-14)


def directions(model: Model, vector: np.ndarray) -> np.ndarray:
    """All parameters (K, VECTOR_SIZE), each by its own size."""
    out = np.zeros((len(model.parameters), vector.size))
    for row, parameter in enumerate(model.parameters):
        place = model.slot(parameter.name)
        out[row, place] = vector[place] if vector[place] != 0.0 else 1.0
        if parameter.name == "electrical_wavenumber":  # of which a thousandth turns the field by more than a radian
            out[row, place] *= 1e-3
    return out


@cache
def windows(kind: str) -> tuple[Simulator, Segments, np.ndarray, np.ndarray, np.ndarray]:
    """Of the stand: simulator, windows, true parameters, starts and slopes of these by place, speed and bristle."""
    objective, vector = ahead(kind)
    starts = objective._starts(vector)[0]
    moved = np.zeros((*starts.shape, len(directions(objective.model, vector[0])) + 3))
    moved[:, [0, 1, 2], [-3, -2, -1]] = 1.0, 1.0, 1e-4
    return objective.simulator, objective.segments, vector[0], starts, moved


def all_directions(simulator: Simulator, vector: np.ndarray) -> np.ndarray:
    """Those of the parameters, and three that the start alone has."""
    of_parameters = directions(simulator.model, vector)
    return np.vstack([of_parameters, np.zeros((3, vector.size))])


@pytest.mark.parametrize("kind", ["sine", "theta"])
def test_slopes_of_windows_are_as_one_at_a_time(kind: str) -> None:
    """By every parameter and start, under scattered candidates too. The kernel of one at a time knows models with
    effects; this one's does nothing."""
    simulator, segments, vector, starts, moved = windows(kind)
    with_effect = Model(kind, ("gravity",))
    alone = Simulator(with_effect, simulator.inputs, simulator.substeps)
    for params in (vector, *scattered(simulator.model, vector[None], 6, 5.0, 3)):
        tangents = all_directions(simulator, params)
        y, slopes = simulator.slopes(params, tangents, segments, starts, moved)
        assert params[with_effect.slot("gravity_sine")] == params[with_effect.slot("gravity_cosine")] == 0.0
        expected_y, expected = alone.slopes(params, tangents, segments, starts, moved)
        assert np.abs(y - expected_y).max() < 1e-10
        error, size = np.abs(slopes - expected), np.sqrt(np.mean(expected**2, axis=0))
        # At reversals rounding is amplified; the other kernel has the motor's force by differences.
        assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 5e-5 * size + 1e-15)
        assert np.all(np.median(error, axis=0) < 2e-6 * size + 1e-18)


@pytest.mark.parametrize("kind", [kind for kind, motor in MOTORS.items() if motor.inputs])
def test_every_motor(kind: str) -> None:
    """Those whose field is no table of harmonics too: against differences of whole runs, far from reversals."""
    model, t = Model(kind), np.arange(0.0, 0.1, 1e-3)
    currents = 2.0 * np.sin(60.0 * t + np.array([[0.0], [2.0], [4.0]]))
    y = 0.3 * t
    driven = Recording("r", t, y, phase_currents=currents)
    if MOTORS[kind].inputs == 1:
        driven = Recording("r", t, y, drive_input=currents[0], input_unit="A")
    simulator = Simulator(model, pack_inputs([driven, Recording("w", t, y, kind="free_wheel")]), 2)
    whole, params = whole_recordings(simulator.inputs), model.vector({})
    starts = np.tile([0.0, 0.5, 1e-6], (whole.count.size, 1))
    tangents = directions(model, params)
    found_y, slopes = simulator.slopes(params, tangents, whole, starts, np.zeros((*starts.shape, len(tangents))))
    ends = [
        simulator.run(params + sign * 1e-5 * tangents, whole, np.repeat(starts[None], len(tangents), 0), guided=True)[0]
        for sign in (1.0, -1.0)
    ]
    expected = (ends[0] - ends[1]).T / 2e-5
    assert np.array_equal(found_y, simulator.run(params[None], whole, starts[None], guided=True)[0][0])
    worst = np.abs(slopes - expected).max(axis=0)
    assert np.all(worst < 1e-4 * np.abs(expected).max(axis=0) + 1e-9)
    places = [model.slot(p.name) for p in model.parameters]
    rows = slice(t.size, None)  # the coast-down, of which a motor says nothing
    assert np.all(slopes[rows, np.array(places) >= 8] == 0.0)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([1, 2]))
@settings(max_examples=20, deadline=None)
def test_windows_and_columns_have_the_same_bits_in_any_company(seed: int, company: int, jobs: int) -> None:
    """In any order, in any number, beside any columns, in any number of threads; positions are those of the run."""
    generator = np.random.default_rng(seed)
    simulator, segments, vector, starts, moved = windows("theta")
    params = scattered(simulator.model, vector[None], 1, 30.0, seed)[0]
    tangents = all_directions(simulator, params)
    chosen = generator.permutation(segments.count.size)[:company]
    part = Segments(*(column[chosen] for column in segments))
    columns = generator.permutation(len(tangents))[: int(generator.integers(1, len(tangents) + 1))]
    together = Simulator(simulator.model, simulator.inputs, 2, jobs)
    y, slopes = together.slopes(params, tangents[columns], part, starts[chosen], moved[chosen][:, :, columns])
    assert np.array_equal(y, simulator.run(params[None], part, starts[None, chosen], guided=True)[0][0], equal_nan=True)
    s, c = int(generator.integers(company)), int(generator.integers(columns.size))
    one = Segments(*(column[s : s + 1] for column in part))
    at, of = chosen[s : s + 1], columns[c : c + 1]
    alone = simulator.slopes(params, tangents[of], one, starts[at], moved[at][:, :, of])[1]
    a, b = part.out_offsets[s : s + 2]
    assert np.array_equal(slopes[a:b, c], alone[:, 0], equal_nan=True)


def test_free_wheels_that_begin_as_the_model_has_them() -> None:
    """Their bristle is not given: sliding, at rest and held. Against differences of whole runs in the mean."""
    model = Model("friction")
    simulator = Simulator(model, pack_inputs([r for r in stand().recordings if r.name in FREE_WHEELS]), 2)
    whole = whole_recordings(simulator.inputs)
    params = model.vector({p.name: stand().truth.get(p.name, p.default) for p in model.parameters})
    starts = np.full((whole.count.size, 3), math.nan)
    starts[:, 0], starts[:, 1] = 0.1, [0.5, -0.3, 0.01, 0.0]
    tangents = directions(model, params)[[0, 1, 2, 4, 5, 6, 7]]
    y, slopes = simulator.slopes(params, tangents, whole, starts, np.zeros((*starts.shape, len(tangents))))
    assert np.array_equal(y, simulator.run(params[None], whole, starts[None])[0][0])
    ends = [
        simulator.run(params + sign * 1e-5 * tangents, whole, np.repeat(starts[None], len(tangents), 0))[0]
        for sign in (1.0, -1.0)
    ]
    expected = (ends[0] - ends[1]).T / 2e-5
    error = np.sqrt(np.mean((slopes - expected) ** 2, axis=0))
    assert np.all(error < 2e-3 * np.sqrt(np.mean(expected**2, axis=0)))
    a, b = whole.out_offsets[3:5]
    assert np.all(slopes[a:b] == 0.0)  # of an axis that stands, whatever its friction


def test_one_that_runs_away_and_one_sample() -> None:
    simulator, segments, vector, starts, moved = windows("sine")
    tangents = all_directions(simulator, vector)
    expected = simulator.slopes(vector, tangents, segments, starts, moved)[1]
    lost = starts.copy()
    lost[5, 1], lost[9, 1] = 1e9, math.nan
    y, slopes = simulator.slopes(vector, tangents, segments, lost, moved)
    edges = segments.out_offsets
    for s in (5, 9):
        assert np.all(np.isnan(y[edges[s] + 1 : edges[s + 1]]))
        assert np.all(np.isnan(slopes[edges[s] + 1 : edges[s + 1]]))
        slopes[edges[s] : edges[s + 1]] = expected[edges[s] : edges[s + 1]]
    assert np.array_equal(slopes, expected)
    one = Segments(segments.recording[:2], segments.first[:2], np.ones(2, dtype=np.int64))
    found = simulator.slopes(vector, tangents, one, starts[:2], moved[:2])[1]
    assert np.array_equal(found, moved[:2, 0])


@pytest.mark.parametrize(
    "effects",
    [
        (),
        ("phase_gain_imbalance",),
        ("input_delay", "quadratic_drag"),
        ("mine: c_1 * cos(60 * y) + c_2 * v", "phase_gain_imbalance", "yours: c_1 * F * y"),
    ],
)
def test_a_coast_down_tells_nothing_of_its_motor(effects: tuple[str, ...]) -> None:
    """Nor of effects on inputs alone, nor of own terms by the motor's force, but of other ones: whole runs do not
    change, and the other columns are as without these."""
    model = Model("theta", canonical(effects))
    simulator = Simulator(model, pack_inputs([r for r in stand().recordings if r.name in FREE_WHEELS]), 2)
    whole = whole_recordings(simulator.inputs)
    params = model.vector({p.name: stand().truth.get(p.name, p.default) for p in model.parameters})
    starts = np.tile([0.1, 0.4, 1e-6], (whole.count.size, 1))
    tangents = directions(model, params)
    still = np.zeros((*starts.shape, len(tangents)))
    slopes = simulator.slopes(params, tangents, whole, starts, still, guided=False)[1]
    moved = simulator.run(params + 1e-4 * tangents, whole, np.repeat(starts[None], len(tangents), 0))[0]
    silent = np.all(moved == simulator.run(params[None], whole, starts[None])[0], axis=1)
    assert np.array_equal(silent, np.all(slopes == 0.0, axis=0)) and silent.sum() >= 6
    for name in ("mine_c_1", "mine_c_2") if len(effects) > 2 else ():
        assert not silent[[p.name for p in model.parameters].index(name)]
    told = tangents[~silent]
    expected = simulator.slopes(params, told, whole, starts, still[:, :, ~silent], guided=False)[1]
    assert np.array_equal(slopes[:, ~silent], expected)
