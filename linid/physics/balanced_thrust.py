"""The thrust of three balanced currents, which a fit tells better than the force constant alone."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.physics.model import Model

_LEAST = 0.05  # of the force constant: they push with that, however far their phases are apart


def thrust_per_constant(model: Model, vectors: Array) -> Array:
    """Thrust per input, of three balanced ones, and per force constant (C,): what the first harmonic and the distance
    of the phases make of that. vectors: (C, VECTOR_SIZE), SI. Source: eqs. 31 and 39."""
    motor, found = model.driven_by, np.ones(vectors.shape[0])
    if motor.shape:
        found = motor.fundamental(found, {name: vectors[:, model.slot(name)] for name, _ in motor.shape})
    if motor.phases:
        balanced = motor.balanced(vectors[:, model.slot("winding_displacement")])
        found = found * np.maximum(balanced, _LEAST)
    return np.asarray(found)
