"""Force constant and field phase as length and direction of one vector, in which the thrust is linear."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.identification.signals.motion import Motion
from linid.identification.space.search_space import SearchSpace

_PROBE = 1e-3  # of a step, over which what it does to the vector is differenced


@dataclass(frozen=True)
class FieldVector:
    """The search coordinates of force constant and shift, and what a unit of each stretches or turns the vector by.

    Thrust is K cos(phase) A(t) + K sin(phase) B(t) (theta: of its first harmonic), so that a valley of equal
    cost is straight in K cos(phase) and K sin(phase), and bent in K and the phase. The phase is that at y, which the
    wavenumber turns too. y: position in m in the middle of the motion.
    """

    space: SearchSpace
    y: float
    constant: int
    shift: int
    stretch: float  # of log K per search coordinate
    turn: float  # rad per search coordinate

    def moved(self, x: Array, move: Array) -> Array:
        """Search coordinates x (n,) moved by `move`, the field's vector in a straight line; also with other unknowns
        behind."""
        out = np.asarray(x + move)
        behind, here, ahead, there = self._polar(np.array([x - _PROBE * move, x, x + _PROBE * move, out]))
        along, across = np.array([1.0, 0.0]) + (ahead - behind) / (2.0 * _PROBE)
        if along > 0.0:
            missing = here + np.array([math.log(math.hypot(along, across)), math.atan2(across, along)]) - there
            out[self.constant] += missing[0] / self.stretch
            out[self.shift] += missing[1] / self.turn
        return out

    def _polar(self, points: Array) -> Array:
        """Logarithm of the vector's length and its direction in rad (C, 2) at search coordinates (C, n)."""
        model = self.space.model
        with np.errstate(over="ignore"):  # a bent step may lead others far out of the box, to which it is clipped later
            vectors = self.space.vectors(points[:, : len(self.space.parameters)])
        motor = model.driven_by
        shape = {name: vectors[:, model.slot(name)] for name, _ in motor.shape}
        length = motor.fundamental(vectors[:, model.slot("force_constant")], shape)
        turned = self.y * vectors[:, model.slot("electrical_wavenumber")]
        direction = model.turns * (vectors[:, model.slot("commutation_offset")] + turned)
        return np.column_stack([np.log(length), direction])


def field_vector(space: SearchSpace, motions: Sequence[Motion]) -> FieldVector | None:
    """The field's vector among the search coordinates in the middle of some motions, where a wavenumber turns it by the
    least; None unless force constant (by its logarithm) and shift are searched."""
    places = {searched.name: place for place, searched in enumerate(space.parameters)}
    if (
        "force_constant" not in places
        or "commutation_offset" not in places
        or not space.parameters[places["force_constant"]].log
    ):
        return None
    constant, shift = (space.parameters[places[name]] for name in ("force_constant", "commutation_offset"))
    return FieldVector(
        space,
        float(np.mean(np.concatenate([motion.y for motion in motions]))),
        places["force_constant"],
        places["commutation_offset"],
        math.log(constant.upper / constant.lower),
        space.model.turns * (shift.upper - shift.lower),
    )
