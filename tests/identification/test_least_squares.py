"""The local least squares on problems whose minimum is known in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from linid.identification.objectives.objective import Directions
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import levenberg_marquardt
from linid.identification.settings import Ending
from linid.identification.signals.motion import Motion
from linid.identification.space.field_vector import field_vector
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]
SAMPLES = 400
FIELD = (
    SearchParameter("force_constant", 4.0, 256.0, True),
    SearchParameter("commutation_offset", -math.pi, math.pi, False),
)


_PITCH = SearchParameter("electrical_wavenumber", 195.0, 205.0, False)
SHAPE = {"sine": (_PITCH,), "theta": (_PITCH, SearchParameter("nome", 0.01, 0.3, True))}


def still(y: float) -> Motion:
    """An axis that rests at y in m."""
    at, zero = np.full(3, y), np.zeros(3)
    return Motion(at, at, zero, np.ones(3, dtype=np.bool_), np.ones(1), np.ones(1))


@dataclass
class Formula:
    """Residuals by a formula of the flat parameters, in place of a simulation."""

    model: Model
    formula: object
    name: str = "formula"
    recordings: tuple[Recording, ...] = ()
    nuisances: int = 0
    floor: float = 0.0
    robust: bool = False
    motion: Motion = field(default_factory=lambda: still(0.0))

    def __post_init__(self) -> None:
        self.classes = np.zeros(SAMPLES, dtype=np.int64)
        self.groups = np.arange(SAMPLES, dtype=np.int64)
        self.group_recording = np.zeros(SAMPLES, dtype=np.int64)
        self.signal = np.ones(SAMPLES)

    def residuals(self, params: Array, offsets: Array) -> Array:
        return np.array([self.formula(row) for row in params])  # type: ignore[operator]


def problem_of(kind: str, point: tuple[SearchParameter, ...], formula: object) -> Problem:
    model = Model(kind)
    fixed = {p.name: p.default for p in model.parameters if p.name not in {searched.name for searched in point}}
    return Problem(SearchSpace(model, point, fixed), (Formula(model, formula),))  # type: ignore[arg-type]


@pytest.mark.parametrize(("kind", "turns"), [("sine", 1.0), ("theta", 2.0)])
def test_the_fields_vector_moves_in_a_straight_line(kind: str, turns: float) -> None:
    """Moved by (dK, dphase), the vector K exp(i phase) changes by (dK + i K dphase) exp(i phase): no second order."""
    found = field_vector(SearchSpace(Model(kind), FIELD, {}), [still(0.0)])
    assert found is not None
    x, move = np.array([0.4, 0.5, 0.3]), np.array([0.11, -0.07, 0.2])
    moved = found.moved(x, move)

    def vector(point: Array) -> complex:
        return complex(FIELD[0].value(point[0]) * np.exp(1j * turns * FIELD[1].value(point[1])))

    size = float(FIELD[0].value(x[0]))
    along = size * math.log(64.0) * move[0] + 1j * size * turns * 2.0 * math.pi * move[1]
    expected = vector(x) + along * vector(x) / abs(vector(x))
    assert vector(moved) == pytest.approx(expected, rel=1e-12)
    assert moved[2] == x[2] + move[2]


@pytest.mark.parametrize("kind", ["sine", "theta"])
def test_all_that_turns_the_field_counts_in_the_middle_of_the_motion(kind: str) -> None:
    """The vector at y = 0.4 m, as pole pitch and shape of the field change too, has no second order: reference is its
    own slope."""
    space = problem_of(kind, (*FIELD, *SHAPE[kind]), lambda row: row[:1]).space
    found = field_vector(space, [still(0.3), still(0.5)])
    assert found is not None
    x = np.full(len(space.parameters), 0.45)
    move = np.array([0.05, -0.03, 0.06, 0.1])[: x.size]

    def vector(point: Array) -> complex:
        values, motor = space.values(point), space.model.driven_by
        length = motor.fundamental(values["force_constant"], values)
        z = values["electrical_wavenumber"] * 0.4 + values["commutation_offset"]
        return complex(length * np.exp(1j * motor.turns * z))

    slope = (vector(x + 1e-4 * move) - vector(x - 1e-4 * move)) / 2e-4
    assert abs(vector(x + move) - vector(x) - slope) > 0.1 * abs(slope)
    assert vector(found.moved(x, move)) == pytest.approx(vector(x) + slope, rel=1e-4)


def test_a_vector_that_would_turn_round_is_moved_as_it_is() -> None:
    found = field_vector(SearchSpace(Model("sine"), FIELD, {}), [still(0.0)])
    assert found is not None
    x, move = np.array([0.5, 0.5, 0.5]), np.array([-0.3, 0.1, 0.0])  # 1 + log(64) (-0.3) < 0
    np.testing.assert_array_equal(found.moved(x, move), x + move)


@pytest.mark.filterwarnings("error")
def test_what_goes_far_out_of_the_box_beside_it_leaves_the_vector_alone() -> None:
    """A bent step may lead a parameter that hardly matters anywhere; where it ends is clipped later."""
    space = SearchSpace(Model("sine"), (*FIELD, SearchParameter("viscous_friction", 1e-3, 1e3, True)), {})
    found = field_vector(space, [still(0.0)])
    assert found is not None
    near, far = (found.moved(np.array([0.4, 0.5, 0.3]), np.array([0.1, -0.05, move])) for move in (0.2, 1e4))
    np.testing.assert_array_equal(near[:2], far[:2])


def test_no_vector_without_both_genes() -> None:
    assert field_vector(SearchSpace(Model("sine"), FIELD[:1], {}), [still(0.0)]) is None
    assert field_vector(SearchSpace(Model("friction"), (), {}), [still(0.0)]) is None


def test_thrust_of_the_wrong_phase_is_found_in_two_steps() -> None:
    """Linear in the field's vector, so that one undamped Gauss-Newton step arrives from an error of 1.2 rad."""
    generator = np.random.default_rng(1)
    basis, noise = generator.normal(size=(2, SAMPLES)), 1e-3 * generator.normal(size=SAMPLES)
    slot = {name: Model("sine").slot(name) for name in ("force_constant", "commutation_offset")}

    def thrust(row: Array) -> Array:
        size, phase = row[slot["force_constant"]], row[slot["commutation_offset"]]
        return np.asarray(size * (math.cos(phase) * basis[0] + math.sin(phase) * basis[1]))

    problem = problem_of("sine", FIELD, lambda row: thrust(row) - truth - noise)
    at = problem.space.encode({"force_constant": 30.0, "commutation_offset": 0.4})
    truth = thrust(problem.space.vectors(at)[0])
    start = problem.space.encode({"force_constant": 80.0, "commutation_offset": 1.6})
    result = levenberg_marquardt(problem, Cost(problem), start, final=False)
    assert np.abs(result.point - at).max() < 1e-4
    assert len(result.history) <= 3


