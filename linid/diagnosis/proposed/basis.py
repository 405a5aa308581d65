"""Smooth functions of an argument as columns: cubic B-splines, periodic ones, waves, and their products."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import Argument
from linid.diagnosis.proposed.spline_columns import uniform_splines
from linid.diagnosis.proposed.wave_columns import wave_columns

_DEGREE = 3
_ENDS = 0.002  # of the rows on either side: a curve needs more than a handful of rows to be drawn by
# Of a curve's own penalty: where no fitted row lies a curve returns to nothing, and is no line drawn on from its last
# bend, which would be far off in a recording that goes further than the others.
_LEVEL = 0.01
_NOT_ROUGH = 1e-6  # penalty of functions that have no curvature to be punished


@dataclass(frozen=True)
class Side:
    """Functions of one argument, to be drawn anywhere: `size` splines from low to high in its unit (or around its
    period), waves of some wavenumbers in rad per unit of it (after a constant, where it has a mean), or a step at 0 (of
    size 1)."""

    argument: Argument
    low: float
    high: float
    size: int
    wavenumbers: tuple[float, ...] = ()
    mean: bool = False

    def at(self, x: Array, spread: Array | float = 0.0) -> Array:
        """The functions (m, k) at x (m,), in the argument's unit; spread: (m,) of what is averaged, for waves."""
        if self.wavenumbers:
            columns = wave_columns(x, self.wavenumbers, spread)
            return np.hstack([np.ones((x.size, 1)), columns]) if self.mean else columns
        if self.size == 1:
            return np.asarray((x > 0.0)[:, None], dtype=np.float64)
        if self.argument.period:
            return _wrapped(x, self.argument.period, self.size)
        return _splines(x, self.low, self.high, self.size)


@dataclass(frozen=True)
class Basis:
    """columns: (n, k), dimensionless; roughness: (k, k) whose quadratic form is a curve's penalty; call: the function
    of a formula that these columns are, with its numbers, empty where a formula has none; factors: the columns one by
    one as formulas, where each has one; sides: what they are the products of functions of, the last one running
    fastest, empty where they cannot be drawn."""

    columns: Array
    roughness: Array
    call: str = ""
    factors: tuple[str, ...] = ()
    sides: tuple[Side, ...] = ()


def constant(rows: int) -> Basis:
    """One column of ones (rows, 1)."""
    return Basis(np.ones((rows, 1)), _NOT_ROUGH * np.eye(1), "c_1", ("1",))


def curve(argument: Argument, size: int) -> Basis:
    """`size` cubic B-splines on equal intervals over the argument's support, periodic ones for a periodic argument.

    Source: Eilers and Marx 1996, Stat. Sci. 11, 89 (P-splines).
    """
    if argument.period:
        columns = _wrapped(argument.values, argument.period, size)
        second = np.roll(np.eye(size), 1, axis=0) - 2.0 * np.eye(size) + np.roll(np.eye(size), -1, axis=0)
        call = f"periodic({argument.symbol}, {argument.period:.10g}, {size})"
        return Basis(columns, _rough(second), call, sides=(Side(argument, 0.0, argument.period, size),))
    low, high = support(argument.values)
    columns = _splines(argument.values, low, high, size)
    second = np.diff(np.eye(size), 2, axis=0)
    call = f"spline({argument.symbol}, {low:.10g}, {high:.10g}, {size})" if argument.symbol else ""
    return Basis(columns, _rough(second), call, sides=(Side(argument, low, high, size),))


def _rough(second: Array) -> Array:
    """Penalty (k, k) of curvature, by second differences (m, k) of the coefficients, and a little of their size."""
    return np.asarray(second.T @ second + _LEVEL * np.eye(second.shape[1]))


def support(values: Array) -> tuple[float, float]:
    """Where all but a few of the values (n,) that are finite lie, in their unit."""
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [_ENDS, 1.0 - _ENDS]).tolist() if known.size else (0.0, 1.0)
    return low, max(high, low + 1e-9 * max(abs(low), 1.0))


def _splines(x: Array, low: float, high: float, size: int) -> Array:
    """Cubic B-splines (n, size) on equal intervals from low to high, beyond which they keep their values."""
    pieces = size - _DEGREE
    return uniform_splines(np.clip((x - low) * (pieces / (high - low)), 0.0, pieces), pieces, size)


def _wrapped(x: Array, period: float, size: int) -> Array:
    """Periodic cubic B-splines (n, size) with knots at multiples of period / size."""
    return uniform_splines(np.mod(x, period) * (size / period), size, size)


def waves(argument: Argument, wavenumbers: Sequence[float], mean: bool = False) -> Basis:
    """Cosine and sine (n, 2 W) of each wavenumber in rad per unit of an argument, as its rows see them, after a
    constant where `mean` says so."""
    side = Side(argument, *support(argument.values), 2 * len(wavenumbers) + mean, tuple(wavenumbers), mean)
    columns = side.at(argument.values, argument.spread)
    factors = tuple(f"{name}({k:.10g}*{argument.symbol})" for k in wavenumbers for name in ("cos", "sin"))
    factors = ("1", *factors) if mean else factors
    call = " + ".join(f"c_{number}*{factor}" for number, factor in enumerate(factors, 1))
    return Basis(columns, _NOT_ROUGH * np.eye(columns.shape[1]), call, factors, (side,))


def product(one: Basis, other: Basis) -> Basis:
    """All products of the functions of two bases, (n, k l); rough where it is rough along either."""
    columns = np.einsum("ni,nj->nij", one.columns, other.columns).reshape(one.columns.shape[0], -1)
    eyes = np.eye(one.roughness.shape[0]), np.eye(other.roughness.shape[0])
    call = ""
    if one.call.startswith("spline(") and other.call.startswith("spline("):
        call = f"spline2({one.call[7:-1]}, {other.call[7:-1]})"
    elif one.factors and other.call.startswith("spline("):
        call = " + ".join(f"{factor}*{other.call}" for factor in one.factors)
    sides = one.sides + other.sides if one.sides and other.sides else ()
    return Basis(columns, np.kron(one.roughness, eyes[1]) + np.kron(eyes[0], other.roughness), call, sides=sides)
