"""Long residuals and their Jacobian, in blocks of rows that few columns have a say in; turned into few rows that say
the same to least squares."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import accumulate, pairwise

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.simulation.threads import summed

# Standard deviations by which all residuals together change over the search box, of a coordinate that is left where it
# is: exact derivatives tell a direction however little it matters, and steps would go as far as they may.
_UNTOLD = 1e-6
_BEYOND_MEASURE = 1e100  # of a slope: its square and sums of these are still numbers
_FAILED = 1e3  # standard deviations: the residuals that a failed simulation leaves
_ROWS = 2048  # that are triangulated at a time: they stay in the processor's cache
_GEQRF = b"void (int *, int *, "  # how LAPACK's function begins where its integers are C's
_Pointer, _Int = ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)


@dataclass(frozen=True)
class Block:
    """Rows of a Jacobian. residuals: (m,), weighted; slopes: (m, c), to be weighted by weights: (m,); columns: (c,) of
    the whole that they are; all others are zero."""

    residuals: Array
    slopes: Array
    weights: Array
    columns: Integers


@dataclass(frozen=True)
class Tangent:
    """Weighted residuals (N,) and their Jacobian (N, width) at a point; jobs: threads, which change no bit.

    A failed simulation leaves large residuals that nothing changes; nor do slopes tell anything that have grown beyond
    all measure in a run that any change sends elsewhere.
    """

    blocks: tuple[Block, ...]
    width: int
    jobs: int = 1

    @cached_property
    def rotated(self) -> tuple[Array, Array]:
        """Residuals (m,) and Jacobian (m, width) in m axes, width + 1 or fewer, the first one along the residuals: all
        that least squares needs to know of the long ones.

        Source: QR decomposition (Golub 1965, Numer. Math. 7, 206), by blocks of rows (Demmel et al. 2012, SIAM J. Sci.
        Comput. 34, A206).
        """
        _, residual, jacobian, told = self._decomposed
        return residual, np.where(told, jacobian, 0.0)

    @cached_property
    def dense(self) -> tuple[Array, Array]:
        """Residuals (N,) and Jacobian (N, width)."""
        blocks, _, _, told = self._decomposed
        edges = list(accumulate((block.residuals.size for block in blocks), initial=0))
        jacobian = np.zeros((edges[-1], self.width))
        for block, (begin, end) in zip(blocks, pairwise(edges), strict=True):
            jacobian[begin:end, block.columns] = block.slopes * block.weights[:, None]
        jacobian[:, ~told] = 0.0
        return np.concatenate([block.residuals for block in blocks]), jacobian

    def pulled(self, rows: Array) -> Array:
        """The transposed Jacobian times rows (N,) of weighted residuals, (width,)."""
        blocks, _, _, told = self._decomposed
        out, at = np.zeros(self.width), 0
        for block in blocks:
            own = block.weights * rows[at : at + block.weights.size]
            out[block.columns] += own @ block.slopes
            at += own.size
        return np.where(told, out, 0.0)

    @cached_property
    def _decomposed(self) -> tuple[tuple[Block, ...], Array, Array, Flags]:
        """The blocks with numbers only, their residuals and Jacobian rotated, and which columns tell anything."""
        blocks = self.blocks
        residual, jacobian = _triangle_of(blocks, self.width, self.jobs)
        power = np.einsum("nk,nk->k", jacobian, jacobian)
        if not float(np.sum(power)) < _BEYOND_MEASURE**2:
            blocks = tuple(map(_measured, blocks))
            residual, jacobian = _triangle_of(blocks, self.width, self.jobs)
            power = np.einsum("nk,nk->k", jacobian, jacobian)
        return blocks, residual, jacobian, power >= _UNTOLD**2


def finite(residuals: Array) -> Array:
    """Weighted residuals (N,) without what a failed simulation leaves, (N,)."""
    return np.nan_to_num(residuals, nan=_FAILED, posinf=_FAILED, neginf=-_FAILED)


def _measured(block: Block) -> Block:
    """A block without slopes that have grown beyond all measure."""
    small = np.abs(block.slopes * block.weights[:, None]) < _BEYOND_MEASURE
    return replace(block, slopes=np.where(small, block.slopes, 0.0))


def _triangle_of(blocks: Sequence[Block], width: int, jobs: int) -> tuple[Array, Array]:
    pieces = [
        (block, begin, min(begin + _ROWS, block.residuals.size))
        for block in blocks
        for begin in range(0, block.residuals.size, _ROWS)
    ]
    heights = [min(end - begin, block.columns.size + 1) for block, begin, end in pieces]
    edges = list(accumulate(heights, initial=0))
    rows = np.zeros((edges[-1], width + 1))

    def work(number: int) -> int:
        block, begin, end = pieces[number]
        joined = np.empty((block.columns.size + 1, end - begin))
        joined[0] = block.residuals[begin:end]
        np.multiply(block.slopes[begin:end].T, block.weights[begin:end], out=joined[1:])
        own = rows[edges[number] : edges[number + 1]]
        own[:, [0, *(1 + block.columns)]] = _triangle(joined)
        return 0

    summed(work, range(len(pieces)), jobs)
    triangle: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    return triangle[:, 0], triangle[:, 1:]


def _triangle(columns: Array) -> Array:
    """The triangle (min(m, n), n) of columns (n, m), which are lost."""
    decompose = _decomposition()
    if decompose is None:
        return np.asarray(np.linalg.qr(columns.T, mode="r"))
    decompose(columns)
    n, m = columns.shape
    return np.triu(columns.T[: min(m, n)])


@cache
def _decomposition() -> Callable[[Array], None] | None:
    """LAPACK's QR decomposition of columns (n, m) in place, by scipy's own, in which other threads may work: numpy's
    and scipy's functions for Python hold the interpreter's lock. None where scipy's has other integers."""
    from scipy.linalg import cython_lapack

    capsule = cython_lapack.__pyx_capi__["dgeqrf"]
    name_of, pointer_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of.restype, pointer_of.argtypes = _Pointer, [ctypes.py_object, ctypes.c_char_p]
    name = name_of(capsule)
    if not name.startswith(_GEQRF):
        return None
    kind = ctypes.CFUNCTYPE(None, _Int, _Int, _Pointer, _Int, _Pointer, _Pointer, _Int, _Int)
    geqrf = kind(pointer_of(capsule, name))

    def decompose(columns: Array) -> None:
        n, m = columns.shape
        room, scale = np.empty(64 * n), np.empty(n)
        numbers = [ctypes.c_int(number) for number in (m, n, m, room.size, 0)]
        places = [array.ctypes.data for array in (columns, scale, room)]
        geqrf(numbers[0], numbers[1], places[0], numbers[2], *places[1:], *numbers[3:])

    return decompose