def test_a_bent_valley_is_followed_around_its_bend() -> None:
    """Rosenbrock's valley, 100 times as narrow as long: straight steps can only creep along it."""
    point = (SearchParameter("coulomb_force", 1.0, 4.0, False), SearchParameter("viscous_friction", 1.0, 16.0, False))
    slot = {name: Model("friction").slot(name) for name in ("coulomb_force", "viscous_friction")}
    pattern = np.random.default_rng(2).normal(size=(2, SAMPLES))

    def residual(row: Array) -> Array:
        x, y = row[slot["coulomb_force"]], row[slot["viscous_friction"]]
        return np.asarray((x - 3.2) * pattern[0] + 100.0 * (y - x**2) * pattern[1] + 0.01)

    problem = problem_of("friction", point, residual)
    start = problem.space.encode({"coulomb_force": 1.1, "viscous_friction": 1.21})
    result = levenberg_marquardt(problem, Cost(problem), start, final=False)
    found = problem.space.vectors(result.point)[0]
    assert found[slot["coulomb_force"]] == pytest.approx(3.2, abs=0.01)
    assert found[slot["viscous_friction"]] == pytest.approx(3.2**2, abs=0.06)
    assert len(result.history) < 20


def test_a_fit_that_goes_on_knows_how_little_it_need_be_damped() -> None:
    """Two parameters that hardly differ in what they do: damped as at first, a step goes a small part of the way."""
    point = (SearchParameter("coulomb_force", 1.0, 4.0, False), SearchParameter("viscous_friction", 1.0, 16.0, False))
    slots = [Model("friction").slot(name) for name in ("coulomb_force", "viscous_friction")]
    pattern = np.random.default_rng(4).normal(size=(SAMPLES, 2)) @ np.array([[1.0, 1.0], [0.0, 1e-3]])

    def problem(truth: list[float]) -> Problem:
        return problem_of("friction", point, lambda row: np.asarray(pattern @ (row[slots] - truth) + 1e-6))

    first, second = problem([2.2, 7.0]), problem([2.0, 7.2])  # apart along the valley alone
    start = first.space.encode({"coulomb_force": 2.8, "viscous_friction": 6.5})
    found = levenberg_marquardt(first, Cost(first), start, final=False)
    assert first.space.vectors(found.point)[0][slots] == pytest.approx([2.2, 7.0], abs=0.01)
    one = Ending(steps=1)
    onward, anew = (levenberg_marquardt(second, Cost(second), s, ending=one) for s in (found.start, found.point))
    away = [abs(second.space.vectors(fit.point)[0][slots[0]] - 2.0) for fit in (onward, anew)]
    assert away[0] < 0.01 and away[1] > 0.1


