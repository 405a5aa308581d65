"""Start positions and speeds of free runs, fitted where all else is given."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.problem import OFFSET_STEP


def fit_start_offsets(part: FreeRun, vector: Array, rounds: int = 3) -> Array:
    """Start offsets (1, 2 R) that bring free runs with a given parameter vector (1, VECTOR_SIZE) nearest to data."""
    offsets = np.zeros((1, part.nuisances))
    edges = part.simulator.inputs.sample_offsets
    for _ in range(rounds):
        shifted = np.repeat(offsets, 3, axis=0)
        shifted[1, 0::2] += OFFSET_STEP
        shifted[2, 1::2] += OFFSET_STEP
        rows = part.residuals(np.repeat(vector, 3, axis=0), shifted)
        if not np.all(np.isfinite(rows)):
            break
        for index in range(len(part.recordings)):
            a, b = edges[index], edges[index + 1]
            columns = (rows[1:, a:b] - rows[0, a:b]).T / OFFSET_STEP
            offsets[0, 2 * index : 2 * index + 2] -= np.linalg.lstsq(columns, rows[0, a:b], rcond=None)[0]
    return offsets
