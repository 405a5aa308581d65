"""Tables: forces and factors over position, and friction over speed with few entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linid.export.over_place import term_over
from linid.export.simpler import (
    held_values,
    own_force,
    own_over_position,
    smooth_drag,
    speeds_of,
    stribeck_curve,
    stroke_or_usual,
)
from linid.export.targets.twincat.form import FACTORS_OF_THRUST, OVER_POSITION, kept, needs_place

if TYPE_CHECKING:
    from linid.arrays import Array
    from linid.export.target import Exported

# Straight lines between the nodes may miss this share of a table's largest change; more nodes than that none has.
_MISSED, _FIRST, _MOST = 5e-3, 33, 4097
_BETWEEN = 8  # places between two nodes, where the misses are looked for
FRICTION_ENTRIES = 20  # of TF5200 (P-COMP-00042)
_SPEEDS = 2000


@dataclass(frozen=True)
class PlaceTables:
    """Tables over evenly spaced positions. low, step: m; force: N added to what the motor must give, nodes' values of
    (n,), as thrust and friction: factors on the thrust and on friction; () where the model has none.
    """

    low: float
    step: float
    force: tuple[float, ...] = ()
    thrust: tuple[float, ...] = ()
    friction: tuple[float, ...] = ()

    @property
    def nodes(self) -> int:
        """How many nodes each table has; 0 without tables."""
        return max(len(self.force), len(self.thrust), len(self.friction))


def _force_over(exported: Exported, values: dict[str, float], y: Array) -> Array:
    total = own_force(exported, y)
    for name in kept(exported):
        if name in OVER_POSITION:
            total += term_over(name, "force", values, y)
    return total


def _factor_over(exported: Exported, names: tuple[str, ...], term: str, values: dict[str, float], y: Array) -> Array:
    total = np.ones_like(y)
    for name in kept(exported):
        if name in names:
            total *= term_over(name, term, values, y)
    return total


def place_tables(exported: Exported) -> PlaceTables:
    """Force, factor on thrust and factor on friction over the stroke, with as many nodes as straight lines need."""
    held = kept(exported)
    if not any(map(needs_place, held)):
        return PlaceTables(0.0, 1.0)
    low, high = stroke_or_usual(exported)
    values = held_values(exported)
    courses: dict[str, Callable[[Array], Array]] = {}
    if any(name in OVER_POSITION or own_over_position(name) for name in held):
        courses["force"] = lambda y: _force_over(exported, values, y)
    if set(held) & set(FACTORS_OF_THRUST):
        courses["thrust"] = lambda y: _factor_over(exported, FACTORS_OF_THRUST, "thrust", values, y)
    if "position_dependent_friction" in held:
        names = ("position_dependent_friction",)
        courses["friction"] = lambda y: _factor_over(exported, names, "friction", values, y)
    nodes = _FIRST
    while True:
        y = np.linspace(low, high, (nodes - 1) * _BETWEEN + 1)
        fine = {name: course(y) for name, course in courses.items()}
        missed = max(_missed(y, row) for row in fine.values())
        if missed <= _MISSED or nodes >= _MOST:
            break
        nodes = 2 * nodes - 1
    tables = {name: tuple(map(float, row[::_BETWEEN])) for name, row in fine.items()}
    return PlaceTables(low, (high - low) / (nodes - 1), **tables)


def _missed(y: Array, row: Array) -> float:
    """The largest miss of straight lines between every `_BETWEEN`-th value, as a share of the row's range."""
    lines = np.interp(y, y[::_BETWEEN], row[::_BETWEEN])
    return float(np.max(np.abs(lines - row))) / max(float(np.ptp(row)), 1e-300)


@dataclass(frozen=True)
class FrictionTable:
    """Friction over speed by few entries. v: (n,) m/s, rising; force: (n,) N; speeds, curve: (m,) m/s and N, what the
    entries stand for.
    """

    v: Array
    force: Array
    speeds: Array
    curve: Array

    @property
    def error(self) -> float:
        """The largest miss of straight lines between the entries over all speeds, N."""
        return float(np.max(np.abs(np.interp(self.speeds, self.v, self.force) - self.curve)))


def friction_table(exported: Exported, entries: int = FRICTION_ENTRIES) -> FrictionTable:
    """Steady friction over the speeds that occur, with nodes whose largest error is the least: as few straight pieces
    as a tolerance allows, the least tolerance that the entries allow, and then the best values at these nodes.
    """
    values, effects = held_values(exported), exported.model.effects
    top = float(np.max(speeds_of(exported)))
    first = min(1e-2 * values["stribeck_velocity"], 1e-3 * top)
    v = np.unique(np.concatenate([np.geomspace(first, top, _SPEEDS), np.linspace(first, top, _SPEEDS)]))
    curve = stribeck_curve(values, v) + values["viscous_friction"] * v + smooth_drag(values, effects, v)
    low, high = 0.0, float(np.ptp(curve)) + 1e-12
    nodes = _pieces(v, curve, high)
    for _ in range(50):
        middle = 0.5 * (low + high)
        found = _pieces(v, curve, middle)
        if len(found) <= entries:
            high, nodes = middle, found
        else:
            low = middle
    return _best_values(v, curve, nodes)


def _pieces(v: Array, curve: Array, tolerance: float) -> list[int]:
    """Places of nodes on the curve between which straight lines miss it by at most a tolerance, the longest pieces
    first.
    """
    nodes = [0]
    while nodes[-1] < v.size - 1:
        start = nodes[-1]
        short, long = start + 1, v.size - 1
        if not _near(v, curve, start, long, tolerance):
            while long - short > 1:
                middle = (short + long) // 2
                short, long = (middle, long) if _near(v, curve, start, middle, tolerance) else (short, middle)
            long = short
        nodes.append(long)
    return nodes


def _near(v: Array, curve: Array, start: int, end: int, tolerance: float) -> bool:
    part = slice(start, end + 1)
    line = np.interp(v[part], v[[start, end]], curve[[start, end]])
    return bool(np.max(np.abs(line - curve[part])) <= tolerance)


def _best_values(v: Array, curve: Array, nodes: list[int]) -> FrictionTable:
    """The values at the nodes with the least largest error, a linear programme."""
    from scipy.optimize import linprog

    places = v[nodes]
    hats = np.array([np.interp(v, places, unit) for unit in np.eye(len(nodes))]).T
    ones = np.ones((v.size, 1))
    limits = np.vstack([np.hstack([hats, -ones]), np.hstack([-hats, -ones])])
    found = linprog(
        [*np.zeros(len(nodes)), 1.0],
        A_ub=limits,
        b_ub=np.concatenate([curve, -curve]),
        bounds=[(None, None)] * len(nodes) + [(0.0, None)],
    )
    force = found.x[:-1] if found.success else curve[nodes]
    return FrictionTable(places, force, v, curve)
