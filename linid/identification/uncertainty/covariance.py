"""Covariance of the estimates, corrected for residuals that are correlated along time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.input_noise import Feigned, WhitenedAhead
from linid.identification.objectives.noisy import Parts, answers_under_noise, driven
from linid.identification.objectives.objective import Part, ar1_lags
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.signals.motion import with_input_noise
from linid.identification.space.search_space import BOX_STD
from linid.identification.uncertainty import field_phase
from linid.identification.uncertainty.voltage_noise import noise_curvature
from linid.statistics import NORMAL_97_5

_MINIMUM_LAGS = 4
_NOISE_DRAWS = 3
# Least share of J'J that is taken for information; the draws cannot tell less from none.
_LEAST_SHARE = 0.02
# Share of a phase's first-order information, beyond what the second order tells, that noise must feign to be left out.
_FEIGNED = 0.5
_NO_EXCESS = np.zeros((0, 0))
_MOST_LEVERAGE = 0.999  # of a window that alone carries a parameter


@dataclass(frozen=True)
class Uncertainty:
    """search_covariance: (p, p) robust covariance in search coordinates; condition_number: of the scaled information
    matrix; conditional_std: (p,) search coordinate standard deviation if all other parameters were known; intervals:
    95 % intervals in search coordinates of those search coordinates that the covariance cannot describe; aligned: the
    currents keep with the field, so that its phase shows to second order only.
    """

    search_covariance: Array
    condition_number: float
    conditional_std: Array
    intervals: dict[int, tuple[float, float]] = field(default_factory=dict)
    aligned: bool = False


def box_alone(size: int) -> Uncertainty:
    """What is known of so many parameters before any data: that they lie in the search box."""
    return Uncertainty(BOX_STD**2 * np.eye(size), math.inf, np.full(size, BOX_STD))


def _blocks(problem: Problem, residuals: Array, jacobian: Array) -> list[tuple[Part, Array, Array, NDArray[np.int64]]]:
    """Per recording of each part: the part, weighted residuals (n,), Jacobian (n, k) and groups (n,)."""
    out, at = [], 0
    for part in problem.parts:
        rows = slice(at, at + part.groups.size)
        at += part.groups.size
        owner = part.group_recording[part.groups]
        for recording in range(len(part.recordings)):
            mine = owner == recording
            out.append((part, residuals[rows][mine], jacobian[rows][mine], part.groups[mine]))
    return out


def _stationary_meat(residuals: Array, jacobian: Array) -> Array:
    """J' V J with V from the residuals' autocovariance: for free runs, where few samples carry a parameter.

    Products of single residuals and Jacobian rows would underrate those samples, because the fit follows them.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = residuals.size
    power = float(residuals @ residuals)
    rho = float(residuals[1:] @ residuals[:-1]) / max(power, 1e-300)
    lags = ar1_lags(rho, n)
    correlation = np.array([float(residuals[k:] @ residuals[: n - k]) for k in range(lags + 1)]) / n
    taper = correlation * (1.0 - np.arange(lags + 1) / (lags + 1.0))
    kernel = np.concatenate([taper[:0:-1], taper])
    size = next_fast_len(n + 2 * lags, real=True)
    spectrum = rfft(jacobian, size, axis=0) * rfft(kernel, size)[:, None]
    smoothed = irfft(spectrum, size, axis=0)[lags : lags + n]
    return np.asarray(jacobian.T @ smoothed)


def _group_meat(
    residuals: Array,
    jacobian: Array,
    groups: NDArray[np.int64],
    excess: Array | None = None,
    inverse: Array | None = None,
) -> Array:
    """Newey-West sum of score products over groups (windows) in order of time.

    excess: (G, k) what noise of the inputs adds to the scores of all groups of the part, of whitened residuals;
    inverse: (k, k) of J'J of all parts. The fit follows windows that carry much of a parameter: their scores are those
    without them (jackknife).
    """
    starts = np.flatnonzero(np.diff(groups, prepend=groups[0] - 1))
    scores = np.add.reduceat(jacobian * residuals[:, None], starts, axis=0)
    if excess is not None:
        scores[:, : excess.shape[1]] -= excess[groups[starts]]
    if inverse is not None:
        for k, rows in enumerate(np.split(jacobian, starts[1:])):
            share = (rows.T @ rows) @ inverse
            scores[k] = np.linalg.solve(np.eye(share.shape[0]) - _MOST_LEVERAGE * share, scores[k])
    power = np.einsum("ij,ij->j", scores, scores)
    lag_one = np.einsum("ij,ij->j", scores[1:], scores[:-1])
    rho = float(np.median(lag_one[power > 0.0] / power[power > 0.0])) if np.any(power > 0.0) else 0.0
    lags = min(max(ar1_lags(rho, scores.shape[0]), _MINIMUM_LAGS), max(scores.shape[0] - 1, 0))
    meat = scores.T @ scores
    for lag in range(1, lags + 1):
        cross = scores[lag:].T @ scores[:-lag]
        meat += (1.0 - lag / (lags + 1.0)) * (cross + cross.T)
    return np.asarray(meat)


