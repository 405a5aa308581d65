"""What an objective is: residuals of some recordings, in classes and groups.

Each part holds some recordings and gives, for every candidate, residuals with a class each. Residuals of a
class share one unknown noise level; groups keep the order in time for the uncertainty.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeGuard

import numpy as np

from linid.arrays import Array, Integers
from linid.identification.signals.motion import Motion
from linid.recording.recording import Recording

TRAVEL_CLASSES = (1e-4, 1e-2)  # of the recording's range: resting, creeping, moving


class Part(Protocol):
    """Residuals of some recordings under one objective."""

    name: str
    recordings: tuple[Recording, ...]
    motion: Motion
    classes: Integers  # (N,)
    groups: Integers  # (N,), consecutive along time
    group_recording: Integers  # (groups,)
    signal: Array  # (N,) the residuals of an axis that does nothing, as a scale
    nuisances: int  # start-state offsets per candidate
    floor: float
    robust: bool  # whether single groups may be outliers (bursts, unstable breakaways)

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) residuals in the part's unit; params: (C, VECTOR_SIZE); offsets: (C, nuisances)."""
        ...


class Directions(NamedTuple):
    """K directions in which residuals are differentiated: params (K, VECTOR_SIZE) SI, offsets (K, nuisances)."""

    params: Array
    offsets: Array


class Differentiable(Part, Protocol):
    """A part whose simulation carries its derivatives along."""

    @property
    def carries_slopes(self) -> bool:
        """Whether it does so for this model and these recordings."""
        ...

    def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
        """Residuals (N,) at params (VECTOR_SIZE,) and offsets (nuisances,), and their derivatives (N, K)."""
        ...


class Counting(Part, Protocol):
    """A part that tells how many of its residuals are independent of each other."""

    def independent(self, residuals: Array, slopes: Array | None = None) -> Array:
        """How many of residuals (N,) are, by class; slopes: (N, p + 2) as of `FreeRun.independent`."""
        ...


def counts_samples(part: Part) -> TypeGuard[Counting]:
    """Whether a part's samples may count each, and not only its groups."""
    return hasattr(part, "independent")


def carries_slopes(part: Part) -> TypeGuard[Differentiable]:
    """Whether derivatives of a part's residuals come with its simulation instead of by differences."""
    return bool(getattr(part, "carries_slopes", False))


def stands_for(part: Part) -> int:
    """How many groups of all data each group of a part counts as: of a thinned part, several."""
    return int(getattr(part, "stands_for", 1))


def travel_class(span: Array, full: float) -> Integers:
    """Class (n,) of residuals by the travel that they tell of: 0 resting, 1 creeping, 2 moving.

    span: (n,) travel; full: the recording's range, in the same unit.
    """
    limits = np.array(TRAVEL_CLASSES) * full
    return np.asarray(np.searchsorted(limits, span), dtype=np.int64)


def independent_along(residuals: Array) -> float:
    """How many independent residuals tell as much as a row of residuals (n,) that are correlated along time.

    n over the sum of their autocorrelation with a Bartlett kernel; at most n.
    """
    power = float(residuals @ residuals)
    if not 0.0 < power < np.inf:
        return 0.0
    n = residuals.size
    rho = float(residuals[1:] @ residuals[:-1]) / power
    lags = ar1_lags(rho, n)
    share = 1.0 + 2.0 * sum(
        (1.0 - k / (lags + 1.0)) * float(residuals[k:] @ residuals[: n - k]) / power for k in range(1, lags + 1)
    )
    return n / max(share, 1.0)


def ar1_lags(rho: float, size: int) -> int:
    """Lags of the Bartlett kernel for an AR(1) series of correlation rho and length size.

    Source: Andrews 1991, Econometrica 59, 817.
    """
    rho = min(max(rho, -0.97), 0.97)
    alpha = 4.0 * rho**2 / ((1.0 - rho) ** 2 * (1.0 + rho) ** 2)
    return int(min(np.ceil(1.1447 * (alpha * size) ** (1.0 / 3.0)), size // 3))
