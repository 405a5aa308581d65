"""Weighted sums of neighbouring samples that the rows of a force balance are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from linid.arrays import Array, Integers
from linid.kernel_cache import kept


@kept(error_model="numpy", nogil=True)
def _gather(samples: Array, rows: Integers, taps: Array, first: Integers, sizes: Integers, out: Array) -> None:
    """out (C, n): of each row the sum of the samples (C, m) about it, weighted by `sizes` taps from the `first` on."""
    for c in range(samples.shape[0]):
        n = 0
        while n < rows.size:
            tap, half = first[n], sizes[n] // 2
            if n + 3 < rows.size and first[n + 3] == tap:  # of one recording: sums that do not wait for each other
                a, b, d, e = rows[n] - half, rows[n + 1] - half, rows[n + 2] - half, rows[n + 3] - half
                sum_a = sum_b = sum_d = sum_e = 0.0
                for k in range(sizes[n]):
                    weight = taps[tap + k]
                    sum_a += weight * samples[c, a + k]
                    sum_b += weight * samples[c, b + k]
                    sum_d += weight * samples[c, d + k]
                    sum_e += weight * samples[c, e + k]
                out[c, n], out[c, n + 1], out[c, n + 2], out[c, n + 3] = sum_a, sum_b, sum_d, sum_e
                n += 4
                continue
            total, begin = 0.0, rows[n] - half
            for k in range(sizes[n]):
                total += taps[tap + k] * samples[c, begin + k]
            out[c, n] = total
            n += 1


@kept(error_model="numpy", nogil=True)
def _scatter(weighted: Array, rows: Integers, taps: Array, first: Integers, sizes: Integers, out: Array) -> None:
    """The adjoint: adds to out (m,) what rows, weighted (n,), are made of."""
    for n in range(rows.size):
        begin, tap = rows[n] - sizes[n] // 2, first[n]
        for k in range(sizes[n]):
            out[begin + k] += taps[tap + k] * weighted[n]


@dataclass(frozen=True)
class Stencils:
    """How the rows of a force balance follow from the samples of all its recordings.

    kernels: (R,) bumps of the recordings, odd in length; dts: (R,) their periods in s; rows: (n,) samples; owner: (n,)
    their recordings.
    """

    kernels: Sequence[Array]
    dts: Array
    rows: Integers
    owner: Integers

    def smooth(self, a: Array) -> Array:
        """Accelerations smoothed by the bump, at the rows (C, n), in m/s^2. a: (C, samples) m/s^2."""
        return self._at_rows(a, self._smooth)

    def second(self, y: Array) -> Array:
        """Second differences over time, smoothed, at the rows (C, n), in m/s^2. y: (C, samples) positions in m."""
        return self._at_rows(y, self._second)

    def sent_back(self, weighted: Array, samples: int) -> Array:
        """What is at the rows sent back to all readings (samples,): the adjoint of `second`.

        weighted: (n,) s^2/m; samples: how many there are.
        """
        out = np.zeros(samples)
        _scatter(weighted, self.rows, *self._second, out)
        return out

    @cached_property
    def _smooth(self) -> tuple[Array, Integers, Integers]:
        return self._taps(self.kernels)

    @cached_property
    def _second(self) -> tuple[Array, Integers, Integers]:
        twice = zip(self.kernels, self.dts, strict=True)
        return self._taps([np.convolve(kernel, (1.0, -2.0, 1.0)) / dt**2 for kernel, dt in twice])

    def _taps(self, kernels: Sequence[Array]) -> tuple[Array, Integers, Integers]:
        """All kernels one after the other, and each row's: where it begins and how long it is, (n,)."""
        sizes = np.array([kernel.size for kernel in kernels], dtype=np.int64)
        return np.concatenate(kernels), (np.cumsum(sizes) - sizes)[self.owner], sizes[self.owner]

    def _at_rows(self, samples: Array, taps: tuple[Array, Integers, Integers]) -> Array:
        out = np.empty((samples.shape[0], self.rows.size))
        _gather(np.ascontiguousarray(samples), self.rows, *taps, out)
        return out
