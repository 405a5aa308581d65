"""Shapes that several effects share: bounded factors, sine pairs, ages and grids of starting values."""

from __future__ import annotations

import math

from linid.physics.effects.effect import Outlook, Values, term

_LEAST_FACTOR = 0.02


@term
def bounded(factor: float) -> float:
    """A factor kept above a small positive value, so that no search can turn a force round."""
    return max(factor, _LEAST_FACTOR)


@term
def sine_pair(angle: float, sine: float, cosine: float) -> float:
    """sine sin(angle) + cosine cos(angle)."""
    return sine * math.sin(angle) + cosine * math.cos(angle)


@term
def share_of(y: float, low: float, high: float) -> float:
    """Where y lies between low (0) and high (1), at most half a stroke beyond either."""
    return min(max((y - low) / max(high - low, 1e-12), -0.5), 1.5)


def wavenumbers(name: str, outlook: Outlook, longest: float, shortest: float, limit: int) -> tuple[Values, ...]:
    """Wavenumbers in rad/m that the stroke can tell apart, from 2 pi / longest up to 2 pi / shortest (m).

    At most `limit` of them, the longest waves first.
    """
    step = 0.5 * math.pi / max(outlook.stroke, 1e-9)
    first, last = 2.0 * math.pi / longest, 2.0 * math.pi / shortest
    count = min(max(int((last - first) / step) + 1, 1), limit)
    return tuple({name: first + k * step} for k in range(count))
