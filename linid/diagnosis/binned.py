"""Sums over the bins of a balance."""

from __future__ import annotations

from linid.arrays import Array, Flags, Integers
from linid.kernel_cache import kept


@kept(error_model="numpy", nogil=True)
def squares_by_bin(residual: Array, inverse: Array, rows: Flags, owner: Integers, power: Array, counts: Array) -> None:
    """Adds to power (B,) the squares of residual (n,) times inverse (n,), and to counts (B,) their number, of the rows
    (n,) that are chosen. owner: (n,) their bins."""
    for n in range(residual.size):
        if rows[n]:
            scaled = residual[n] * inverse[n]
            power[owner[n]] += scaled * scaled
            counts[owner[n]] += 1.0
