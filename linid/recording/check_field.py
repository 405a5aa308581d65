"""The electrical angle of phase currents against the position: pole pairs, pole pitch, and the current that pushes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.recording.recording import Recording

_CELLS = 8192  # of the stroke; a field period must hold four of them
_FEWEST_PERIODS = 1.0  # of the field within the stroke
_AGREEMENT = 0.8  # of the currents that must turn with the position: others are not commutated by it
_STEPS = 30  # of the golden section


@dataclass(frozen=True)
class Commutation:
    """How the currents' space vector turns with the position: i(t) exp(+-j (wavenumber y + phase)).

    wavenumber: electrical rad per m (rotary: per rad, the pole pairs), nan where the currents do not follow the
    position; phase: rad; sense: +1 or -1, of the phases' order; agreement: share of the currents' power that turns so.
    """

    wavenumber: float
    phase: float
    sense: int
    agreement: float


def space_vector(phase_currents: Array) -> NDArray[np.complex128]:
    """Complex amplitude (n,) in A of three phase currents (3, n) in A, 120 degrees apart."""
    turn = np.exp(2j * math.pi / 3.0 * np.arange(3))
    return np.asarray(2.0 / 3.0 * (turn @ phase_currents))


def commutation(recording: Recording) -> Commutation:
    """The field's wavenumber for which the currents turn with the position best, looking forwards and backwards alike.

    The square of the space vector is taken, since the current that pushes changes its sign. Its spectrum over the
    position has a line at twice the wavenumber.
    """
    nothing = Commutation(math.nan, math.nan, 1, 0.0)
    stroke = float(np.ptp(recording.y))
    if recording.phase_currents is None or recording.kind == "free_wheel" or stroke <= 0.0:
        return nothing
    squared = space_vector(recording.phase_currents) ** 2
    power = float(np.sum(np.abs(squared)))
    if power <= 0.0:
        return nothing
    places = np.minimum(((recording.y - recording.y.min()) / stroke * _CELLS).astype(np.int64), _CELLS - 1)
    line = np.bincount(places, squared.real, _CELLS) + 1j * np.bincount(places, squared.imag, _CELLS)
    padded = 4 * _CELLS
    size = np.abs(np.fft.fft(line, padded))
    turns = np.fft.fftfreq(padded, stroke / _CELLS)  # per m, of the square
    seen = (np.abs(turns) * stroke > 2.0 * _FEWEST_PERIODS) & (np.abs(turns) * stroke < _CELLS / 4)
    start = float(turns[int(np.argmax(np.where(seen, size, 0.0)))])
    twice = _peak(squared, recording.y, 2.0 * math.pi * start, math.pi / stroke)
    total = np.sum(squared * np.exp(-1j * twice * recording.y))
    agreement = float(np.abs(total)) / power
    if agreement < _AGREEMENT:
        return Commutation(math.nan, math.nan, 1, agreement)
    sense = 1 if twice > 0.0 else -1
    return Commutation(abs(twice) / 2.0, sense * float(np.angle(total)) / 2.0, sense, agreement)


def pushing_current(recording: Recording, found: Commutation) -> Array | None:
    """Current (n,) in A along the direction that turns with the position, its sign open; None where none does."""
    if recording.phase_currents is None or math.isnan(found.wavenumber):
        return None
    angle = found.wavenumber * recording.y + found.phase
    return np.asarray(np.real(space_vector(recording.phase_currents) * np.exp(-1j * found.sense * angle)))


def _peak(squared: NDArray[np.complex128], y: Array, start: float, reach: float) -> float:
    """The wavenumber within `reach` of `start` at which the squared currents (n,) add up most (golden section)."""

    def size(wavenumber: float) -> float:
        return float(np.abs(np.sum(squared * np.exp(-1j * wavenumber * y))))

    ratio = 0.5 * (math.sqrt(5.0) - 1.0)
    low, high = start - reach, start + reach
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = size(left), size(right)
    for _ in range(_STEPS):
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = size(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = size(right)
    return 0.5 * (low + high)
