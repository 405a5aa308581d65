"""Rival minima of a motor's field: other shapes that push alike, compared on all data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Problem
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.space.search_space import SearchSpace
from linid.statistics import TINY

# Below the edge all shapes push alike under currents that sum to zero; wide and narrow magnets to begin with.
_EDGE, _WIDE, _NARROW = 0.8, 0.5, 0.89
_LAGS = 4  # of windows, which overlap by half, and of the bins of a free run


def other_shape(space: SearchSpace, point: Array) -> Array | None:
    """The point (p,) with narrow magnets instead of wide ones or the other way round, the first harmonic of the thrust
    kept; None where the shape of the field is not searched."""
    names = space.names
    if not space.fundamental or "nome" not in names:
        return None
    column = names.index("nome")
    searched = space.parameters[column]
    wide = float(searched.value(point[column])) < _EDGE
    out = point.copy()
    out[column] = searched.coordinate(_NARROW if wide else _WIDE)
    return out


def on_the_plain(problem: Problem, fit: LeastSquaresFit) -> tuple[Problem, Array] | None:
    """The problem with the widest magnets, whose thrust is the first harmonic, and the point (p - 1,) in it that keeps
    that; None where the shape is not searched, or the fit's magnets are narrow."""
    names = problem.space.names
    if not problem.space.fundamental or "nome" not in names:
        return None
    column = names.index("nome")
    searched = problem.space.parameters[column]
    if float(searched.value(fit.point[column])) >= _EDGE:
        return None
    return Problem(problem.space.holding({"nome": searched.lower}), problem.parts), np.delete(fit.point, column)


def group_squares(problem: Problem, fit: LeastSquaresFit, weights: Sequence[Array]) -> Array:
    """Weighted squares (G,) of the residuals by group, in order of time, part after part.

    weights: (N,) of each part's residuals, those of the minimum with which others are compared.
    """
    rows = problem.residuals(fit.point[None, :], fit.offsets[None, :])
    return np.concatenate(
        [
            np.bincount(part.groups, (row[0] * own) ** 2)
            for part, row, own in zip(problem.parts, rows, weights, strict=True)
        ]
    )


def advantage(squares: Array, others: Array) -> float:
    """How much less the first minimum costs than the second, in standard deviations of what the same noise may do.

    squares, others: (G,) weighted squares by group, of the same weights. Source: the test of rival models that are not
    nested (Vuong 1989, Econometrica 57), with the correlation of neighbouring groups.
    """
    change = others - squares
    centred = change - np.mean(change)
    power = float(centred @ centred)
    for lag in range(1, min(_LAGS, change.size - 1) + 1):
        power += 2.0 * (1.0 - lag / (_LAGS + 1.0)) * float(centred[lag:] @ centred[:-lag])
    return float(np.sum(change)) / max(math.sqrt(max(power, 0.0)), TINY)
