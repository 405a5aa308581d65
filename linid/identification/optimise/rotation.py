"""Long residuals and their Jacobian, turned into few rows that say the same to least squares."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.simulation.threads import summed

_BLOCK, _AT_ONCE = 512, 16  # rows, and blocks that a thread takes


def rotated(base: Array, slopes: Array, jobs: int = 1) -> tuple[Array, Array]:
    """Residuals (N,) and Jacobian (N, n) in axes (n + 1,), the first one along the residuals: all that least squares
    needs to know of the long ones.

    base: (N,), slopes: (N, n); jobs: threads. Source: QR decomposition (Golub 1965, Numer. Math. 7, 206), by blocks of
    rows that stay in the processor's cache (Demmel et al. 2012, SIAM J. Sci. Comput. 34, A206).
    """
    width, blocks = slopes.shape[1] + 1, base.size // _BLOCK
    if blocks == 1:
        blocks = 0
    whole, rest = blocks * _BLOCK, blocks * width
    rows = np.empty((rest + base.size - whole, width))
    rows[rest:, 0], rows[rest:, 1:] = base[whole:], slopes[whole:]

    def work(first: int) -> int:
        end = min(first + _AT_ONCE, blocks)
        block = np.empty((end - first, _BLOCK, width))
        own = slice(first * _BLOCK, end * _BLOCK)
        block[:, :, 0] = base[own].reshape(-1, _BLOCK)
        block[:, :, 1:] = slopes[own].reshape(-1, _BLOCK, width - 1)
        triangles: Array = np.asarray(np.linalg.qr(block, mode="r"))
        rows[first * width : end * width] = triangles.reshape(-1, width)
        return 0

    summed(work, range(0, blocks, _AT_ONCE), jobs)
    triangle: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    return triangle[:, 0], triangle[:, 1:]
