"""The flat parameter vector that every compiled function reads: friction, mass, motor, windings, then all effects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from linid.errors import ConfigError, UsageError
from linid.physics import electrical, friction
from linid.physics.effects.registry import EFFECTS, active_mask, canonical, find_effect
from linid.physics.laws.law import MOST_OWN
from linid.physics.laws.registry import LAWS, LUGRE, MOST_ELEMENTS, find_law
from linid.physics.motors.motor import Motor
from linid.physics.motors.registry import MOTORS
from linid.physics.own_terms import layout as own_layout
from linid.physics.own_terms.own_term import is_own
from linid.physics.own_terms.program import program_of
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

# Programs and parameters of own terms; the vector of a model that has none ends before.
OWN_START = VECTOR_SIZE

# While a simulation with effects runs, its copy of the vector also holds the number of the recording, the campaign's
# running time at t = 0, the added mass in kg, the hidden states, and the hidden states at the start of the step; behind
# them the variables of own terms, and the stack of their programs.
RECORD = OWN_START + own_layout.SIZE
ELAPSED = RECORD + 1
ADDED_MASS = RECORD + 2
STATE_START = RECORD + 3


def _state_places() -> dict[str, int]:
    places: dict[str, int] = {}
    position = 0
    for effect in EFFECTS:
        if effect.states:
            places[effect.name] = position
            position += effect.states
    return places


STATE_PLACES = _state_places()
MEMORY_PLACE = sum(effect.states for effect in EFFECTS)  # of own terms' memory among all hidden states
STATE_SIZE = MEMORY_PLACE + len(own_layout.MEMORY)
# Deflections of the friction law's elements, of which no start of a step need be kept.
ELEMENT_START = STATE_START + 2 * STATE_SIZE
OWN_VARIABLES = ELEMENT_START + MOST_ELEMENTS
OWN_STACK = OWN_VARIABLES + len(own_layout.VARIABLES)
WORK_SIZE = OWN_STACK + own_layout.STACK


def _states_of(names: Iterable[str]) -> tuple[int, ...]:
    """Places of the hidden states of effects, counted from STATE_START."""
    return tuple(STATE_PLACES[name] + k for name in names for k in range(find_effect(name).states))


@lru_cache(maxsize=256)
def own_places(effects: tuple[str, ...]) -> tuple[dict[str, int], NDArray[np.float64]]:
    """Where the parameters of own terms stand in the flat vector, and what else it holds for them: heads and programs
    (SIZE,), in the units of the formulas.

    effects: names of a model's effects. Raises ConfigError where they need more room than there is. Source: linid's own
    form.
    """
    image = np.zeros(own_layout.SIZE)
    places: dict[str, int] = {}
    end = own_layout.TERMS * own_layout.HEAD
    terms = [find_effect(name).own for name in dict.fromkeys(effects) if is_own(name)]
    for number, term in enumerate(terms):
        local = {name: OWN_VARIABLES + k for k, name in enumerate(own_layout.VARIABLES)}
        local |= {name: OWN_START + end + k for k, name in enumerate(term.parameters)}
        places |= {f"{term.name}_{name}": local[name] for name in term.parameters}
        end += len(term.parameters)
        for part, friction_level in enumerate((False, True)):
            tree = term.part(friction_level)
            program = [] if tree is None else program_of(tree, local)
            if end + len(program) > image.size:
                raise ConfigError(
                    f"effect {term.name!r}",
                    f"own terms take more than {own_layout.POOL} numbers (parameters, and about two per operation)",
                    "Shorten the formulas, or give their curves fewer coefficients.",
                )
            image[end : end + len(program)] = program
            head = own_layout.HEAD * number + 2 * part
            image[head : head + 2] = OWN_START + end, OWN_START + end + len(program)
            end += len(program)
    return places, image


@lru_cache(maxsize=256)  # asked for with every vector of a fit, as what follows
def _parameters(model: Model) -> tuple[Parameter, ...]:
    active = tuple(p for name in model.effects for p in find_effect(name).parameters_of(model.kind))
    return model.driven_by.parameters + electrical.PARAMETERS[model.winding] + model.friction + active


@lru_cache(maxsize=256)
def _defaults(model: Model) -> tuple[tuple[str, float], ...]:
    return tuple((p.name, p.default) for p in model.parameters)


@lru_cache(maxsize=256)
def _slots(model: Model) -> dict[str, int]:
    """Where all parameters stand in the flat vector, of those too that mean nothing for this motor."""
    ends = (LAW_START, LAWS[model.law].own), (WINDING_START, electrical.PARAMETERS[model.winding])
    starts = (*ends, (MOTOR_START, model.driven_by.parameters), (0, friction.PARAMETERS))
    own = own_places(model.effects)[0] if any(map(is_own, model.effects)) else {}
    return own | EFFECT_SLOTS | {p.name: start + k for start, some in starts for k, p in enumerate(some)}


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
        object.__setattr__(self, "effects", canonical(self.effects))
        object.__setattr__(self, "mask", active_mask(self.effects))
        if any(map(is_own, self.effects)):
            own_places(self.effects)

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
        return _parameters(self)

    def with_effects(self, effects: Iterable[str]) -> Model:
        """The same motor and friction law with these effects."""
        return replace(self, effects=tuple(effects))

    @property
    def effect_states(self) -> tuple[int, ...]:
        """Places of the hidden states of effects and own terms, counted from STATE_START."""
        memory = tuple(range(MEMORY_PLACE, STATE_SIZE)) if self.mask & own_layout.MEMORY_BIT else ()
        return _states_of(name for name in STATE_PLACES if name in self.effects) + memory

    @property
    def untold_states(self) -> tuple[int, ...]:
        """Those of them that a measured motion does not tell, such as how a load swings."""
        return _states_of(name for name in STATE_PLACES if name in self.effects and not find_effect(name).told)

    @property
    def states(self) -> tuple[int, ...]:
        """Those places, and behind them those of the friction law's elements."""
        elements = range(LAWS[self.law].elements)
        return self.effect_states + tuple(ELEMENT_START - STATE_START + k for k in elements)

    @property
    def size(self) -> int:
        """Length of its flat vector: VECTOR_SIZE, and more with own terms."""
        return VECTOR_SIZE + (own_layout.SIZE if any(map(is_own, self.effects)) else 0)

    def slot(self, name: str) -> int:
        """Where parameter `name` stands in the flat vector; KeyError if the model has none."""
        return _slots(self)[name]

    def tie(self, vectors: NDArray[np.float64]) -> None:
        """Set in flat vectors (C, size), in place, what the friction law ties to other parameters."""
        tied = LAWS[self.law].tie
        if tied is not None:
            tied(vectors)

    def vector(self, values: dict[str, float]) -> NDArray[np.float64]:
        """The flat vector (size,) of SI values; parameters not given take their default."""
        vector = np.zeros(self.size)
        if vector.size > VECTOR_SIZE:
            vector[OWN_START:] = own_places(self.effects)[1]
        slots = _slots(self)
        for name, default in _defaults(self):
            vector[slots[name]] = values.get(name, default)
        self.tie(vector[None, :])
        return vector
