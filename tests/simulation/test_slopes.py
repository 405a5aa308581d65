"""Derivatives that the simulation carries along: against mpmath, and the kernel's source run with dual numbers."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from linid.physics.model import MOTOR_START, Model
from linid.recording.recording import Recording
from linid.simulation.course import Candidates, Scheme, Stretch
from linid.simulation.friction_slopes import phi_slopes
from linid.simulation.inputs import pack_inputs
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.run import REVERSAL_TOLERANCE, Simulator, whole_recordings
from linid.simulation.steering import UNSTEERED
from tests.benchmarks.operations import plain_kernel
from tests.dual import DUAL_ARRAYS, DUAL_MATH, duals

T = np.arange(0.0, 0.06, 1e-3)
SUBSTEPS = 2
# Half trace and square: matrices small and large, with eigenvalues apart, together and complex.
CASES = [(-0.1, 0.01), (-0.6, 0.04), (-0.6, 1e-9), (-3.0, -0.01), (-3.0, 8.9), (-20.0, 390.0), (-5.0, -3.0)]
CASES += [(-0.2, 0.3), (0.1, -0.06), (-1e-3, 1e-7), (-0.45, -0.05), (-30.0, 0.06), (-0.01, -0.07), (-0.4, 0.0)]


@njit
def slopes_of_phi(half_trace: float, square: float) -> Any:
    return phi_slopes(half_trace, square)


def phi(k: int, matrix: Any) -> Any:
    """phi_k of a matrix by its series, in as many digits as mpmath works with."""
    total, term = mpmath.zeros(2), mpmath.eye(2) / mpmath.factorial(k)
    for j in range(400):
        total += term
        term = term * matrix / (k + j + 1)
    return total


@pytest.mark.parametrize(("half_trace", "square"), CASES)
def test_phi_functions_of_a_matrix_and_their_slopes(half_trace: float, square: float) -> None:
    """All six kinds of values against the series in 60 digits, differentiated there."""
    found = slopes_of_phi(half_trace, square)
    with mpmath.workdps(60):

        def parts(k: int, trace: Any, bend: Any) -> tuple[Any, Any]:
            value = phi(k, mpmath.matrix([[trace, bend], [1, trace]]))  # [[0, s], [1, 0]] has the square s I
            return value[0, 0], value[1, 0]

        step, trace, bend = mpmath.mpf(10) ** -15, mpmath.mpf(half_trace), mpmath.mpf(square)
        for k in (1, 2, 3):
            expected = list(parts(k, trace, bend))
            for more, less in (((step, 0), (-step, 0)), ((0, step), (0, -step))):
                ends = [parts(k, trace + d, bend + e) for d, e in (more, less)]
                expected += [(a - b) / (2 * step) for a, b in zip(*ends, strict=True)]
            values = [of[k - 1] for of in found]
            assert values == pytest.approx([float(x) for x in expected], rel=1e-8, abs=1e-12)


def recording(powered: bool) -> Recording:
    """A motion that turns twice, with smooth currents if powered."""
    currents = 0.5 * np.sin(80.0 * T + np.array([[0.0], [2.0], [4.0]])) if powered else None
    y = 0.01 * np.sin(80.0 * T)
    return Recording("r", T, y, phase_currents=currents) if powered else Recording("r", T, y, kind="free_wheel")


def axis(kind: str, exponent: float) -> tuple[Model, Any]:
    model = Model(kind)
    values = {parameter.name: parameter.default for parameter in model.parameters}
    values |= {"coulomb_force": 1.3, "static_force": 2.0, "stribeck_velocity": 8e-3, "stribeck_exponent": exponent}
    values |= {"bristle_stiffness": 2e4, "bristle_damping": 90.0, "viscous_friction": 3.0, "mass": 0.7}
    return model, model.vector(values)


def with_duals(simulator: Simulator, params: Any, tangents: Any, start: Any, moved: Any, forces: Any) -> Any:
    """Positions with derivatives (samples,) by the kernel's own source, run in plain Python with dual numbers."""
    kernel, inputs = plain_kernel({"math": DUAL_MATH, "np": DUAL_ARRAYS})[0], simulator.inputs
    candidates = Candidates(duals(params, tangents.T)[None], simulator.model.motor, 0, 0)
    clock = False, float(inputs.t_starts[0]), float(inputs.dts[0])
    stretch = Stretch(candidates.params[0], bool(inputs.powered[0]), inputs.coefficients, *clock, 0, T.size, 0.0, 0, 0)
    scheme = Scheme(True, np.empty((4, 0)), np.empty(0), SUBSTEPS, REVERSAL_TOLERANCE / SUBSTEPS**2, UNSTEERED)
    y = np.empty(T.size, dtype=object)
    kernel(candidates, stretch, duals(start, moved), np.empty(0, dtype=np.int64), scheme, forces, (y, np.empty(0)))
    return y


