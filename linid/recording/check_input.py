"""Checks of what drives the axis: does the motion follow the input, how late, and is the input cut off."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.recording.check_position import SMOOTH
from linid.recording.local_polynomial import local_derivative, window_width
from linid.recording.noise import noise_level
from linid.recording.recording import Recording
from linid.recording.spectra import (
    FEWEST_SEGMENTS,
    CrossSpectra,
    cross_spectra,
    excited,
    power_within,
    reading_noise,
    segment_lengths,
    time_shift,
)
from linid.statistics import TINY

_EXCITED = 0.01  # of the input's largest power: there the input moves the axis rather than its own noise
_AUDIBLE = 10.0  # times the reading's noise: there a lack of coherence is not the encoder's
_FEWEST_BINS = 3  # one or two bins may be coherent, or not, by chance
_CARRIED = 0.2  # of the input's mean square, in the bins: the rest is constant or slower, and moves the axis too
_LONGEST = 5.0  # s, of a segment
_FRICTION = 0.5  # of the input's power; a larger share moves against friction and says little of acceleration
_STUCK = 0.25  # of the input's power: more friction bends the phase by more than a sample
_CLEAR = 0.8  # coherence of the bins whose phase is trusted
_FEWEST_PHASES = 8
_LARGEST_SHIFT = 0.02  # s
_SHARP = 0.5  # samples: a shift known less well is not claimed
_RUN = 5  # samples: shorter rests at a limit are peaks
_ROUNDING = 1e-9  # of a channel's size: what varies less is constant
_STEPS, _NOISES = 2.5, 4.0  # of the input's resolution, of its noise: within both it rests
_RAMP_STEPS = 20.0  # of the resolution between two samples: smaller steps are all alike without any limit
_NEAR, _INSIDE = 8.0, 2.0  # bands below the extreme: through the wider one a peak passes, in the other a limit stays
_AT_ZERO = 0.05  # of the largest value: a rest so near zero is no limit
_CLIPPED = 0.75  # of the time within four times the band; a smooth peak spends half of it in the band


@dataclass(frozen=True)
class Coherence:
    """How far the motion follows the input linearly.

    value: share (0 to 1) of the acceleration's power, mean over the bins that the input excites and the encoder
    resolves; correlation: -1 to 1, of input and acceleration in those bins at equal times; work: their correlation, -1
    to 1, of input and speed (a drive that overcomes friction works: positive); low, high: the band in Hz; segments,
    bins: averaged; friction: share of the input's power that direction and speed account for; judged: whether `value`
    may be held against the data, else `reason` says why not. nan where not to be had.
    """

    value: float
    correlation: float
    work: float
    low: float
    high: float
    segments: int
    bins: int
    friction: float
    judged: bool
    reason: str


@dataclass(frozen=True)
class Delay:
    """Time in s by which the acceleration comes after the input, with its standard deviation; sharp: is it known."""

    seconds: float
    deviation: float
    sharp: bool


@dataclass(frozen=True)
class Saturation:
    """Share of the time in which the input, or its rate, rests at its extreme, and the level in its unit (per s)."""

    share: float
    level: float
    rate_share: float
    rate: float


def input_checks(recording: Recording, position_step: float, thrust: Array | None) -> tuple[Coherence, Delay]:
    """Coherence and time shift of input and acceleration.

    position_step: resolution in m (rotary: rad), 0 unknown; thrust: (n,) what pushes the axis, up to a factor; None:
    the q-current or command, which phase currents are not.
    """
    u = recording.drive_input if thrust is None and recording.phase_currents is None else thrust
    unknown = Delay(math.nan, math.nan, False)
    if recording.kind == "free_wheel":
        return _unjudged("a free wheel has no input"), unknown
    if u is None:
        return _unjudged("how phase currents or voltages push depends on the position"), unknown
    if float(np.ptp(u)) <= _ROUNDING * float(np.max(np.abs(u), initial=0.0)):
        return _unjudged("the input is constant"), unknown
    y, dt = recording.y, recording.duration / max(recording.y.size - 1, 1)
    lengths = segment_lengths(y.size, dt, _LONGEST)
    if not lengths:
        return _unjudged(f"shorter than {FEWEST_SEGMENTS} segments of 64 samples"), unknown
    speed = local_derivative(y, window_width(SMOOTH, dt), 3, 1, dt)
    a = np.zeros(y.size)
    a[1:-1] = np.diff(y, 2) / dt**2
    deviation = max(noise_level(y), position_step / math.sqrt(12.0))
    best: tuple[float, CrossSpectra, np.ndarray[tuple[int], np.dtype[np.bool_]]] | None = None
    # Short segments blur resonances and leak: of what they lose the longer ones, while there are enough, lose less.
    for length in lengths:
        spectra = cross_spectra(u, a, dt, length)
        audible = spectra.power(spectra.a) > _AUDIBLE * reading_noise(spectra, deviation)
        bins = excited(spectra, _EXCITED) & audible
        if int(bins.sum()) < _FEWEST_BINS or power_within(spectra, bins) < _CARRIED * float(np.mean(u**2)):
            continue
        value = float(np.mean(spectra.coherence()[bins]))
        if best is None or value > best[0]:
            best = value, spectra, bins
    friction, work = _friction_share(u, speed)
    if best is None:
        return _unjudged("too few frequencies that the input excites and the encoder resolves", friction, work), unknown
    value, spectra, bins = best
    power = np.sum(spectra.power(spectra.u)[bins]) * np.sum(spectra.power(spectra.a)[bins])
    correlation = float(np.sum(np.real(spectra.cross()[bins])) / math.sqrt(max(float(power), TINY)))
    band = spectra.frequency[bins]
    reason = "the input goes into friction" if friction > _FRICTION else ""
    coherence = Coherence(
        value,
        correlation,
        work,
        float(band[0]),
        float(band[-1]),
        len(spectra.u),
        int(bins.sum()),
        friction,
        not reason,
        reason,
    )
    return coherence, _delay(spectra, bins) if friction < _STUCK else unknown


def _unjudged(reason: str, friction: float = math.nan, work: float = math.nan) -> Coherence:
    nan = math.nan
    return Coherence(nan, nan, work, nan, nan, 0, 0, friction, False, reason)


def _friction_share(u: Array, speed: Array) -> tuple[float, float]:
    """Share of the input's variance that direction and speed explain, and the correlation of input and speed."""
    power = math.sqrt(max(float(u @ u) * float(speed @ speed), TINY))
    columns = np.column_stack([np.ones(u.size), np.sign(speed), speed / max(float(np.max(np.abs(speed))), TINY)])
    left = u - columns @ np.linalg.lstsq(columns, u, rcond=None)[0]
    return 1.0 - float(left @ left) / max(float(np.sum((u - u.mean()) ** 2)), TINY), float(u @ speed) / power


