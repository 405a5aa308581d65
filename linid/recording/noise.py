"""How finely a channel is resolved, and how noisy it is: both from its samples alone."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array
from linid.statistics import MEDIAN_ABSOLUTE, robust_spread

_ORDER = 4  # of the differences in which smooth motion vanishes
_TURNING_ORDER = 8  # of those in which a quantity that turns with the field does
_WITHIN = 4.0  # deviations: nearly all of the noise, none of a step
_FEWEST = 8  # samples: of fewer there are hardly any such differences
ROUNDING = 1e-12  # of the largest value: differences below are those of arithmetic
# A channel is coarse where the spread of fourth differences is below so many of its steps; of Gaussian squares the
# lower nine tenths have this share of the mean.
_COARSE, _KEPT, _KEPT_POWER = 12.0, 0.9, 0.623
_BURST = 10.0  # deviations, beyond which a fourth difference is a burst of the motion
_AROUND = 101  # samples over which noise is taken to be the same
_FAR = 3.0  # times that of a coarse channel is more than how unevenly its steps fall
_LIKE = 1.5  # times that of the whole channel is no other noise: so few samples tell it to an eighth
_MOST_SAMPLES = 20_000  # a resolution shows in that many, taken evenly; more cost time and memory
_LATTICE = 0.2  # RMS distance from a lattice, in quanta: 0.29 is what chance gives, 0.13 printing 314 as 300 or 400
_FEWEST_STEPS = 12  # fewer may lie on a lattice by chance
_REACH = (3, 10, 30, 100, 300, 1000)  # quanta; longer steps once shorter ones have refined the quantum
_LAGS = (8, 64)  # values apart: travel per sample that changes a little looks like a lattice, but not over so many
_ROUNDINGS = 4.0  # that a difference of two steps carries
_ONE_QUANTUM = 1.5  # times the shortest step: what is longer may be two of them
_PARTS = (1, 2, 3, 4)  # the smallest step seen may be so many quanta


def difference_gain(order: int) -> float:
    """Factor on the variance of white noise that the differences of some order have: the squared binomials' sum."""
    return float(math.comb(2 * order, order))


def noise_level(samples: Array) -> float:
    """Standard deviation of white noise in samples (n,), from fourth differences (robust, unit of the samples)."""
    if samples.size < _FEWEST:
        return 0.0
    differences = np.diff(samples, _ORDER)
    spread = robust_spread(differences)
    if spread < _COARSE * smallest_step(samples):
        # A median of few different values jumps: the mean square of all but the largest tenth does not.
        squares = np.sort(differences**2)
        kept = squares[: max(int(_KEPT * squares.size), 1)]
        spread = float(np.sqrt(np.mean(kept) / _KEPT_POWER)) or float(np.sqrt(np.mean(squares)))
    return float(spread / np.sqrt(difference_gain(_ORDER)))


def white_level(samples: Array) -> float:
    """Standard deviation of white noise in samples (n,) of a turning quantity, in their unit, from eighth differences.

    Commutated currents and voltages turn by a third of a radian per sample, and only that many differences leave next
    to nothing of them (gain (2 sin(x / 2))^8). A mean square, so that a coarse channel's few values do not show.
    """
    if samples.size < 2 * _TURNING_ORDER:
        return 0.0
    differences = np.diff(samples, _TURNING_ORDER)
    kept = differences[np.abs(differences) <= _WITHIN * robust_spread(differences)]
    return float(np.sqrt(np.mean(kept**2) / difference_gain(_TURNING_ORDER))) if kept.size else 0.0


