"""Rows of a force balance are the sums of neighbouring samples that numpy's convolution gives."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.identification.objectives.stencils import Stencils


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 30), min_size=1, max_size=3), st.integers(0, 2**31))
def test_rows_are_those_of_a_convolution(halves: list[int], seed: int) -> None:
    """Whatever the bumps' widths; a sample that is no number spoils its own neighbours alone."""
    generator = np.random.default_rng(seed)
    kernels = [generator.normal(size=2 * half + 1) for half in halves]
    dts, count = generator.uniform(1e-4, 1e-3, len(halves)), 150
    samples = generator.normal(size=(2, count * len(halves)))
    rows = [np.arange(half + 2, count - half - 2, 3) for half in halves]
    owner = np.repeat(np.arange(len(halves)), [one.size for one in rows])
    flat = np.concatenate([one + count * k for k, one in enumerate(rows)])
    stencils = Stencils(kernels, dts, flat, owner)
    lost = int(generator.integers(count))
    samples[1, lost] = np.nan
    for found, dt, order in ((stencils.smooth(samples), np.ones(len(halves)), 0), (stencils.second(samples), dts, 2)):
        for row in range(2):
            expected = []
            for k, kernel in enumerate(kernels):
                part = samples[row, k * count : (k + 1) * count]
                taps = np.convolve(kernel, (1.0, -2.0, 1.0)) / dt[k] ** 2 if order else kernel
                half = taps.size // 2
                expected += [float(taps @ part[n - half : n + half + 1]) for n in rows[k]]
            largest = np.nanmax(np.abs(expected))
            np.testing.assert_allclose(found[row], expected, rtol=0.0, atol=1e-12 * largest)


def test_what_is_sent_back_is_the_adjoint() -> None:
    generator = np.random.default_rng(2)
    kernels, rows = [generator.normal(size=11)], np.arange(9, 80, 4)
    stencils = Stencils(kernels, np.array([1e-3]), rows, np.zeros(rows.size, dtype=np.int64))
    samples, weighted = generator.normal(size=100), generator.normal(size=rows.size)
    there = float(stencils.second(samples[None])[0] @ weighted)
    assert np.isclose(there, float(samples @ stencils.sent_back(weighted, 100)), rtol=1e-12)
