"""The internal step of the simulation: chosen from the data, checked by halving it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from linid.identification.objectives.ahead import Ahead
from linid.identification.signals.motion import measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording

# Field phase passed within one internal step, rad; keeps the error of 4 s runs near a micrometre.
_PHASE_PER_STEP = 0.15


def choose_substeps(model: Model, recordings: Sequence[Recording], first: dict[str, float]) -> int:
    """Internal steps per sample, 2 to 32, so that the field phase turns little within one step."""
    density = first.get("electrical_wavenumber", 0.0) * model.turns
    motion = measure_motion(recordings)
    speed = float(np.quantile(np.abs(motion.v), 0.999))
    period = max(r.period for r in recordings)
    return int(min(max(2, math.ceil(density * speed * period / _PHASE_PER_STEP)), 32))


def step_halving_error(
    model: Model, recordings: Sequence[Recording], vector: NDArray[np.float64], substeps: int, jobs: int
) -> float:
    """RMS change in m (rotary: rad) of the 0.1 s predictions when the internal step is halved. vector: (VECTOR_SIZE,),
    SI.
    """
    one = Ahead(model, tuple(recordings), substeps, jobs).simulate(vector)
    two = Ahead(model, tuple(recordings), 2 * substeps, jobs).simulate(vector)
    return float(np.sqrt(np.nanmean((one - two) ** 2)))
