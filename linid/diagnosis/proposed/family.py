"""Families of terms: smooth functions of one or two arguments, alone or times direction, motor force or velocity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array, Integers
from linid.diagnosis.proposed.arguments import PASSING, Argument
from linid.diagnosis.proposed.basis import Basis, Side, constant, curve, product, waves
from linid.diagnosis.proposed.problem import Problem

ONE_WAY = ("max(0, tanh(v/0.001))", "max(0, tanh(-v/0.001))")  # factors that are 1 in one direction, 0 in the other
SCALED = "*stribeck"  # factor of levels of friction that scale the Stribeck curve
HARMONICS = 3  # of the pole pitch, where each may depend on something else too
ONE, TWO, ROUND = 20, 7, 12  # functions of one argument, of each of two, and around a period
_FINELY = ("position", "campaign_time")
FINE = 40  # of position and of the running time: what sits at one place may be narrow
# Functions of two arguments that mechanics knows; all pairs would be too many to be tested against each other.
_PAIRS = (
    ("position", "velocity"),
    ("position", "motor_force"),
    ("velocity", "motor_force"),
    ("pole_phase", "motor_force"),
    ("pole_phase", "velocity"),
    ("travel", "position"),
)
_FRICTION_PAIRS = (("position", "speed"), ("position", "force_size"), ("campaign_time", "speed"), ("rest_time", "slid"))
_THRUST_PAIRS = (("position", "speed"),)  # times the motor's force


@dataclass(frozen=True)
class Family:
    """A smooth function of some arguments.

    arguments: names of all it depends on, each once; form: what makes it, for messages; columns: (n, k) acceleration
    in m/s^2 per newton; roughness: (k, k); local: the length in s of the pieces that are left out in turn where each
    recording has coefficients of its own, 0 where all share them; formula: of an own term, its coefficients to follow,
    empty where none can be written; wanders: each moment is told by those beside it, and by nothing else; sides,
    factor: how it is drawn (factor: "", direction, motor_force or velocity); call: the function beside a factor as a
    formula, empty where it has none; bends: numbers of a factor that bends; scaled: whether a level of friction scales
    the whole Stribeck curve, as what presses harder does, and is not added to it.
    """

    arguments: tuple[str, ...]
    form: str
    columns: Array
    roughness: Array
    local: float = 0.0
    formula: str = ""
    wanders: bool = False
    sides: tuple[Side, ...] = ()
    factor: str = ""
    call: str = ""
    bends: int = 0
    scaled: bool = False

    @property
    def passing(self) -> int:
        """How many of its arguments only pass."""
        return sum(name in PASSING for name in self.arguments)


def families(problem: Problem, arguments: Mapping[str, Argument]) -> Iterator[Family]:
    """All families with given shapes, those of fewer arguments first."""
    rows = problem.rows.t.size
    yield force(problem, (), "constant", constant(rows))
    yield _one_way(problem)
    for key, argument in arguments.items():
        if key == "slid":
            continue
        if key == "force_rate":  # what acts late, or through a filter
            yield force(problem, (argument.name,), key, curve(argument, ONE))
            continue
        basis = curve(argument, ROUND if argument.period else FINE if key in _FINELY else ONE)
        if key not in ("speed", "force_size"):
            yield force(problem, (argument.name,), key, basis)
        if key == "speed":  # an odd function of the velocity, with its presliding
            yield friction(problem, ("velocity",), key, basis, scaled=False)
        elif key not in ("velocity", "motor_force"):
            yield friction(problem, (argument.name, "direction"), key, basis)
        yield from _times(problem, arguments, key, argument, basis)
    yield from _of_two(problem, arguments)


def force(problem: Problem, names: tuple[str, ...], form: str, basis: Basis, factor: Array | None = None) -> Family:
    """A family of forces on the mass, times a factor (n,) in N."""
    columns = basis.columns if factor is None else basis.columns * factor[:, None]
    formula = basis.call if factor is None or not basis.call else f"F*({basis.call})"
    return Family(
        tuple(dict.fromkeys(names)),
        form,
        problem.pushed(columns),
        basis.roughness,
        formula=formula,
        sides=basis.sides,
        factor="" if factor is None else names[-1],
        call="" if factor is None else basis.call,
    )


def friction(problem: Problem, names: tuple[str, ...], form: str, basis: Basis, scaled: bool = True) -> Family:
    """A family of levels of friction. scaled: as of `Family`."""
    formula = f"-({basis.call}){SCALED if scaled else ''}*sign(v)" if basis.call else ""
    columns = problem.resisted(basis.columns * problem.stribeck[:, None] if scaled else basis.columns)
    return Family(
        tuple(dict.fromkeys(names)),
        f"{form} x direction",
        columns,
        basis.roughness,
        formula=formula,
        sides=basis.sides,
        factor="direction",
        scaled=scaled,
    )


def added_level(problem: Problem, family: Family) -> Family | None:
    """A family whose levels scale the Stribeck curve, with levels that are added to it; None where it has no such."""
    if not family.scaled or family.local or not family.formula or any(side.size == 1 for side in family.sides):
        return None
    levels = np.ones((problem.rows.t.size, 1))
    for side in family.sides:
        functions = side.at(side.argument.values, side.argument.spread)
        levels = np.einsum("ni,nj->nij", levels, functions).reshape(levels.shape[0], -1)
    formula = family.formula.replace(SCALED, "")
    return replace(family, columns=problem.resisted(levels), formula=formula, scaled=False)


def _one_way(problem: Problem) -> Family:
    """Friction that differs with the direction by a constant."""
    forward = (problem.friction < 0.0).astype(np.float64)[:, None]
    formula = f"-c_1*{ONE_WAY[0]}{SCALED}*sign(v)"
    way = Argument("direction", "sign(v)", "", np.sign(problem.rows.v))
    return Family(
        ("direction",),
        "one direction",
        problem.resisted(forward * problem.stribeck[:, None]),
        1e-6 * np.eye(1),
        formula=formula,
        sides=(Side(way, -1.0, 1.0, 1),),
        factor="direction",
        scaled=True,
    )


def _times(
    problem: Problem, arguments: Mapping[str, Argument], key: str, argument: Argument, basis: Basis
) -> Iterator[Family]:
    """Products of a curve with motor force and with velocity."""
    pushing = "motor_force" in arguments
    if pushing and key not in ("motor_force", "velocity", "force_size"):
        yield force(problem, (argument.name, "motor_force"), f"{key} x motor force", basis, problem.push)
    if key not in ("velocity", "speed"):
        family = force(problem, (argument.name, "velocity"), f"{key} x velocity", basis, problem.rows.v)
        formula = f"v*({basis.call})" if basis.call else ""
        yield replace(family, formula=formula)


def _of_two(problem: Problem, arguments: Mapping[str, Argument]) -> Iterator[Family]:
    """Functions of two arguments that are no products."""
    for pairs, make in ((_PAIRS, force), (_FRICTION_PAIRS, friction)):
        for keys in pairs:
            if all(key in arguments for key in keys):
                pair = [arguments[key] for key in keys]
                one, other = (_round(a) if a.period else curve(a, TWO) for a in pair)
                names = tuple(a.name for a in pair) + (("direction",) if make is friction else ())
                yield make(problem, names, " and ".join(keys), product(one, other))
    for keys in _THRUST_PAIRS:
        if all(key in arguments for key in (*keys, "motor_force")):
            one, other = (curve(arguments[key], TWO) for key in keys)
            names = (*(arguments[key].name for key in keys), "motor_force")
            form = f"{' and '.join(keys)} x motor force"
            yield force(problem, names, form, product(one, other), problem.push)


def _round(argument: Argument) -> Basis:
    """The mean and the first waves of a periodic argument."""
    wavenumbers = [2.0 * math.pi * k / argument.period for k in range(1, HARMONICS + 1)]
    return waves(argument, wavenumbers, mean=True)


def per_recording(problem: Problem, piece: float) -> Iterator[Family]:
    """Families with coefficients of their own in each recording: what acts there cannot be told from elsewhere.

    piece: s that are left out in turn.
    """
    rows = problem.rows
    owner, level = _indicators(rows.recording), problem.stribeck[:, None]
    modelled = (rows.a - problem.residual)[:, None]
    every: tuple[tuple[str, tuple[str, ...], Callable[[], Array]], ...] = (
        ("inertia per recording", ("acceleration", "recording"), lambda: owner * modelled),
        ("friction per recording", ("direction", "recording"), lambda: problem.resisted(owner * level)),
        ("force per recording", ("recording",), lambda: problem.pushed(owner)),
        ("damping per recording", ("velocity", "recording"), lambda: problem.pushed(owner * rows.v[:, None])),
        ("thrust per recording", ("motor_force", "recording"), lambda: problem.pushed(owner * problem.push[:, None])),
    )
    for form, names, make in every:
        columns = make()
        if np.any(columns):
            yield Family(names, form, columns, 1e-6 * np.eye(columns.shape[1]), local=piece)


def of_running_time(problem: Problem, arguments: Mapping[str, Argument], piece: float) -> Iterator[Family]:
    """Families of the campaign's running time, which no other recording repeats. piece: s that are left out in turn."""
    if "campaign_time" in arguments:
        basis = curve(arguments["campaign_time"], FINE)
        for family in (
            force(problem, ("campaign_time",), "campaign_time", basis),
            friction(problem, ("campaign_time", "direction"), "campaign_time", basis),
            force(problem, ("campaign_time", "motor_force"), "campaign_time x motor force", basis, problem.push),
        ):
            if np.any(family.columns):
                yield replace(family, form=f"{family.form}, piece by piece", local=piece)


def _indicators(owner: Integers) -> Array:
    return np.asarray(owner[:, None] == np.arange(int(owner.max()) + 1), dtype=np.float64)
