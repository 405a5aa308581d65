"""What a diagnosis that knew the effects would reach: the yardstick for the one that does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from linid.arrays import Array, Integers
from linid.diagnosis.balance import Balance
from linid.diagnosis.base import Base, fit_base_model, numbered
from linid.diagnosis.held_out_tests import Part
from linid.diagnosis.means import Means
from linid.diagnosis.measures import model_of
from linid.diagnosis.parts import part_of
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import fit_effects
from linid.diagnosis.shares import Shares, shares_of
from linid.identification.result import FitResult, ModelKind
from linid.recording.recording import Recording

_ROUNDS = 6  # of weights, which settle in a few
_HORIZON, _WHOLE = 0.1, 1.2  # s of a prediction, and what of it its rows may span


@dataclass(frozen=True)
class Oracle:
    """A model with the true effects: the shares of the gap that they close, and what each one's absence costs."""

    shares: Shares
    parts: tuple[Part, ...]


def oracle(
    recordings: Sequence[Recording],
    kind: ModelKind,
    effects: Sequence[str],
    known: dict[str, float],
    *,
    jobs: int = 1,
    seed: int = 1,
) -> Oracle | None:
    """The base model with exactly these effects, fitted and judged like any other; None if one makes no sense here.

    recordings: both splits; known: SI values that are not identified.
    """
    base = _base(recordings, kind, known, jobs, seed)
    screening = Screening(base.judge.fits, base.fitted, jobs)
    found = fit_effects(base, screening, effects)
    if found is None:
        return None
    parts = tuple(part_of(base.judge, base.fitted, found, name, jobs) for name in found.model.effects)
    return Oracle(shares_of(base.judge, base.fitted, found, seed), parts)


@dataclass(frozen=True)
class TermOracle:
    """What the true term reaches beside the base: closure, share of the held-out excess; ahead: share of the base's
    held-out error 0.1 s ahead that it leaves."""

    closure: float
    ahead: float


def oracle_of_term(
    recordings: Sequence[Recording],
    kind: ModelKind,
    term: Sequence[Array],
    known: dict[str, float],
    *,
    jobs: int = 1,
    seed: int = 1,
) -> TermOracle | None:
    """What a known term closes on held-out rows, linear in its amplitude, with the base fitted beside it.

    term: (n,) acceleration in m/s^2 at the samples of each recording; the base moves along its slopes. At rest the
    bristles balance a force: there the term may have an amplitude of its own. Least squares on the fitted rows, each
    stretch of 50 ms in units of what is left in it. None where there is no excess, or no row to judge by.
    """
    base = _base(recordings, kind, known, jobs, seed)
    judge, split = base.judge, base.judge.balance.split
    before = judge.excess(base.fitted.residual) if split.any() else 0.0
    if before <= 0.0:
        return None
    left = _left_beside(base, judge.balance.smoothed(term))
    held, rows = split, judge.balance.rows
    errors = [_error_ahead(rows.t[held], rows.recording[held], one[held]) for one in (base.fitted.residual, left)]
    return TermOracle(1.0 - judge.excess(left) / before, errors[1] / max(errors[0], 1e-300))


def ahead_along(result: FitResult, recordings: Sequence[Recording]) -> float:
    """RMS position error in m (rotary: rad) 0.1 s after any row by what a model misses along the measured motion, as
    that of a true term is told. Source: linid's own form."""
    model, vector = model_of(result)
    balance = Balance(model, recordings, 1, result.seed)
    return _error_ahead(balance.rows.t, balance.rows.recording, balance.residuals(model, vector)[0])


def _error_ahead(t: Array, owner: Integers, residual: Array) -> float:
    """RMS position error in m that missing accelerations residual (n,) in m/s^2 cause 0.1 s after any row, from the
    right position and speed; t: (n,) s, owner: (n,) recordings."""
    squares: list[Array] = []
    for one in np.unique(owner):
        mine = owner == one
        x, a = t[mine], residual[mine]
        v = cumulative_trapezoid(a, x, initial=0.0)
        y = cumulative_trapezoid(v, x, initial=0.0)
        end = np.searchsorted(x, x + _HORIZON)
        start = np.flatnonzero(end < x.size)
        after = end[start]
        late = x[after] - x[start]
        whole = late < _WHOLE * _HORIZON  # rows that an input's jump takes away leave a gap
        error = y[after] - y[start] - v[start] * late
        squares.append(error[whole] ** 2)
    every = np.concatenate(squares)
    return float(np.sqrt(np.mean(every))) if every.size else 0.0


def _base(recordings: Sequence[Recording], kind: ModelKind, known: dict[str, float], jobs: int, seed: int) -> Base:
    """The base model without effects, fitted to both splits. known: SI values that are not identified."""
    return fit_base_model(numbered(recordings), kind, known, Means(jobs, seed=seed), [])


def _left_beside(base: Base, column: Array) -> Array:
    """What a base leaves (n,) in m/s^2 when a term (n,) stands beside it."""
    judge, rows = base.judge, base.judge.balance.rows
    moving = np.where(rows.standstill, 0.0, column)
    design = np.stack([moving, column - moving, *judge.fits.slopes(base.fitted).values()], axis=1)
    residual, fitted = base.fitted.residual, ~judge.balance.split
    design = design[:, np.linalg.norm(design[fitted], axis=0) > 0.0]
    size = judge.scale[rows.recording]
    left, counts = residual, np.maximum(np.bincount(rows.bin[fitted], minlength=rows.bin.max() + 1), 1)
    for _ in range(_ROUNDS):
        power = np.bincount(rows.bin[fitted], (left[fitted] / size[fitted]) ** 2, minlength=counts.size) / counts
        weight = 1.0 / (size * np.sqrt(1.0 + power[rows.bin]))
        scaled = design[fitted] * weight[fitted, None]
        norms = np.linalg.norm(scaled, axis=0)
        found = np.linalg.lstsq(scaled / norms, residual[fitted] * weight[fitted], rcond=1e-8)[0] / norms
        left = residual - design @ found
    return left