def _spurious_information(problem: Problem, fit: LeastSquaresFit, seed: int, jobs: int) -> Array:
    """What the noise of the logged inputs adds to J'J, from Jacobians with that noise added once more.

    Where a commutated motion itself says little (field phase, pole pitch), noise in the currents makes up
    most of the Jacobian; counted as information it would make the intervals far too narrow. Friction has no part in
    that: its forces hang on the motion.
    """
    generator = np.random.default_rng(seed)
    x, cost = fit.linearised_at, Cost(problem)
    reached = driven(problem)
    by_motion = {q.name for q in problem.space.model.friction} - {"mass"}
    pushed = np.isin(reached.columns, [k for k, name in enumerate(problem.space.names) if name not in by_motion])
    draws = (
        [[with_input_noise(r, generator) for r in part.recordings] for part in reached.problem.parts]
        for _ in range(_NOISE_DRAWS)
    )

    def jacobian(parts: Parts) -> Array:
        weights = [fit.weights[k] for k in reached.places]
        own = Problem(problem.space, parts)
        line = Linearisation(own, cost, weights=weights, wanted=pushed[: fit.point.size])
        return line.jacobian(x[reached.columns])

    if problem.carries_slopes:
        base = fit.jacobian[np.ix_(reached.rows, reached.columns)]
    else:  # by differences to one side, as those with noise are
        base = jacobian(reached.problem.parts)

    def information(parts: Parts) -> Array:
        change = (jacobian(parts) - base) * pushed
        return np.asarray(change.T @ change / _NOISE_DRAWS)

    out = np.zeros((x.size, x.size))
    out[np.ix_(reached.columns, reached.columns)] = sum(
        answers_under_noise(reached.problem.parts, draws, information, jobs)
    )
    return out


def _feigned(problem: Problem, fit: LeastSquaresFit, seed: int, known: Feigned | None, jobs: int) -> Array:
    """Information (p + k, p + k) that noise of the inputs only feigns; known: that of the currents, if it is."""
    p, size = fit.point.size, fit.point.size + fit.offsets.size
    out = np.zeros((size, size))
    if known is not None:
        out[:p, :p] = known.information
    elif problem.space.model.phases:
        out = _spurious_information(problem, fit, seed, jobs)
    out[:p, :p] += noise_curvature(problem, fit)
    return out


def _without_spurious(information: Array, spurious: Array) -> Array:
    """information - spurious, in every direction at least `_LEAST_SHARE` of the information."""
    dark = np.diag(information) <= 0.0  # nothing to take off, whatever the noise feigned there
    unit = np.where(dark, 1.0, np.sqrt(np.abs(np.diag(information))))
    spurious = np.where(dark[:, None] | dark, 0.0, spurious)
    scaled = information / np.outer(unit, unit) + 1e-12 * np.eye(unit.size)
    root = np.linalg.cholesky(scaled)
    inner = np.linalg.solve(root, np.linalg.solve(root, spurious / np.outer(unit, unit)).T)
    values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
    kept = (vectors * np.clip(1.0 - values, _LEAST_SHARE, 1.0)) @ vectors.T
    return np.asarray((root @ kept @ root.T) * np.outer(unit, unit))


def _meat(problem: Problem, residuals: Array, jacobian: Array, parameters: int, excess: Array) -> Array:
    """Covariance of the scores jacobian' residuals, with their correlation along time. excess: (G, p) of the part
    whose residuals are whitened, which noise of the inputs adds."""
    meat = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    groups = 0
    regular = jacobian.T @ jacobian
    regular[np.diag_indices(parameters)] += 1.0 / BOX_STD**2
    unit = np.sqrt(np.diag(regular))
    unit[unit == 0.0] = 1.0
    inverse = np.linalg.pinv(regular / np.outer(unit, unit), rcond=1e-10, hermitian=True) / np.outer(unit, unit)
    for part, rest, slopes, group in _blocks(problem, residuals, jacobian):
        groups += int(np.unique(group).size)
        if part.robust:
            own = excess if isinstance(part, WhitenedAhead) else None
            # Of the windings' currents all groups tell alike.
            meat += _group_meat(rest, slopes, group, own, inverse if isinstance(part, Ahead) else None)
        else:
            meat += _stationary_meat(rest, slopes)
    return meat * (groups / max(groups - parameters, 1))


