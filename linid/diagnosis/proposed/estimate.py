"""The coefficients of a proposed term without what the model's own parameters can do, and how well they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from linid.arrays import Array, Integers
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.regression import Regression

CONFOUNDED = 0.02  # of a column's power: what the base leaves less of, cannot be told from it
LONG = 1.0  # s; neighbouring rows hang together about as long as a move lasts


@dataclass(frozen=True)
class Estimated:
    """coefficients: (k,) in N per unit of the factor; covariance: (k, k); told: (k, k) takes from any coefficients what
    the base can do, as was done to these."""

    coefficients: Array
    covariance: Array
    told: Array


def estimated(problem: Problem, regression: Regression) -> Estimated:
    """Coefficients by all rows that may be fitted, with a covariance that holds for rows that hang together.

    The covariance is the sum of a sandwich over blocks of time and of what the penalty may have bent (its share of the
    Bayesian covariance: Marra and Wood 2012, Scand. J. Stat. 39, 53), both widened where longer stretches of time hang
    together more.
    """
    split = regression.sums.split
    mine = regression.fitted_rows
    matrix = np.hstack([regression.sums.base[mine], regression.columns[mine]])
    rest, rows = regression.sums.rest[mine], split.order[mine]
    normal = matrix.T @ matrix
    system = regression.system(regression.total)
    inverse = np.asarray(np.linalg.inv(system))
    solution = inverse @ (matrix.T @ rest)
    left = rest - matrix @ solution
    r = regression.r
    covariance = _covariance(problem, matrix, left, rows, inverse, system - normal)[r:, r:]
    told = _told(normal, r)
    out = told @ solution[r:] / regression.size
    return Estimated(out, told @ covariance @ told.T / regression.size**2, told)


def _covariance(problem: Problem, matrix: Array, left: Array, rows: Integers, inverse: Array, penalty: Array) -> Array:
    """Covariance (p, p) of the solution. matrix: (n, p); left: (n,); rows: (n,) numbers of the problem's rows."""
    short = problem.rows.block[rows]
    pieces = (problem.rows.t[rows] / LONG).astype(np.int64)
    long = problem.rows.recording[rows] * (int(pieces.max()) + 1) + pieces
    spread = [inverse @ _scores(matrix, left, owner) @ inverse for owner in (short, long)]
    independent = float(np.mean(left**2)) * inverse @ (matrix.T @ matrix) @ inverse
    usual = max(float(np.trace(independent)), 1e-300)
    inflation = max(float(np.trace(one)) / usual for one in spread)
    wider = max(inflation * usual / max(float(np.trace(spread[0])), 1e-300), 1.0)
    bent = max(inflation, 1.0) * float(np.mean(left**2)) * inverse @ penalty @ inverse
    return np.asarray(wider * spread[0] + bent)


def _scores(matrix: Array, left: Array, owner: Integers) -> Array:
    """Sum over groups of rows of the products (p, p) of their scores, made good for what the fit took up."""
    numbers = np.unique(owner, return_inverse=True)[1]
    groups = int(numbers.max()) + 1
    order = np.argsort(numbers, kind="stable")
    starts = np.searchsorted(numbers[order], np.arange(groups))
    scores = np.add.reduceat((matrix * left[:, None])[order], starts, axis=0)
    return np.asarray(scores.T @ scores * groups / max(groups - matrix.shape[1], groups / 2.0))


def _told(normal: Array, r: int) -> Array:
    """What (k, k) takes from coefficients the functions that the first r columns of a regression can do too.

    normal: (r + k, r + k) products of all columns.
    """
    own = normal[r:, r:]
    sizes = np.diag(normal[:r, :r])
    base = normal[:r, :r] + 1e-9 * np.diag(np.where(sizes > 0.0, sizes, 1.0))
    clear = own - normal[r:, :r] @ np.linalg.solve(base, normal[:r, r:])
    k = own.shape[0]
    shares, ways = eigh(0.5 * (clear + clear.T), own + 1e-9 * float(np.trace(own)) / k * np.eye(k))
    same = ways[:, shares < CONFOUNDED]
    return np.asarray(np.eye(k) - same @ same.T @ own)
