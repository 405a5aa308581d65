"""A curve times motor force or velocity whose factor bends: what only a large one does, or what saturates."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.basis import Basis
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.regression import Regression

BENDS = (0.3, 0.55, 0.8)  # quantiles of a factor's size at which it may bend, either way apart
_TOP = 0.998  # of the fitted rows' sizes: beyond them nothing tells how it goes on
_TURNS = 2  # of the curve beside the factor, and of the factor beside the curve
_NAMES = {"motor_force": "F", "velocity": "v"}


def bent(problem: Problem, found: Regression) -> Regression | None:
    """The family with a factor that bends where these rows ask for it, or None where it has no factor that could.

    Curve and factor are found in turn, each by all rows that may be fitted (alternating least squares: a product of two
    functions has the coefficients of both, a surface those of every pair).
    """
    family = found.family
    if family.local or family.bends or family.factor not in _NAMES or len(family.sides) != 1 or not family.call:
        return None
    x = problem.push if family.factor == "motor_force" else problem.rows.v
    if not np.any(x[~problem.held]):
        return None
    side, sums = family.sides[0], found.sums
    functions = side.at(side.argument.values, side.argument.spread)
    pieces = _pieces(problem, x, _NAMES[family.factor])
    for _ in range(_TURNS):
        curve = functions @ found.solution()[0]
        by_piece = Regression(sums, Family((), "", problem.pushed(pieces.columns * curve[:, None]), pieces.roughness))
        weights = by_piece.solution()[0]
        factor = pieces.columns @ weights
        size = float(np.std(factor))
        if not size > 0.0:
            return None
        scale = float(np.std(x)) / size  # so that amplitudes are of the size that they have with a straight factor
        text = " + ".join(f"{scale * w:.6g}*{one}" for w, one in zip(weights, pieces.factors, strict=True))
        columns = problem.pushed(functions * (scale * factor)[:, None])
        found = Regression(sums, replace(family, columns=columns))
    form, formula = f"{family.form}, bent", f"({text})*({family.call})"
    return Regression(sums, replace(found.family, form=form, formula=formula, bends=pieces.columns.shape[1]))


def _pieces(problem: Problem, x: Array, symbol: str) -> Basis:
    """The pieces (n, 2 bends + 1) of a factor (n,) in SI between its bends, each 0 where it is 0; beyond all fitted
    rows it grows no more."""
    sizes = np.abs(x[~problem.held & (x != 0.0)])
    ends = [float(f"{one:.4g}") for one in np.quantile(sizes, [*BENDS, _TOP])]
    pairs = list(pairwise([*(-end for end in reversed(ends)), *ends]))
    columns = [np.clip(x, low, high) - min(max(0.0, low), high) for low, high in pairs]
    factors = []
    for low, high in pairs:
        zero = min(max(0.0, low), high)
        factors.append(f"(max(min({symbol}, {high:g}), {low:g}){f' - {zero:g}' if zero else ''})")
    return Basis(np.array(columns).T, np.eye(len(columns)), "", tuple(factors))
