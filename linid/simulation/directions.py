"""What directions in a model's parameters change: which effects, and which parameters say nothing."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array, Integers
from linid.physics.effects.registry import active_mask, find_effect
from linid.physics.model import EFFECT_START, MASS, MOTOR_START, Model
from linid.physics.own_terms.layout import ACCELERATION_BIT, STRIBECK_BIT

# Places of what the Stribeck curve hangs on, and a balance of forces: viscous friction and mass too.
_CURVE, _BALANCE = (0, 1, 2, 3), (0, 1, 2, 3, MASS - 1, MASS)
_OF_MOTOR = {"delay", "drive", "field", "thrust"}  # terms that only a motor with inputs shows


def touched_by(model: Model, tangents: Array) -> Integers:
    """The bits of the effects and own terms whose parameters directions change, (K,).

    tangents: (K, VECTOR_SIZE), each in parameters' SI units per unit of its own.
    """
    touched = np.zeros(len(tangents), dtype=np.int64)
    for name in model.effects:
        places = [model.slot(parameter.name) for parameter in find_effect(name).parameters]
        bits = active_mask((name,))
        for bit, also in ((STRIBECK_BIT, _CURVE), (ACCELERATION_BIT, _BALANCE)):
            places += also if bits & bit else ()  # what an own term hangs on besides
        touched[np.any(tangents[:, places] != 0.0, axis=1)] |= bits
    return touched


def silent_places(model: Model) -> list[int]:
    """Places of parameters that say nothing without inputs: those of the motor, and of effects on inputs, field and
    thrust alone."""
    silent = list(range(MOTOR_START, EFFECT_START))
    for effect in map(find_effect, model.effects):
        if effect.own is None and effect.terms.keys() <= _OF_MOTOR:
            silent += [model.slot(parameter.name) for parameter in effect.parameters]
    return silent