def test_slopes_beyond_all_measure_tell_nothing() -> None:
    """A free run that any change sends elsewhere has slopes that grow on and on; the rest still finds the minimum."""
    point = (SearchParameter("coulomb_force", 1.0, 4.0, False), SearchParameter("viscous_friction", 1.0, 16.0, False))
    slots = [Model("friction").slot(name) for name in ("coulomb_force", "viscous_friction")]
    pattern = np.random.default_rng(3).normal(size=(SAMPLES, 2))

    @dataclass
    class Carrying(Formula):
        carries_slopes: bool = True

        def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
            slopes = pattern @ directions.params[:, slots].T
            slopes[::7, 0], slopes[5], slopes[6] = 1e200, np.nan, np.inf
            return self.residuals(params[None], offsets[None])[0], slopes

    def residual(row: Array) -> Array:
        return np.asarray(pattern @ (row[slots] - [3.2, 7.0]) + 0.01)

    space = problem_of("friction", point, residual).space
    problem = Problem(space, (Carrying(Model("friction"), residual),))  # type: ignore[arg-type]
    start = space.encode({"coulomb_force": 1.1, "viscous_friction": 1.21})
    result = levenberg_marquardt(problem, Cost(problem), start, final=False)
    assert space.vectors(result.point)[0][slots] == pytest.approx([3.2, 7.0], abs=0.01)


def test_where_slopes_hold_nowhere_it_ends() -> None:
    """Residuals on a staircase, each tread of which falls the other way: what slopes promise, no step finds."""
    point = (SearchParameter("coulomb_force", 1.0, 4.0, False), SearchParameter("viscous_friction", 1.0, 16.0, False))
    slots = [Model("friction").slot(name) for name in ("coulomb_force", "viscous_friction")]
    pattern = np.random.default_rng(8).normal(size=(SAMPLES, 2))
    tread = 3e-3

    def residual(row: Array) -> Array:
        values = row[slots]
        return np.asarray(pattern @ (values - [5.0, 20.0] - 3.0 * (values - tread * np.round(values / tread))))

    @dataclass
    class Rugged(Formula):
        carries_slopes: bool = True

        def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
            along = -2.0 * pattern @ directions.params[:, slots].T
            return self.residuals(params[None], offsets[None])[0], along

    space = problem_of("friction", point, residual).space
    problem = Problem(space, (Rugged(Model("friction"), residual),))  # type: ignore[arg-type]
    start = space.encode({"coulomb_force": 2.0, "viscous_friction": 5.0})
    result = levenberg_marquardt(problem, Cost(problem), start, bend=False, final=False)
    assert len(result.history) < 10, result.reason
    assert "next to nothing" in result.reason and not result.converged
    assert result.ended  # no minimum, but more steps would find no better
    cut = levenberg_marquardt(problem, Cost(problem), start, ending=Ending(2), bend=False, final=False)
    assert not cut.ended and not cut.converged and len(cut.history) == 2
