"""Currents that voltages drive through windings along a measured motion."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.physics.electrical import WINDING_CODES
from linid.physics.model import Model
from linid.simulation.compiled import load_kernel
from linid.simulation.course import Candidates
from linid.simulation.inputs import Inputs


def currents_along(model: Model, params: Array, inputs: Inputs, y: Array, v: Array, start: Array) -> Array:
    """Currents (C, 3, samples) in A of C candidates, exact for voltages that are parabolas between half samples.

    model: with windings; params: (C, VECTOR_SIZE) SI; inputs: packed with their voltages; y, v: (samples,) measured
    motion in m and m/s; start: (R, 3) A at the recordings' first samples. Effects are left out.
    """
    out = np.zeros((params.shape[0], 3, y.size))
    candidates = Candidates(np.ascontiguousarray(params), model.motor, 0, WINDING_CODES[model.winding])
    load_kernel(None, True, True).current_tasks(candidates, inputs, y, v, np.ascontiguousarray(start), out)
    return out