def worst(found: Any, expected: Any) -> Any:
    """Largest deviation of each column (K,), in parts of its largest value, 1 um at least."""
    return np.abs(found - expected).max(axis=0) / np.maximum(np.abs(expected).max(axis=0), 1e-6)


@pytest.mark.parametrize("exponent", [2.0, 1.2])
@pytest.mark.parametrize(
    ("speed", "bristle"),
    [(0.3, 1e-5), (0.02, 1e-5), (-0.004, 1e-5), (0.3, math.nan), (-0.03, math.nan), (1e-3, math.nan)],
)
def test_slopes_of_a_coast_down_are_the_sources_own(speed: float, bristle: float, exponent: float) -> None:
    """By every parameter of friction and mass, and by start speed and bristle: from fast sliding to rest; with a given
    bristle, and one that follows from the model."""
    model, params = axis("friction", exponent)
    simulator = Simulator(model, pack_inputs([recording(False)]), SUBSTEPS)
    tangents, moved = np.zeros((10, params.size)), np.zeros((3, 10))
    tangents[np.arange(MOTOR_START), np.arange(MOTOR_START)] = params[:MOTOR_START]
    moved[1, 8], moved[2, 9] = 1.0, 1e-4
    start = np.array([0.0, speed, bristle])
    y, slopes = simulator.slopes(params, tangents, whole_recordings(simulator.inputs), start[None], moved[None])
    expected = with_duals(simulator, params, tangents, start, moved, np.empty(0))
    assert y == pytest.approx([one.value for one in expected], rel=1e-12, abs=1e-15)
    by = np.array([one.by for one in expected])
    told = worst(slopes, by)
    told[3] *= exponent != 2.0  # which the source squares without asking for its derivative
    assert np.all(told < 1e-12)


@pytest.mark.parametrize("speed", [0.4, -0.03])
def test_slopes_under_a_motors_force(speed: float) -> None:
    """The motor's force known beforehand, as duals too; within halved steps it is interpolated."""
    model, params = axis("sine", 1.5)
    simulator = Simulator(model, pack_inputs([recording(True)]), SUBSTEPS)
    width = len(model.parameters)
    tangents = np.zeros((width, params.size))
    for row, parameter in enumerate(model.parameters):
        place = model.slot(parameter.name)
        tangents[row, place] = params[place] if parameter.log else 1.0
    start, moved = np.array([0.0, speed, 1e-5]), np.zeros((3, width))
    y, slopes = simulator.slopes(params, tangents, whole_recordings(simulator.inputs), start[None], moved[None])
    plain = with_duals(simulator, params, tangents, start, moved, np.empty(0))  # forces at every step of its own
    assert y == pytest.approx([one.value for one in plain], rel=1e-6, abs=1e-9)
    assert np.all(worst(slopes, np.array([one.by for one in plain])) < 1e-6)


def test_positions_are_those_of_the_simulation_to_the_bit() -> None:
    model, params = axis("theta", 2.0)
    simulator = Simulator(model, pack_inputs([recording(True)]), SUBSTEPS)
    whole, start = whole_recordings(simulator.inputs), np.array([[0.0, 0.1, 0.0]])
    y = simulator.slopes(params, np.ones((3, params.size)), whole, start, np.zeros((1, 3, 3)))[0]
    assert np.array_equal(y, simulator.run(params[None], whole, start[None], guided=True)[0][0])


@given(st.integers(0, 2**32 - 1), st.integers(1, 2 * LANES + 3))
@settings(max_examples=25, deadline=None)
def test_a_column_has_the_same_bits_in_any_lane_and_any_company(seed: int, company: int) -> None:
    generator = np.random.default_rng(seed)
    model, params = axis("sine", 2.0)
    simulator = Simulator(model, pack_inputs([recording(True)]), SUBSTEPS, jobs=1)
    whole, start = whole_recordings(simulator.inputs), np.array([[0.0, 0.05, math.nan]])
    tangents = params * generator.standard_normal((company, params.size)) * 10.0 ** generator.uniform(-3, 3)
    moved = generator.standard_normal((1, 3, company))
    together = simulator.slopes(params, tangents, whole, start, moved)[1]
    lane = int(generator.integers(company))
    alone = simulator.slopes(params, tangents[lane : lane + 1], whole, start, moved[:, :, lane : lane + 1])[1]
    assert np.array_equal(together[:, lane], alone[:, 0])


def test_lanes_compute_what_doubles_do() -> None:
    @njit(error_model="numpy")
    def computed(a: Any, b: Any, out: Any) -> None:
        put_lanes(out, 0, lanes_at(a, 0) * lanes_at(b, 0) - 3.0 * lanes_at(a, 0) + lanes_at(b, 0) * 0.1)

    a, b = np.random.default_rng(3).standard_normal((2, LANES))
    out = np.empty(LANES)
    computed(a, b, out)
    assert np.array_equal(out, a * b - 3.0 * a + b * 0.1)
