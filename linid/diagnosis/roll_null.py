"""The null of `where`: residuals shifted in time against their own motion, and bin sums of all of them at once."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array, Integers

Draws = NDArray[np.float32]

PERMUTATIONS = 99


def with_rolled(x: Array, recording: Integers, seed: int) -> Draws:
    """x (n,) in the first column, then `PERMUTATIONS` draws of the null, (n, 1 + PERMUTATIONS).

    Each draw rolls each recording's values by a random time and turns its sign or not, which keeps their own
    correlation and power and undoes that with the motion. recording: (n,) whose rows lie together. Single precision:
    half the memory, and shares are not told to six digits.
    """
    generator = np.random.default_rng(seed)
    out = np.empty((1 + PERMUTATIONS, x.size), dtype=np.float32)
    out[0] = x
    edges = np.concatenate(([0], np.flatnonzero(np.diff(recording)) + 1, [x.size]))
    for start, end in itertools.pairwise(edges):
        values = out[0, start:end]
        both = np.stack([values, -values])
        shifts = generator.integers(1, max(end - start, 2), PERMUTATIONS)
        signs = generator.integers(0, 2, PERMUTATIONS)
        for draw, (shift, sign) in enumerate(zip(shifts, signs, strict=True), start=1):
            out[draw, start : start + shift] = both[sign, end - start - shift :]
            out[draw, start + shift : end] = both[sign, : end - start - shift]
    return np.ascontiguousarray(out.T)


def slot_sums(slots: Integers, size: int, columns: Draws, weights: Array | None = None) -> Array:
    """Sums of the columns (n, p) over the rows of each slot, (size, p); slots: (n,), below 0: in none.

    weights: (n,) factors of the rows. One product with a sparse matrix: each row is added to one slot.
    """
    from scipy.sparse import csr_matrix

    rows = np.flatnonzero(slots >= 0)
    values = np.ones(rows.size, dtype=np.float32) if weights is None else weights[rows].astype(np.float32)
    picked: Any = csr_matrix((values, (slots[rows], rows)), shape=(size, slots.size))
    return np.asarray(picked @ columns, dtype=np.float64)


def p_value(observed: float, null: Array) -> float:
    """Share of the null's draws (k,) that reach what was observed, the observation among them."""
    return (1.0 + float(np.sum(null >= observed))) / (1.0 + null.size)