def _delay(spectra: CrossSpectra, bins: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Delay:
    """The time shift of the coherent bins; where a resonance bends their phase, of those above it."""
    clear = bins & (spectra.coherence() > _CLEAR)
    for part in (0.0, 0.25, 0.5):
        chosen = clear.copy()
        chosen[: int(np.searchsorted(spectra.frequency, part * float(spectra.frequency[bins][-1])))] = False
        if int(chosen.sum()) < _FEWEST_PHASES:
            break
        shift = time_shift(spectra, chosen, _LARGEST_SHIFT)
        if shift.sharp and shift.deviation < _SHARP * spectra.dt:
            return Delay(shift.seconds, shift.deviation, True)
    return Delay(math.nan, math.nan, False)


def saturation(recording: Recording, input_step: float) -> Saturation:
    """How long the input, or its rate, rests at its extreme; input_step: resolution in its unit, 0 unknown."""
    channels = recording.inputs
    if channels is None or recording.kind == "free_wheel":
        return Saturation(0.0, math.nan, 0.0, math.nan)
    found = [_at_limit(x, max(_STEPS * input_step, _NOISES * noise_level(x))) for x in np.atleast_2d(channels)]
    rates = [np.diff(x) for x in np.atleast_2d(channels)]
    bands = [max(_STEPS * input_step, _NOISES * noise_level(d)) for d in rates]
    ramps = [_at_limit(d, band, _RAMP_STEPS * input_step) for d, band in zip(rates, bands, strict=True)]
    (share, level), (rate_share, rate) = max(found), max(ramps)
    rate = rate / recording.period if rate_share else math.nan
    return Saturation(share, level if share else math.nan, rate_share, rate)


def _at_limit(x: Array, band: float, least: float = 0.0) -> tuple[float, float]:
    """Share of the samples (n,) at the largest or smallest value, within `band` of it, and the level."""
    band = max(band, _ROUNDING * float(np.ptp(x)))
    count, level = 0, 0.0
    for sign in (1.0, -1.0):
        top = float(np.max(sign * x))
        if top <= max(_AT_ZERO * float(np.max(np.abs(x))), least, _NEAR * band):
            continue  # a rest at zero, or nothing but noise
        near, inside = sign * x >= top - _NEAR * band, sign * x >= top - _INSIDE * band
        edges = np.flatnonzero(np.diff(np.concatenate(([False], near, [False])).astype(np.int8)))
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            rest = int(inside[start:end].sum())
            if rest >= _RUN and rest >= _CLIPPED * (end - start):
                count += rest
                level = max(level, float(np.median((sign * x)[start:end][inside[start:end]])))
    return count / x.size, level
