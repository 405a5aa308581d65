"""Waves of any wavenumber in position and time: a scan by Fourier transforms, and families of the strongest."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Integers
from linid.diagnosis.proposed.arguments import Argument
from linid.diagnosis.proposed.basis import Basis, curve, product, waves
from linid.diagnosis.proposed.family import ONE_WAY, SCALED, Family, force
from linid.diagnosis.proposed.history import direction_of
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.wave_scan import normal_equations, waves_beside

MOST_WAVES = 5  # of one family
LEAST_PART = 0.01  # of what is left: a wave that takes less is none
SHORTEST, HIGHEST = 1.0 / 600.0, 60.0  # wave, as a share of the stroke; frequency in Hz
_OVERSAMPLED = 4  # cells per shortest wave's half
_LEAST_CYCLES = 2.0  # over the whole range; slower ones are curves
_HIGHEST_ORDER = 250  # waves per turn
_CLASSES, _GATES = 16, 16  # of velocity, in each of which a wave may have another phase; functions of it
_SLOW = 0.5  # Hz, up to which the running time of a campaign may sway something
_NYQUIST = 0.4  # of the rows' rate
_BESIDE = 4  # wavenumbers on either side that are tried at once
_RIDGE = 1e-9  # of all squares, so that a class without rows is no matter
WAVE_PIECE = 0.5  # s left out in turn where each recording has a phase of its own


@dataclass(frozen=True)
class _Sort:
    """One sort of wave. name: arguments beside the axis; factor: (n,) on the force; resists: a level of friction;
    classes: (n,) in each of which amplitude and phase are free, None: the same in all; formula: around the waves."""

    names: tuple[str, ...]
    form: str
    factor: Array
    resists: bool = False
    classes: Integers | None = None
    formula: str = ""


def wave_families(
    problem: Problem, arguments: Mapping[str, Argument], left: Callable[[Array], Array]
) -> Iterator[Family]:
    """Families of the strongest waves in position, in a recording's time and in each recording's time by itself.

    left(columns): what base and these columns (n, k) leave of the fitted rows, weighted, (n,).
    """
    rows = problem.rows
    stroke = float(np.ptp(rows.y))
    step = np.diff(rows.t)
    highest = 2.0 * math.pi * min(HIGHEST, _NYQUIST / float(np.median(step[step > 0.0])))
    axes = [(arguments["position"], 2.0 * math.pi / (SHORTEST * stroke)), (arguments["time"], highest)]
    if "campaign_time" in arguments:
        axes.append((arguments["campaign_time"], 2.0 * math.pi * _SLOW))
    if "turn" in arguments:
        axes.append((arguments["turn"], 2.0 * math.pi * _HIGHEST_ORDER / arguments["turn"].period))
    for argument, top in axes:
        for sort in _sorts(problem, argument):
            found = _strongest(problem, argument, sort, top, left)
            if found:
                yield _family(problem, arguments, argument, sort, found)


def _sorts(problem: Problem, argument: Argument) -> Iterator[_Sort]:
    rows = problem.rows
    one = np.ones(rows.t.size)
    yield _Sort((), "force", one, formula="{}")
    formula = f"-({{}}){SCALED}*sign(v)"
    yield _Sort(("direction",), "friction", problem.stribeck, resists=True, formula=formula)
    if np.any(problem.push):
        yield _Sort(("motor_force",), "motor force", problem.push, formula="F*({})")
    if argument.name == "campaign_time":
        return
    yield _Sort(("velocity",), "velocity", rows.v, formula="v*({})")
    if argument.name == "position":
        yield _Sort(("direction",), "phase by direction", one, classes=(direction_of(rows) > 0.0).astype(np.int64))
    fitted = rows.v[~problem.held]
    edges = np.quantile(fitted, np.linspace(0.0, 1.0, _CLASSES + 1)[1:-1])
    yield _Sort(("velocity",), "phase by velocity", one, classes=np.digitize(rows.v, edges))
    if argument.name == "time":
        yield _Sort((), "phase by recording", one, classes=rows.recording)


def _columns(problem: Problem, argument: Argument, sort: _Sort, wavenumber: float) -> Array:
    """Cosine and sine as acceleration (n, 2), or of each class (n, 2 classes)."""
    columns = argument.waves((wavenumber,)) * sort.factor[:, None]
    if sort.classes is not None:
        owner = (sort.classes[:, None] == np.unique(sort.classes)).astype(np.float64)
        columns = np.einsum("ni,nj->nij", columns, owner).reshape(problem.rows.t.size, -1)
    return problem.resisted(columns) if sort.resists else problem.pushed(columns)


def _strongest(
    problem: Problem, argument: Argument, sort: _Sort, top: float, left: Callable[[Array], Array]
) -> tuple[float, ...]:
    """Wavenumbers in rad per unit of an argument, one after the other by what they take of what is left; those of a
    periodic one are whole multiples of its own."""
    found: list[float] = []
    own = 2.0 * math.pi / argument.period if argument.period else 0.0
    x = argument.values % argument.period if own else argument.values
    columns = np.empty((x.size, 0))
    rest = left(columns)
    whole = float(np.sum(rest**2))
    most = MOST_WAVES if sort.classes is None or sort.form == "phase by direction" else 1
    while len(found) < most:
        grid, gain = spectrum(problem, x, sort, rest, top)
        best = int(np.argmax(gain))
        if gain[best] < LEAST_PART * whole:
            break
        if own:
            wavenumber = own * max(round(float(grid[best]) / own), 1)
            if wavenumber in found:
                break
        else:
            wavenumber = _refined(problem, argument, sort, rest, float(grid[best]), float(grid[1]))
        found.append(wavenumber)
        columns = np.hstack([columns, _columns(problem, argument, sort, wavenumber)])
        rest = left(columns)
    return tuple(found)


def spectrum(problem: Problem, x: Array, sort: _Sort, rest: Array, top: float) -> tuple[Array, Array]:
    """Wavenumbers (K,) and what a wave of each takes of the rest, about; gridded and transformed at once.

    x: (n,); rest: (n,) of what is left, weighted; top: largest wavenumber in rad per unit of x.
    """
    pull = rest * problem.weights / problem.mass
    if sort.resists:
        pull = pull * problem.friction
    power = np.where(problem.held, 0.0, (problem.weights * sort.factor / problem.mass) ** 2)
    low = float(x.min())
    cell = math.pi / top / _OVERSAMPLED
    size = 1 << math.ceil(math.log2(3.0 * (float(x.max()) - low) / cell + 4.0))
    place = (x - low) / cell
    left_cell = place.astype(np.int64)
    share = place - left_cell
    classes = np.zeros(x.size, dtype=np.int64) if sort.classes is None else sort.classes
    count = size // 2 + 1
    grid = np.arange(count) * (2.0 * math.pi / (size * cell))
    wanted = (grid <= top) & (grid >= 2.0 * math.pi * _LEAST_CYCLES / max(float(np.ptp(x)), 1e-12))
    gain = np.zeros(count)
    strength = pull * sort.factor
    for number in np.unique(classes):
        mine = classes == number
        sums = np.bincount(left_cell[mine], strength[mine] * (1.0 - share[mine]), size)
        sums += np.bincount(left_cell[mine] + 1, strength[mine] * share[mine], size)
        total = float(power[mine].sum())
        if total > 0.0:
            gain += 2.0 * np.abs(np.fft.rfft(sums)) ** 2 / total
    taken = np.where(wanted, gain / np.sinc(grid * cell / (2.0 * math.pi)) ** 4, 0.0)
    return np.asarray(grid), np.asarray(taken, dtype=np.float64)


def _refined(problem: Problem, argument: Argument, sort: _Sort, rest: Array, first: float, width: float) -> float:
    """The wavenumber near the first one that takes most, between the scan's cells."""
    best = first
    for step in (width / 2.0, width / 8.0):
        best += step * (int(np.argmax(_gains(problem, argument, sort, rest, best, step))) - _BESIDE)
    return best