def _with_deviations(covariance: Array, pair: list[int], factors: Array) -> Array:
    """A covariance (p, p) with the deviations of two parameters times factors (2,); the others follow as far as they
    hang on these."""
    inner = covariance[np.ix_(pair, pair)]
    slopes = np.linalg.solve(inner, covariance[pair]).T
    changed = inner * np.outer(factors, factors) - inner
    return np.asarray(covariance + slopes @ changed @ slopes.T)


def estimate_uncertainty(
    problem: Problem, fit: LeastSquaresFit, *, seed: int = 1, known: Feigned | None = None, jobs: int = 1
) -> Uncertainty:
    """Sandwich covariance with a Bartlett kernel over time (Newey and West 1987), start offsets marginalised.

    Information that only the noise of the inputs feigns is taken off. Directions that the data do not see keep
    the spread of the search box. seed: of the noise draws; known: what noise adds where it is known without them;
    jobs: threads.
    """
    p = len(problem.space.parameters)
    told = np.any(fit.jacobian != 0.0, axis=0)
    told[:p] = True  # a start that moves nothing, such as the speed of an axis at rest, has no share in the rest
    jacobian = fit.jacobian[:, told]
    n = jacobian.shape[1]
    # Back-EMF and windings that do not stand 120 degrees apart tell the field's phase at first order: no flat valley.
    # The currents' noise, which is known in the latter case, would also bias the scores of second order.
    hidden = known is None and not problem.space.model.winding
    pair = field_phase.columns(problem.space) if hidden else None
    spurious = _feigned(problem, fit, seed, known, jobs)[np.ix_(told, told)]
    aligned = False
    if pair is not None:
        jacobian = np.column_stack([jacobian, _second_order(problem, fit, pair)])
        first, second = fit.jacobian[:, pair], jacobian[:, n:]
        by_phase = second @ np.linalg.lstsq(second, first, rcond=1e-10)[0]
        beyond = np.einsum("ij,ij->j", first - by_phase, first - by_phase)
        aligned = bool(np.all(np.diag(spurious)[list(pair)] > _FEIGNED * beyond))
        if aligned:  # beyond what second order tells of the estimate's own phase error there is only noise
            jacobian[:, pair] = by_phase
            spurious[list(pair)] = 0.0
            spurious[:, list(pair)] = 0.0
    excess = _NO_EXCESS if known is None else known.excess
    meat = _meat(problem, fit.residuals, jacobian, p, excess)
    full = jacobian.T @ jacobian
    information = full[:n, :n]
    # The residuals have unit variance per group after weighting; the prior carries weight in the same unit.
    noise = float(np.trace(np.linalg.pinv(information) @ meat[:n, :n])) / max(n, 1)
    prior = np.zeros(n)
    prior[:p] = max(noise, 1e-12) / BOX_STD**2
    information = _without_spurious(information, spurious)
    regular = information + np.diag(prior)
    inverse = np.linalg.inv(regular)
    scores = meat.copy()
    scores[:n, :n] += np.diag(prior * max(noise, 1e-12))
    covariance = inverse @ scores[:n, :n] @ inverse
    block = covariance[:p, :p]
    intervals = {}
    if pair is not None:
        full[:n, :n] = regular
        room = np.array([[-fit.point[column], 1.0 - fit.point[column]] for column in pair])
        ends = field_phase.profile_intervals(jacobian.T @ fit.residuals, full, scores, pair, room)
        deviations = np.sqrt(np.maximum(np.diag(block)[list(pair)], 1e-300))
        widths = np.array([high - low for low, high in ends]) / (2.0 * NORMAL_97_5)
        intervals = {
            column: (float(fit.point[column]) + low, float(fit.point[column]) + high)
            for column, (low, high) in zip(pair, ends, strict=True)
        }
        block = _with_deviations(block, list(pair), widths / deviations)
    conditional = np.sqrt(max(noise, 1e-12) / np.diag(regular)[:p])
    return Uncertainty(0.5 * (block + block.T), _condition(information[:p, :p]), conditional, intervals, aligned)


def _condition(information: Array) -> float:
    """Condition number of an information matrix (p, p), its diagonal scaled to one."""
    diagonal = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values = np.linalg.eigvalsh(information / np.outer(diagonal, diagonal))
    return float(values[-1] / max(values[0], 1e-16))


def _second_order(problem: Problem, fit: LeastSquaresFit, pair: tuple[int, int]) -> Array:
    """Second derivatives (N, 3) of the weighted residuals along electrical wavenumber and shift."""
    line = Linearisation(problem, Cost(problem), weights=fit.weights)
    driven = [r for part in problem.parts for r in part.recordings if r.kind != "free_wheel"]
    reach = max(float(np.ptp(r.y)) for r in driven)
    step = np.array(field_phase.steps(problem.space, fit.point, reach))
    return field_phase.second_differences(
        lambda point: line.batch(np.column_stack([point, np.repeat(fit.offsets[None], point.shape[0], axis=0)])),
        fit.point,
        pair,
        step,
    )
