"""How finely a channel is resolved, and how noisy it is: both from its samples alone."""

from __future__ import annotations

import numpy as np

from linid.recording.recording import Array

_MOST_SAMPLES = 20_000  # a resolution shows in that many, taken evenly; more cost time and memory
_LATTICE = 0.2  # RMS distance from a lattice, in quanta: 0.29 is what chance gives, 0.13 printing 314 as 300 or 400
_FEWEST_STEPS = 12  # fewer may lie on a lattice by chance
_REACH = (3, 10, 30, 100, 300, 1000)  # quanta; longer steps once shorter ones have refined the quantum
_PARTS = (1, 2, 3, 4)  # the smallest step seen may be so many quanta


def noise_level(samples: Array) -> float:
    """Standard deviation of white noise in samples (n,), from fourth differences (robust, unit of the samples).

    Smooth motion vanishes in fourth differences; their variance is 70 times that of white noise.
    """
    if samples.size < 8:
        return 0.0
    differences = np.diff(samples, 4)
    spread = float(np.median(np.abs(differences))) / 0.6745
    rms = float(np.sqrt(np.mean(differences**2)))
    # Quantised standstill has a zero median: then the mean square counts, which motion may inflate.
    return float((spread if spread > 0.0 else rms) / np.sqrt(70.0))


def quantum(samples: Array) -> float:
    """Smallest step of a channel (n,) in its unit: the lattice that all its values lie on; 0 where there is none.

    Neighbouring values of the sorted samples differ by whole multiples of the resolution; without a lattice (finer
    digits than the noise, resampled or computed values) their differences are of any size.
    """
    some = samples[:: -(-samples.size // _MOST_SAMPLES) or 1]
    values = np.unique(some[np.isfinite(some)])
    if values.size <= _FEWEST_STEPS:
        return 0.0
    # Equal numbers come out of arithmetic with different last bits.
    steps = np.diff(values)
    steps = np.sort(steps[steps > 1e-12 * max(abs(values[0]), abs(values[-1]))])
    if steps.size < _FEWEST_STEPS:
        return 0.0
    smallest = float(np.median(steps[steps < 1.5 * steps[0]]))
    return next((step for part in _PARTS if (step := _lattice(steps, smallest / part)) > 0.0), 0.0)


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
