"""Whether a recording may be predicted worse by chance alone: paired tests over its windows."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.diagnosis.forecast import PIECES

# That a recording which both models predict alike seems to be predicted worse by one of them, by either of two tests.
CHANCE = 0.05


def by_chance(before: Array, after: Array, floor: float) -> bool:
    """Whether a recording's predictions are no worse by a second model than chance explains.

    Squares tell what few large errors do, logarithms what becomes of most windows, errors far below the floor alike.
    before, after: (k,) errors in m (rotary: rad) of the same windows, one after the other; floor: RMS in m.
    Fewer windows than pieces tell nothing: then nothing is put down to chance.
    Source: Student's t of paired means, as Diebold and Mariano 1995, J. Bus. Econ. Stat. 13, 253, compare forecasts.
    """
    from scipy.special import stdtrit

    if before.size < PIECES or not (np.all(np.isfinite(before)) and np.all(np.isfinite(after))):
        return False
    squares = [errors**2 + max(floor, 1e-300) ** 2 for errors in (before, after)]
    most = float(stdtrit(PIECES - 1, 1.0 - 0.5 * CHANCE))
    for risen in (squares[1] - squares[0], np.log(squares[1] / squares[0])):
        means = np.array([np.mean(piece) for piece in np.array_split(risen, PIECES)])
        if np.mean(means) > most * np.std(means, ddof=1) / np.sqrt(PIECES):
            return False
    return True
