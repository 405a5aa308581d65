"""Force constant and field phase as length and direction of one vector, in which the thrust is linear."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.identification.space.search_space import SearchSpace


@dataclass(frozen=True)
class FieldVector:
    """The search coordinates of force constant and shift, and what a unit of each turns or stretches the vector by.

    Thrust is K cos(phase) A(t) + K sin(phase) B(t) (theta: of its first harmonic), so that a valley of equal
    cost is straight in K cos(phase) and K sin(phase), and bent in K and the phase.
    """

    constant: int
    shift: int
    stretch: float  # of log K per search coordinate
    turn: float  # rad per search coordinate

    def moved(self, x: Array, move: Array) -> Array:
        """Search coordinates x (n,) moved by `move`, the field's vector in a straight line; also with other unknowns
        behind."""
        out = np.asarray(x + move)
        along = 1.0 + self.stretch * float(move[self.constant])
        across = self.turn * float(move[self.shift])
        if along > 0.0:
            out[self.constant] = x[self.constant] + math.log(math.hypot(along, across)) / self.stretch
            out[self.shift] = x[self.shift] + math.atan2(across, along) / self.turn
        return out


def field_vector(space: SearchSpace) -> FieldVector | None:
    """The field's vector among the search coordinates; None unless force constant (by its logarithm) and shift are
    searched."""
    places = {searched.name: place for place, searched in enumerate(space.parameters)}
    if (
        "force_constant" not in places
        or "commutation_offset" not in places
        or not space.parameters[places["force_constant"]].log
    ):
        return None
    constant, shift = (space.parameters[places[name]] for name in ("force_constant", "commutation_offset"))
    return FieldVector(
        places["force_constant"],
        places["commutation_offset"],
        math.log(constant.upper / constant.lower),
        space.model.turns * (shift.upper - shift.lower),
    )