def _gains(problem: Problem, argument: Argument, sort: _Sort, rest: Array, middle: float, step: float) -> Array:
    """What waves of wavenumbers in equal steps about the middle one take of the rest, (2 _BESIDE + 1,)."""
    values, spread = argument.values, np.ascontiguousarray(np.broadcast_to(argument.spread, argument.values.shape))
    classes = np.zeros(values.size, dtype=np.int64) if sort.classes is None else sort.classes
    scale = np.where(problem.held, 0.0, problem.weights)
    place, kept = problem.rests
    if sort.resists:
        kept = np.zeros(values.size)
    else:
        scale = scale / problem.mass
    systems = []
    for pair in waves_beside(values, spread, sort.factor, middle, step, _BESIDE):
        columns = problem.resisted(pair) if sort.resists else pair
        systems.append(normal_equations(columns, classes, int(classes.max()) + 1, place, kept, scale, rest))
    normals, moments = (np.array(parts) for parts in zip(*systems, strict=True))
    ridge = _RIDGE * np.trace(normals, axis1=1, axis2=2)[:, None, None] * np.eye(normals.shape[1])
    return np.asarray(np.sum(moments * np.linalg.solve(normals + ridge, moments[:, :, None])[:, :, 0], axis=1))


def _family(
    problem: Problem, arguments: Mapping[str, Argument], argument: Argument, sort: _Sort, found: tuple[float, ...]
) -> Family:
    """The family of some waves."""
    basis = waves(argument, found)
    per = 2.0 * math.pi
    words = ", ".join(f"{k / per:.4g}" for k in found)
    form = f"waves of {words} per {argument.unit}, {sort.form}"
    names = (argument.name, *sort.names)
    if sort.form == "phase by velocity":
        return force(problem, names, form, product(basis, curve(arguments["velocity"], _GATES)))
    if sort.form == "phase by recording":
        columns = _columns(problem, argument, sort, found[0])
        return Family(names, form, columns, 1e-6 * np.eye(columns.shape[1]), local=WAVE_PIECE)
    if sort.form == "phase by direction":
        forth = (direction_of(problem.rows) > 0.0)[:, None]
        columns = np.hstack([basis.columns * forth, basis.columns * ~forth])
        parts = (
            f"c_{k}*{way}*{factor}" for k, (way, factor) in enumerate(itertools.product(ONE_WAY, basis.factors), 1)
        )
        basis = Basis(columns, 1e-6 * np.eye(columns.shape[1]), " + ".join(parts))
        return force(problem, names, form, basis)
    columns = basis.columns * sort.factor[:, None]
    columns = problem.resisted(columns) if sort.resists else problem.pushed(columns)
    formula, factor = sort.formula.format(basis.call), sort.names[0] if sort.names else ""
    call = basis.call if factor else ""
    return Family(
        names,
        form,
        columns,
        basis.roughness,
        formula=formula,
        sides=basis.sides,
        factor=factor,
        call=call,
        scaled=sort.resists,
    )
