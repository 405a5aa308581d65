"""Shapes that several effects share: bounded factors, sine pairs, marks of recordings, grids of starting values."""

from __future__ import annotations

import math

from numba import njit

from linid.physics.effects.effect import Outlook, Values, term
from linid.physics.motors.harmonics import sine_cosine

_LEAST_FACTOR = 0.02
MOST_MARKED = 50  # recordings that a number can mark by its bits


@term
def bounded(factor: float) -> float:
    """A factor kept above a small positive value, so that no search can turn a force round."""
    return max(factor, _LEAST_FACTOR)


@njit(error_model="numpy", forceinline=True)  # so that loops over positions become vector instructions
def sine_pair(angle: float, sine: float, cosine: float) -> float:
    """sine sin(angle) + cosine cos(angle), in the unit of sine and cosine; angle: rad."""
    along_sine, along_cosine = sine_cosine(angle)
    return sine * along_sine + cosine * along_cosine


@term
def marked(record: float, recordings: float) -> bool:
    """Whether the bit of a recording's number is set in `recordings`, a sum of 2^(number - 1). record: that number."""
    if record < 1.0:
        return False
    shifted = math.floor(recordings / 2.0 ** (record - 1.0))
    return shifted - 2.0 * math.floor(0.5 * shifted) > 0.0


@term
def share_of(y: float, low: float, high: float) -> float:
    """Where y lies between low and high, as a share from 0 to 1; at most half a stroke beyond either. y,
    low, high: m.
    """
    return min(max((y - low) / max(high - low, 1e-12), -0.5), 1.5)


def wavenumbers(name: str, outlook: Outlook, longest: float, shortest: float, limit: int) -> tuple[Values, ...]:
    """Wavenumbers in rad/m that the stroke can tell apart, from 2 pi / longest up to 2 pi / shortest (m).

    At most `limit` of them, the longest waves first.
    """
    step = 0.5 * math.pi / max(outlook.stroke, 1e-9)
    first, last = 2.0 * math.pi / longest, 2.0 * math.pi / shortest
    count = min(max(int((last - first) / step) + 1, 1), limit)
    return tuple({name: first + k * step} for k in range(count))


def recording_sets(name: str, outlook: Outlook) -> tuple[Values, ...]:
    """Marks of each recording alone, then of all from one on; none for a single recording, which has no other."""
    numbers = [n for n in outlook.records if 1 <= n <= MOST_MARKED]
    if len(numbers) < 2:
        return ()
    alone = [2.0 ** (n - 1) for n in numbers]
    onwards = [sum(alone[k:]) for k in range(1, len(alone) - 1)]
    return tuple({name: bits} for bits in [*alone, *onwards])
