"""Simulations side by side: as the kernel of one at a time has them, whatever stands beside them."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.identification.objectives.ahead import Ahead
from linid.physics.friction import _phi_pairs, stribeck_fall
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.lane_functions import exp_lanes, phi_pairs_lanes, sine_cosine_lanes, stribeck_lanes
from linid.simulation.lanes import LANES, bits_of, gathered, lanes_at, put_lanes, select
from linid.simulation.run import Segments, Simulator, whole_recordings
from tests.identification.stand import FREE_WHEELS, stand

ROOT = Path(__file__).resolve().parents[2]


@njit(error_model="numpy")
def values_of(which: int, a: Any, b: Any, out: Any) -> None:
    """Lane functions of a (n,) and b (n,) into the rows of out (n LANES,)."""
    for k in range(0, a.size, LANES):
        x, z = lanes_at(a, k), lanes_at(b, k)
        if which == 0:
            put_lanes(out, k, exp_lanes(x))
        elif which == 1:
            sine, cosine = sine_cosine_lanes(x)
            put_lanes(out, k, sine)
            put_lanes(out, a.size + k, cosine)
        elif which == 2:
            level, fall = stribeck_lanes(x, 2.0 + 0.0 * x, 3.0 + 0.0 * x, 5e-3 + 0.0 * x, z)
            put_lanes(out, k, level)
            put_lanes(out, a.size + k, fall)
        else:
            e_1, o_1, e_2, o_2, e_3, o_3 = phi_pairs_lanes(x, z, x == x)
            put_lanes(out, k, e_1)
            put_lanes(out, a.size + k, o_1)
            put_lanes(out, 2 * a.size + k, e_2)
            put_lanes(out, 3 * a.size + k, o_2)
            put_lanes(out, 4 * a.size + k, e_3)
            put_lanes(out, 5 * a.size + k, o_3)


def lane_values(which: int, a: np.ndarray, b: np.ndarray | None = None) -> np.ndarray:
    out = np.zeros((6, a.size))
    values_of(which, a, a if b is None else b, out.reshape(-1))
    return out


def test_exponential_sine_and_cosine() -> None:
    x = np.concatenate([np.linspace(-700.0, 700.0, 4000), np.linspace(-1e-3, 1e-3, 96)])
    assert lane_values(0, x)[0] == pytest.approx(np.exp(x), rel=1e-15)
    angle = np.linspace(-1e4, 1e4, 8000)
    sine, cosine = lane_values(1, angle)[:2]
    assert np.abs(sine - np.sin(angle)).max() < 3e-16 and np.abs(cosine - np.cos(angle)).max() < 3e-16
    ends = lane_values(0, np.array([-1e9, 1e9, math.nan, -math.inf, math.inf, 0.0, -710.0, 710.0]))[0]
    assert np.all(ends[[0, 3, 6]] < 1e-307) and np.all(ends[[1, 4, 7]] > 1e307)
    assert math.isnan(ends[2]) and ends[5] == 1.0


def test_the_stribeck_curve_of_lanes() -> None:
    v = np.concatenate([[0.0, -0.0, 1e-320, 1e-200], np.geomspace(1e-9, 1.0, 396)])
    for exponent in (0.5, 0.83, 1.0, 1.9, 2.0):
        found = lane_values(2, v, np.full(v.size, exponent))[:2].T
        expected = [stribeck_fall(one, 2.0, 3.0, 5e-3, exponent) for one in v]
        assert found == pytest.approx(np.array(expected), rel=1e-14, abs=1e-16)
    assert np.all(np.isnan(lane_values(2, np.full(LANES, math.nan), np.full(LANES, 1.3))[0]))


def test_phi_functions_of_lanes() -> None:
    """Over all branches; the odd parts of fast oscillations have zeros."""
    generator = np.random.default_rng(1)
    half_trace = -(10.0 ** generator.uniform(-8, 3, 4096))
    square = 10.0 ** generator.uniform(-12, 5, 4096) * generator.choice([-1.0, 1.0], 4096)
    square = np.minimum(square, half_trace**2)
    expected = np.array([_phi_pairs(*pair) for pair in zip(half_trace, square, strict=True)]).T
    size = np.maximum(np.abs(expected), 1e-3 * np.minimum(1.0, 1.0 / np.maximum(1.0, np.abs(square))))
    assert (np.abs(lane_values(3, half_trace, square) - expected) / size).max() < 1e-11


def test_lanes_choose_compare_and_gather() -> None:
    @njit(error_model="numpy")
    def computed(a: Any, b: Any, out: Any) -> Any:
        x, z = lanes_at(a, 0), lanes_at(b, 0)
        less, same = x < z, x == z
        put_lanes(out, 0, select(less | same, x / z, math.copysign(abs(x), -z)))
        put_lanes(out, LANES, select(~less & (z != 2.0), 5.0, math.sqrt(abs(z))))
        put_lanes(out, 2 * LANES, gathered(b, abs(x)))
        return bits_of(less), bits_of(x >= z), bits_of(x <= 1.0), bits_of(x > 1.0)

    a = np.array([0.0, 1.0, -2.0, 3.0, math.nan, 7.0, -6.0, 5.0])
    b = np.array([2.0, 1.0, -3.0, math.nan, 4.0, -7.0, 8.0, 5.0])
    out = np.empty(3 * LANES)
    a_safe = np.where(np.isnan(a), 4.0, a)
    bits = computed(a_safe, b, out)
    less, same = a_safe < b, a_safe == b
    masks = less, a_safe >= b, a_safe <= 1.0, a_safe > 1.0
    assert bits == tuple(int((mask * 2 ** np.arange(LANES)).sum()) for mask in masks)
    chosen = np.where(less | same, a_safe / b, np.copysign(np.abs(a_safe), -b))
    assert np.array_equal(out[:LANES], chosen, equal_nan=True)
    rooted = np.where(~less & (b != 2.0), 5.0, np.sqrt(np.abs(b)))
    assert np.array_equal(out[LANES : 2 * LANES], rooted, equal_nan=True)
    assert np.array_equal(out[2 * LANES :], b[np.abs(a_safe).astype(int)], equal_nan=True)


@cache
def ahead(kind: str) -> tuple[Ahead, np.ndarray]:
    """Windows of the generated stand, and the true parameters (1, VECTOR_SIZE) as far as the motor has them."""
    campaign = stand()
    model = Model(kind)
    names = ("sine_position_1", "moves_1", "sine_current_2", "freewheel_1")
    recordings = tuple(r for r in campaign.recordings if r.name in names)
    values = {p.name: campaign.truth.get(p.name, p.default) for p in model.parameters}
    return Ahead(model, recordings, 2, 1, skip_jumps=False), model.vector(values)[None]


def one_at_a_time(simulator: Simulator) -> Simulator:
    """The same by the kernel of one at a time."""
    return Simulator(simulator.model, simulator.inputs, simulator.substeps, simulator.jobs, specialised=True)


def scattered(model: Model, vector: np.ndarray, count: int, spread: float, seed: int) -> np.ndarray:
    """Candidates (count, VECTOR_SIZE) with friction and mass scattered by factors up to `spread` both ways."""
    generator = np.random.default_rng(seed)
    params = np.repeat(vector, count, axis=0)
    for place, parameter in enumerate(model.parameters[:8]):
        factor = spread ** generator.uniform(-1.0, 1.0, count)
        params[:, place] = np.clip(params[:, place] * factor, parameter.lower, parameter.upper)
    params[:, 1] = params[:, 0] * generator.uniform(1.0, 2.5, count)
    params[:, 3] = np.where(generator.random(count) < 0.4, 2.0, generator.uniform(0.5, 2.0, count))
    return params


def differences(
    simulator: Simulator, params: np.ndarray, segments: Segments, starts: np.ndarray, guided: bool = True
) -> np.ndarray:
    """Of positions in m (C, N) from those of the kernel of one at a time; as many steps, diverged where they are."""
    together, speeds, steps = simulator.run(params, segments, starts, velocity=True, guided=guided)
    alone, alone_speeds, alone_steps = one_at_a_time(simulator).run(
        params, segments, starts, velocity=True, guided=guided
    )
    assert np.array_equal(np.isnan(together), np.isnan(alone)) and abs(steps - alone_steps) < 1e-6 * steps + 1
    assert np.nan_to_num(np.abs(speeds - alone_speeds)).max() < 1e-6 * np.nan_to_num(np.abs(alone_speeds)).max()
    return np.nan_to_num(together - alone)


@pytest.mark.parametrize("guided", [True, False])
@pytest.mark.parametrize("kind", ["sine", "theta"])
def test_windows_of_the_stand_are_as_one_at_a_time(kind: str, guided: bool) -> None:
    objective, vector = ahead(kind)
    found = differences(objective.simulator, vector, objective.segments, objective._starts(vector), guided)
    assert np.abs(found).max() < 1e-12 and np.sqrt(np.mean(found**2)) < 1e-15
    params = scattered(objective.model, vector, 24, 10.0, 2)
    found = differences(objective.simulator, params, objective.segments, objective._starts(params), guided)
    assert np.abs(found).max() < 1e-10 and np.sqrt(np.mean(found**2)) < 1e-13


def test_motors_with_fields_of_their_own_run_side_by_side_where_they_are() -> None:
    """Lanes hold candidates whose fields differ, in their number of harmonics too, and in whether it is harmonics that
    they are computed by; over half a second of recordings, of which one has inputs that step."""
    objective, vector = ahead("theta")
    campaign, model = stand(), objective.model
    recordings = [r for r in campaign.recordings if r.name in ("square_current_1", "moves_1", "freewheel_1")]
    simulator = Simulator(model, pack_inputs(recordings), 3)
    assert list(simulator.inputs.steps) == [r.name == "square_current_1" for r in recordings]
    params = np.repeat(vector, 11, axis=0)
    scale = 1.0 + 0.04 * np.random.default_rng(4).uniform(-1.0, 1.0, (len(params), 3))
    for name, column in zip(("force_constant", "winding_displacement", "mass"), scale.T, strict=True):
        params[:, model.slot(name)] *= column
    params[:, model.slot("nome")] = np.linspace(0.05, 0.97, len(params))
    first = simulator.inputs.sample_offsets[:-1]
    motion = [(float(r.y[0]), float(r.motion.v[0]), np.nan) for r in recordings]
    assert first.size == len(motion)
    starts = np.tile(motion, (len(params), 1, 1))
    segments = Segments(np.arange(3), np.zeros(3, dtype=np.int64), np.full(3, 500))
    found = differences(simulator, params, segments, starts, guided=False)
    assert np.abs(found).max() < 1e-12
    assert np.ptp(simulator.run(params, segments, starts)[0][:, segments.count[0] - 1]) > 1e-4


@pytest.mark.parametrize("spread", [3.0, 1e3])
def test_free_wheels_are_as_one_at_a_time(spread: float) -> None:
    """Candidates of the search's box: bristles that oscillate, axes that stick at once or hardly slow down. Where the
    last bit of a parameter decides, it may be off as far as that takes it."""
    model = Model("friction")
    simulator = Simulator(model, pack_inputs([r for r in stand().recordings if r.name in FREE_WHEELS]), 2)
    whole = whole_recordings(simulator.inputs)
    values = {p.name: stand().truth.get(p.name, p.default) for p in model.parameters}
    params = scattered(model, model.vector(values)[None], 150, spread, 5)
    starts = np.full((len(params), whole.count.size, 3), np.nan)
    starts[:, :, 0], starts[:, :, 1] = 0.1, [0.5, -0.3, 0.01, 0.0]
    found = np.abs(differences(simulator, params, whole, starts)).max(axis=1)
    decided, one = np.zeros(len(params)), one_at_a_time(simulator)
    expected = one.run(params, whole, starts)[0]
    for place in range(8):
        moved = params.copy()
        moved[:, place] = np.nextafter(moved[:, place], math.inf)
        decided = np.maximum(decided, np.nan_to_num(np.abs(one.run(moved, whole, starts)[0] - expected)).max(axis=1))
    assert np.all(found <= np.maximum(1e-12, 10.0 * decided)) and np.median(found) < 1e-15


@pytest.mark.parametrize("guided", [True, False])
@pytest.mark.parametrize("between", ["spline", "hold"])
@pytest.mark.parametrize("kind", [kind for kind, motor in MOTORS.items() if motor.inputs])
def test_every_motor(kind: str, between: Any, guided: bool) -> None:
    """Those whose field is no table of harmonics too, and inputs that step at each sample."""
    model, t = Model(kind), np.arange(0.0, 0.3, 1e-3)
    currents = 2.0 * np.sin(60.0 * t + np.array([[0.0], [2.0], [4.0]]))
    y = 0.01 * np.sin(60.0 * t)
    driven = Recording("r", t, y, phase_currents=currents, between_samples=between)
    if MOTORS[kind].inputs == 1:
        driven = Recording("r", t, y, drive_input=currents[0], input_unit="A", between_samples=between)
    simulator = Simulator(model, pack_inputs([driven, Recording("w", t, y, kind="free_wheel")]), 2)
    whole = whole_recordings(simulator.inputs)
    starts = np.tile([0.0, 0.1, np.nan], (1, whole.count.size, 1))
    found = differences(simulator, model.vector({})[None], whole, starts, guided)
    assert np.abs(found).max() < 1e-12


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([1, 2]), st.booleans())
@settings(max_examples=40, deadline=None)
def test_a_window_has_the_same_bits_in_any_company(seed: int, company: int, jobs: int, guided: bool) -> None:
    """In any order, in any number, beside any candidates, in any number of threads."""
    generator = np.random.default_rng(seed)
    objective, vector = ahead("theta")
    params = scattered(objective.model, vector, 3, 30.0, seed)
    params[:, objective.model.slot("nome")] = generator.uniform(0.05, 0.97, len(params))
    starts = objective._starts(params)
    simulator = Simulator(objective.model, objective.simulator.inputs, 2, jobs)
    chosen = generator.permutation(objective.segments.count.size)[:company]
    part = Segments(*(column[chosen] for column in objective.segments))
    together = simulator.run(params, part, starts[:, chosen], guided=guided)[0]
    c, s = int(generator.integers(3)), int(generator.integers(company))
    one = Segments(*(column[s : s + 1] for column in part))
    alone = objective.simulator.run(params[c : c + 1], one, starts[c : c + 1, chosen[s : s + 1]], guided=guided)[0]
    a, b = part.out_offsets[s : s + 2]
    assert np.array_equal(together[c, a:b], alone[0], equal_nan=True)


def test_a_simulation_that_runs_away_stays_by_itself() -> None:
    objective, vector = ahead("sine")
    params = np.repeat(vector, 3, axis=0)
    starts = objective._starts(params)
    expected = objective.simulator.run(params, objective.segments, starts, guided=True)[0]
    starts[1, 5, 1], starts[1, 9, 1], starts[2, 7, 2] = math.nan, 1e9, 1e9
    found, speeds, _ = objective.simulator.run(params, objective.segments, starts, velocity=True, guided=True)
    edges = objective.segments.out_offsets
    for c, s in ((1, 5), (1, 9), (2, 7)):
        rows = slice(edges[s] + 1, edges[s + 1])
        assert np.all(np.isnan(found[c, rows])) and np.all(np.isnan(speeds[c, rows]))
        found[c, edges[s] : edges[s + 1]] = expected[c, edges[s] : edges[s + 1]]
    assert np.array_equal(found, expected)


def test_windows_of_one_sample_and_axes_at_rest() -> None:
    t = np.arange(0.0, 0.05, 1e-3)
    simulator = Simulator(Model("friction"), pack_inputs([Recording("r", t, 0.0 * t, kind="free_wheel")]), 2)
    segments = Segments(np.zeros(3, dtype=np.int64), np.array([0, 3, 5]), np.array([1, 10, 20]))
    starts = np.array([[[0.3, 1.0, 0.0], [0.2, 0.0, 0.0], [0.1, 0.0, 0.0]]])
    y, v, steps = simulator.run(Model("friction").vector({})[None], segments, starts, velocity=True)
    assert np.array_equal(y[0], np.repeat([0.3, 0.2, 0.1], segments.count))
    assert v[0, 0] == 1.0 and np.all(v[0, 1:] == 0.0) and steps == 0


# Positions and slopes of windows of the stand under scattered candidates, and what these say along its motion, as bits.
RUN = """
import hashlib, numpy
from tests.simulation.test_lockstep import ahead, scattered
objective, vector = ahead("theta")
params = scattered(objective.model, vector, 3, 10.0, 8)
starts = numpy.zeros((3, objective.segments.count.size, 3))
starts[:, :, 0], starts[:, :, 1] = objective.motion.y[objective.flat_first], objective.motion.v[objective.flat_first]
y = [objective.simulator.run(params, objective.segments, starts, guided=guided)[0] for guided in (True, False)]
moved = numpy.ones((*starts.shape[1:], 2))
tangents = numpy.vstack([params[1], params[2]])
slopes = objective.simulator.slopes(params[0], tangents, objective.segments, starts[0], moved)[1]
motion, none = objective.motion, numpy.full((3, len(objective.recordings)), numpy.nan)
along = objective.simulator.along(params, motion.y, motion.v, motion.standstill, none).acceleration
all_four = [hashlib.sha256(numbers.tobytes()).hexdigest() for numbers in (*y, slopes, along)]
print(numpy.isfinite(y).mean(), numpy.isfinite(slopes).mean(), *all_four)
"""


def test_bits_do_not_hang_on_the_processors_registers(tmp_path: Path) -> None:
    """Code for registers of two doubles and no fused instructions, against that for this machine."""
    plain = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "LINID_CACHE_DIR": str(tmp_path / "cache")}
    said = []
    for more in ({}, plain):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **more}
        done = subprocess.run([sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, check=True)
        said.append(done.stdout.split())
    assert said[0] == said[1] and float(said[0][0]) > 0.9 and float(said[0][1]) > 0.9
