"""A proposed term as a curve or a surface with its band, where there are data."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.diagnosis.proposed.basis import Side
from linid.diagnosis.proposed.estimate import estimated
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.report_data import TermAxis, TermCurve
from linid.statistics import NORMAL_97_5

_POINTS, _AROUND, _SURFACE = 97, 65, 29  # places of a curve, around a period, along each side of a surface
_PER_WAVE, _MOST_POINTS = 12, 1201  # of the shortest wave
_LEAST_ROWS = 4  # about a place, else nothing is known there
_HARMONIC = 0.02  # of the longest wave's number: others this near to its multiples repeat with it


def term_curve(problem: Problem, proposal: Proposal) -> TermCurve | None:
    """The estimated term over the data's support with a 95 % band; None where it cannot be drawn (coefficients of each
    recording's own, more than two arguments)."""
    family = proposal.family
    if len(family.sides) not in (1, 2):
        return None
    known = estimated(problem, proposal.regression)
    places = [_places(side, len(family.sides)) for side in family.sides]
    functions = family.sides[0].at(places[0])
    if len(places) == 2:
        other = family.sides[1].at(places[1])
        functions = np.einsum("ai,bj->baij", functions, other).reshape(-1, functions.shape[1] * other.shape[1])
    shape = tuple(x.size for x in reversed(places))
    value = functions @ known.coefficients
    spread = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", functions, known.covariance, functions), 0.0))
    seen = _seen(problem, family.sides, places).reshape(-1)
    shown = [
        np.where(seen, out, np.nan).reshape(shape)
        for out in (value, value - NORMAL_97_5 * spread, value + NORMAL_97_5 * spread)
    ]
    axes = tuple(_axis(side, x) for side, x in zip(family.sides, places, strict=True))
    return TermCurve(axes, family.factor, unit_of(problem, family.factor), *shown)


def unit_of(problem: Problem, factor: str) -> str:
    """SI unit of what is multiplied by a factor to give a force."""
    if factor == "motor_force":
        return "1"
    if factor == "velocity":
        return "N m s/rad" if problem.rotary else "N s/m"
    return "N m" if problem.rotary else "N"


def period_of(side: Side) -> float:
    """With what a side's functions repeat, in its argument's unit; 0 where they do not."""
    if side.argument.period:
        return side.argument.period
    if side.wavenumbers:
        longest = min(side.wavenumbers)
        orders = np.array(side.wavenumbers) / longest
        if np.all(np.abs(orders - np.round(orders)) < _HARMONIC):
            return 2.0 * math.pi / longest
    return 0.0


def _places(side: Side, sides: int) -> Array:
    """Where (m,) a side is drawn, in its argument's unit."""
    if side.size == 1:
        return np.array([-1.0, 1.0])
    period = period_of(side)
    if period:
        return np.linspace(0.0, period, _AROUND if sides == 1 else _SURFACE)
    points = _POINTS if sides == 1 else _SURFACE
    if side.wavenumbers and sides == 1:
        waves = (side.high - side.low) * max(side.wavenumbers) / (2.0 * math.pi)
        points = min(max(points, math.ceil(_PER_WAVE * waves) + 1), _MOST_POINTS)
    return np.linspace(side.low, side.high, points)


def _axis(side: Side, x: Array) -> TermAxis:
    """One side as it is drawn."""
    argument = side.argument
    label = "speed" if argument.symbol == "abs(v)" else argument.label
    if argument.symbol == "abs(F)":
        label = f"size of the {label}"
    return TermAxis(
        argument.name, f"{label} within a period" if period_of(side) else label, argument.unit, argument.shown(x)
    )


def _seen(problem: Problem, sides: tuple[Side, ...], places: list[Array]) -> Flags:
    """Whether (n,) or (n_2, n_1) fitted rows lie about each place, or in the next cell."""
    shape = tuple(x.size for x in reversed(places))
    cells = [_cell(side, x) for side, x in zip(sides, places, strict=True)]
    inside = ~problem.held & np.all([cell >= 0 for cell in cells], axis=0)
    spots = np.ravel_multi_index(tuple(cell[inside] for cell in reversed(cells)), shape)
    counts = np.bincount(spots, minlength=math.prod(shape)).reshape(shape)
    around = np.pad(counts, 1)
    for axis, side in enumerate(reversed(sides)):
        first, last = np.take(around, [1], axis), np.take(around, [-2], axis)
        edges = (last, first) if period_of(side) else (np.zeros_like(first), np.zeros_like(last))
        middle = np.take(around, np.arange(1, around.shape[axis] - 1), axis)
        around = np.concatenate([edges[0], middle, edges[1]], axis)
    total = np.zeros(shape, dtype=np.int64)
    for shift in np.ndindex(*(3,) * len(shape)):
        window = tuple(slice(s, s + size) for s, size in zip(shift, shape, strict=True))
        total += around[window]
    return np.asarray(total >= _LEAST_ROWS)


def _cell(side: Side, x: Array) -> Integers:
    """The nearest of the places x (m,) of each row (n,), -1 beyond them."""
    values = side.argument.values
    known = np.isfinite(values)
    period = period_of(side)
    values = np.where(known, values, 0.0)
    if period:
        values = np.mod(values, period)
    step = x[1] - x[0]
    cell = np.round((values - x[0]) / step).astype(np.int64)
    return np.where(known & (cell >= 0) & (cell < x.size), cell, -1)