def noise_profile(samples: Array) -> Array:
    """Standard deviation (n,) of white noise around each of the samples (n,): an interpolating encoder, or time stamps
    that jitter, are noisier in motion than at rest. The level of all where the difference is within the estimate's
    scatter."""
    from scipy.ndimage import median_filter, uniform_filter1d

    level = noise_level(samples)
    if samples.size < 2 * _AROUND:
        return np.full(samples.size, level)
    differences = np.abs(np.diff(samples, _ORDER))
    gain = np.sqrt(difference_gain(_ORDER))
    limit = level * gain
    if limit < _COARSE * _resolution(samples):  # a median of few different values says nothing
        squares = np.minimum(differences, _BURST * limit) ** 2
        spread = np.sqrt(np.maximum(uniform_filter1d(squares, _AROUND, mode="nearest"), 0.0))
        spread[spread < _FAR * limit] = limit
    else:
        spread = median_filter(differences, _AROUND, mode="reflect") / MEDIAN_ABSOLUTE
    spread = np.pad(spread / gain, _ORDER // 2, mode="edge")
    return np.asarray(np.where((spread < _LIKE * level) & (level < _LIKE * spread), level, spread))


def _resolution(samples: Array) -> float:
    """Quantum of samples (n,), of few different values their smallest step: on a fast run neighbours are further apart
    than the resolution, whatever it is."""
    few = np.unique(samples).size <= _FEWEST_STEPS
    return smallest_step(samples) if few else quantum(samples)


def smallest_step(samples: Array) -> float:
    """The smallest difference between two values of samples (n,) that is more than rounding; 0 where all are equal."""
    steps = np.diff(np.unique(samples))
    steps = steps[steps > ROUNDING * float(np.max(np.abs(samples), initial=0.0))]
    return float(np.min(steps)) if steps.size else 0.0


def quantum(samples: Array) -> float:
    """Smallest step of a channel's samples (n,) in their unit: the lattice that all its values lie on; 0 where there is
    none.

    Neighbouring values of the sorted samples differ by whole multiples of the resolution; without a lattice (finer
    digits than the noise, resampled or computed values) their differences are of any size. On a fast run each sample is
    many steps on: there the differences of those differences are the shortest multiples.
    """
    some = samples[:: -(-samples.size // _MOST_SAMPLES) or 1]
    values = np.unique(some[np.isfinite(some)])
    if values.size <= _FEWEST_STEPS:
        return 0.0
    # Equal numbers come out of arithmetic with different last bits.
    rounding = ROUNDING * max(abs(values[0]), abs(values[-1]))
    values = values[np.concatenate([[True], np.diff(values) > rounding])]
    steps = np.sort(np.diff(values))
    if steps.size < _FEWEST_STEPS:
        return 0.0
    further = [values[lag:] - values[:-lag] for lag in _LAGS if values.size > lag]
    differences = np.sort(np.diff(steps))
    differences = differences[differences > _ROUNDINGS * rounding]
    for lengths in (steps, differences):
        if lengths.size:
            smallest = float(np.median(lengths[lengths < _ONE_QUANTUM * lengths[0]]))
            for part in _PARTS:
                step = _lattice(steps, smallest / part)
                if step > 0.0 and all(_on_lattice(spans, step) for spans in further):
                    return step
    return 0.0


def _on_lattice(spans: Array, step: float) -> bool:
    """Whether spans (n,) of values further apart are multiples of a step, too: those of an even motion are not."""
    near = spans[spans < (_REACH[-1] + 0.5) * step] / step
    return near.size < _FEWEST_STEPS or float(np.sqrt(np.mean((near - np.rint(near)) ** 2))) < _LATTICE


def _lattice(steps: Array, step: float) -> float:
    """The quantum near `step` of which all steps (n,), sorted, are multiples; 0 if they are not."""
    for reach in _REACH:
        near = steps[steps < (reach + 0.5) * step]
        if near.size:
            counts = np.maximum(np.rint(near / step), 1.0)
            step = float(near @ counts) / float(counts @ counts)
    distance = near / step - np.rint(near / step)
    fits = near.size >= _FEWEST_STEPS and float(np.sqrt(np.mean(distance**2))) < _LATTICE
    return step if fits else 0.0
