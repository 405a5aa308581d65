"""The flat parameter vector that every compiled function reads: friction, mass, motor, windings, then all effects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from linid.errors import UsageError
from linid.physics import electrical, friction
from linid.physics.effects.registry import EFFECTS, active_mask, find_effect
from linid.physics.laws.law import MOST_OWN
from linid.physics.laws.registry import LAWS, LUGRE, MOST_ELEMENTS, find_law
from linid.physics.motors.motor import Motor
from linid.physics.motors.registry import MOTORS
from linid.physics.parameter import Parameter

MOTOR_START = len(friction.PARAMETERS)
MOTOR_SIZE = max(len(motor.parameters) for motor in MOTORS.values())
WINDING_START = MOTOR_START + MOTOR_SIZE
WINDING_SIZE = 3
LAW_START = WINDING_START + WINDING_SIZE
EFFECT_START = LAW_START + MOST_OWN
MASS = MOTOR_START - 1


def _effect_slots() -> dict[str, int]:
    slots: dict[str, int] = {}
    position = EFFECT_START
    for effect in EFFECTS:
        for parameter in effect.parameters:
            slots[parameter.name] = position
            position += 1
    return slots


EFFECT_SLOTS = _effect_slots()
VECTOR_SIZE = EFFECT_START + len(EFFECT_SLOTS)

# While a simulation with effects runs, its copy of the vector also holds the number of the recording, the campaign's
# running time at t = 0, the hidden states, and the hidden states at the start of the step.
RECORD = VECTOR_SIZE
ELAPSED = VECTOR_SIZE + 1
STATE_START = VECTOR_SIZE + 2


def _state_places() -> dict[str, int]:
    places: dict[str, int] = {}
    position = 0
    for effect in EFFECTS:
        if effect.states:
            places[effect.name] = position
            position += effect.states
    return places


STATE_PLACES = _state_places()
STATE_SIZE = sum(effect.states for effect in EFFECTS)
# Behind both, deflections of the friction law's elements: no start of a step need be kept of them.
ELEMENT_START = STATE_START + 2 * STATE_SIZE
WORK_SIZE = ELEMENT_START + MOST_ELEMENTS


@dataclass(frozen=True)
class Model:
    """Which motor and effects act: kind: a motor by name, or friction (free wheels only).

    winding: star or separate for a motor driven by phase voltages, empty for one driven by its currents; law: of
    friction, by name.
    """

    kind: str
    effects: tuple[str, ...] = ()
    winding: str = ""
    law: str = LUGRE
    mask: int = field(init=False)

    def __post_init__(self) -> None:
        if self.kind not in MOTORS:
            kinds = ", ".join(MOTORS)
            raise UsageError("--model", f"there is no model {self.kind!r}", f"Choose one of {kinds}")
        if self.winding not in electrical.PARAMETERS or (self.winding and not self.driven_by.periodic):
            raise UsageError(
                f"{self.kind} model",
                f"cannot be driven by voltages of {self.winding!r} windings",
                "Take a model with phases, such as sine, with star or separate windings.",
            )
        if self.winding and find_law(self.law).steps != LUGRE:
            raise UsageError(
                f"{self.law} friction",
                "is not simulated together with the windings of a motor",
                "Take lugre or coulomb, or leave the windings out.",
            )
        object.__setattr__(self, "mask", active_mask(self.effects))

    @property
    def driven_by(self) -> Motor:
        """The motor."""
        return MOTORS[self.kind]

    @property
    def motor(self) -> int:
        """The motor's code in the compiled kernel."""
        return list(MOTORS).index(self.kind)

    @property
    def phases(self) -> bool:
        """Whether three phase currents drive the motor."""
        return self.driven_by.phases

    @property
    def single(self) -> bool:
        """Whether one logged current or command drives the motor."""
        return self.driven_by.inputs == 1

    @property
    def turns(self) -> float:
        """Electrical radians per radian of the motor's own angles."""
        return self.driven_by.turns

    @property
    def friction(self) -> tuple[Parameter, ...]:
        """The parameters of friction and mass."""
        law = find_law(self.law)
        return tuple(p for p in friction.PARAMETERS if p.name not in law.absent) + law.own

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters of friction, motor and active effects, in table order."""
        active = tuple(p for name in self.effects for p in find_effect(name).parameters_of(self.kind))
        return self.driven_by.parameters + electrical.PARAMETERS[self.winding] + self.friction + active

    def with_effects(self, effects: Iterable[str]) -> Model:
        """The same motor and friction law with these effects."""
        return replace(self, effects=tuple(effects))

    @property
    def states(self) -> tuple[int, ...]:
        """Places of the hidden states of effects and friction law, counted from STATE_START."""
        own = tuple(
            start + k
            for name, start in STATE_PLACES.items()
            if name in self.effects
            for k in range(find_effect(name).states)
        )
        return own + tuple(ELEMENT_START - STATE_START + k for k in range(LAWS[self.law].elements))

    def slot(self, name: str) -> int:
        """Where parameter `name` stands in the flat vector; KeyError if the model has none."""
        for index, parameter in enumerate(friction.PARAMETERS):
            if parameter.name == name:
                return index
        for index, parameter in enumerate(self.driven_by.parameters):
            if parameter.name == name:
                return MOTOR_START + index
        for index, parameter in enumerate(electrical.PARAMETERS[self.winding]):
            if parameter.name == name:
                return WINDING_START + index
        for index, parameter in enumerate(LAWS[self.law].own):
            if parameter.name == name:
                return LAW_START + index
        return EFFECT_SLOTS[name]

    def tie(self, vectors: NDArray[np.float64]) -> None:
        """Set in flat vectors (C, VECTOR_SIZE), in place, what the friction law ties to other parameters."""
        tied = LAWS[self.law].tie
        if tied is not None:
            tied(vectors)

    def vector(self, values: dict[str, float]) -> NDArray[np.float64]:
        """The flat vector (VECTOR_SIZE,) of SI values; parameters not given take their default."""
        vector = np.zeros(VECTOR_SIZE)
        for parameter in self.parameters:
            vector[self.slot(parameter.name)] = values.get(parameter.name, parameter.default)
        self.tie(vector[None, :])
        return vector
