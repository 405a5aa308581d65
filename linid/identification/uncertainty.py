"""Covariance of the estimates, corrected for residuals that are correlated along time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.identification.polish import PolishResult
from linid.identification.problem import Problem

Array = NDArray[np.float64]

# Standard deviation of a uniform prior over the search box in gene units: what a parameter that the data
# say nothing about keeps.
_BOX_STD = 1.0 / np.sqrt(12.0)
_MINIMUM_LAGS = 4


@dataclass(frozen=True)
class Uncertainty:
    """gene_covariance: (p, p) robust covariance in gene units; condition_number: of the scaled information
    matrix; conditional_std: (p,) gene standard deviation if all other parameters were known."""

    gene_covariance: Array
    condition_number: float
    conditional_std: Array


def _scores(problem: Problem, fit: PolishResult) -> list[Array]:
    """Score (groups, parameters) of each recording in each part, in order of time."""
    scores, at = [], 0
    products = fit.jacobian * fit.residuals[:, None]
    for part in problem.parts:
        rows = products[at : at + part.groups.size]
        at += part.groups.size
        groups = int(part.groups.max()) + 1
        order = np.argsort(part.groups, kind="stable")
        starts = np.searchsorted(part.groups[order], np.arange(groups))
        summed = np.add.reduceat(rows[order], starts, axis=0)
        for recording in range(len(part.recordings)):
            scores.append(summed[part.group_recording == recording])
    return scores


def _bandwidth(scores: list[Array]) -> int:
    """Number of lags of the Bartlett kernel by Andrews' (1991) AR(1) rule, at least `_MINIMUM_LAGS`."""
    numerator = denominator = 0.0
    total = 0
    for block in scores:
        if block.shape[0] < 3:
            continue
        before, after = block[:-1], block[1:]
        power = np.einsum("ij,ij->j", before, before)
        rho = np.einsum("ij,ij->j", before, after) / np.maximum(power, 1e-300)
        rho = np.clip(rho, -0.97, 0.97)
        variance = power / block.shape[0] * (1.0 - rho**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = variance**2 / np.max(np.maximum(variance**2, 1e-300))
        numerator += float(np.sum(weight * 4.0 * rho**2 / ((1.0 - rho) ** 6 * (1.0 + rho) ** 2)))
        denominator += float(np.sum(weight / (1.0 - rho) ** 4))
        total = max(total, block.shape[0])
    if denominator <= 0.0:
        return _MINIMUM_LAGS
    lags = 1.1447 * (numerator / denominator * total) ** (1.0 / 3.0)
    return int(min(max(np.ceil(lags), _MINIMUM_LAGS), max(total - 1, 1)))


def estimate_uncertainty(problem: Problem, fit: PolishResult) -> Uncertainty:
    """Sandwich covariance with a Bartlett kernel over time (Newey-West), start offsets marginalised.

    Directions that the data do not see keep the spread of the search box.
    """
    p = len(problem.space.genes)
    information = fit.jacobian.T @ fit.jacobian
    scores = _scores(problem, fit)
    lags = _bandwidth(scores)
    meat = np.zeros_like(information)
    groups = sum(block.shape[0] for block in scores)
    for block in scores:
        meat += block.T @ block
        for lag in range(1, min(lags, block.shape[0] - 1) + 1):
            cross = block[lag:].T @ block[:-lag]
            meat += (1.0 - lag / (lags + 1.0)) * (cross + cross.T)
    meat *= groups / max(groups - p, 1)
    # The residuals have unit variance per group after weighting; the prior carries weight in the same unit.
    noise = float(np.trace(np.linalg.pinv(information) @ meat)) / max(information.shape[0], 1)
    prior = np.zeros(information.shape[0])
    prior[:p] = max(noise, 1e-12) / _BOX_STD**2
    regular = information + np.diag(prior)
    inverse = np.linalg.inv(regular)
    covariance = inverse @ (meat + np.diag(prior * max(noise, 1e-12))) @ inverse
    block = covariance[:p, :p]
    diagonal = np.sqrt(np.maximum(np.diag(information)[:p], 1e-300))
    scaled = information[:p, :p] / np.outer(diagonal, diagonal)
    values = np.linalg.eigvalsh(scaled)
    condition = float(values[-1] / max(values[0], 1e-16))
    conditional = np.sqrt(max(noise, 1e-12) / np.diag(regular)[:p])
    return Uncertainty(0.5 * (block + block.T), condition, conditional)
