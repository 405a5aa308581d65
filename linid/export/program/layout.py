"""Where the numbers of an exported model stand: the simulation's flat vector, in arrays that hold what is needed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from linid.arrays import Array
from linid.export.translate import fold
from linid.export.translate.tree import Element, Expression, Number, Operation
from linid.export.translate.values import Known, Running, Value, expression_of
from linid.physics import friction
from linid.physics import model as places
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.laws.registry import MOST_ELEMENTS
from linid.physics.model import Model
from linid.physics.own_terms import layout as own_layout
from linid.physics.own_terms.own_term import is_own
from linid.physics.parameter import Parameter

# Behind the vector of a simulation: number of harmonics, their first wavenumber (rad/m) and phase (rad), and how many
# intervals the inputs' coefficients hold.
HARMONICS, WAVENUMBER, PHASE, INTERVALS = range(places.WORK_SIZE, places.WORK_SIZE + 4)
_NAMES = {
    HARMONICS: "harmonics",
    WAVENUMBER: "first_wavenumber",
    PHASE: "first_phase",
    INTERVALS: "intervals",
    places.RECORD: "record",
    places.ELAPSED: "elapsed",
    places.ADDED_MASS: "added_mass",
}


@dataclass(frozen=True)
class Slot:
    """A parameter of an exported model. name: of linid, in snake case; value: SI; unit: on its kind of axis; place: in
    the flat vector."""

    name: str
    unit: str
    value: float
    meaning: str
    place: int


def parameters_of(model: Model, vector: Array, axis: str) -> tuple[Slot, ...]:
    """All parameters that a model reads, those that its friction law ties to others among them; vector: (size,) SI."""
    chosen: list[tuple[Parameter, str]] = [(p, p.name) for p in model.parameters]
    known = {name for _, name in chosen}
    chosen += [(p, p.name) for p in friction.PARAMETERS if p.name not in known]
    out = []
    for parameter, name in chosen:
        place = model.slot(name)
        out.append(Slot(name, parameter.unit_on(axis), float(vector[place]), parameter.meaning, place))
    return tuple(out)


def _state_names(model: Model) -> dict[int, str]:
    """What a simulation changes, by place: hidden states, also as a step began, elements, own terms' numbers."""
    names = dict(_NAMES)
    states: dict[int, str] = {}
    for effect in EFFECTS:
        for k in range(effect.states if effect.name in model.effects else 0):
            states[places.STATE_PLACES[effect.name] + k] = f"{effect.name}_{k + 1}"
    if any(map(is_own, model.effects)):
        states |= {places.MEMORY_PLACE + k: f"memory_{name}" for k, name in enumerate(own_layout.MEMORY)}
        names |= {places.OWN_VARIABLES + k: f"own_{name}" for k, name in enumerate(own_layout.VARIABLES)}
        names |= {places.OWN_STACK + k: f"stack_{k}" for k in range(own_layout.STACK)}
    for place, name in states.items():
        names[places.STATE_START + place] = name
        names[places.STATE_START + places.STATE_SIZE + place] = f"{name}_before"
    for k in range(MOST_ELEMENTS):
        names[places.ELEMENT_START + k] = f"element_{k + 1}"
    return names


@dataclass
class ModelMemory:
    """The memory of one model: `p` its parameters, `own` those of own terms, `s` what changes, `table` of the motor's
    harmonics, `c` the inputs' coefficients.

    vector: (size,) SI, as the simulation takes it; used: labels in `s` that something has asked for, in order.
    """

    model: Model
    slots: tuple[Slot, ...]
    vector: Array
    used: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._states = _state_names(self.model)
        names = {n for e in map(find_effect, self.model.effects) if e.own is not None for n in own_names(e)}
        self.own = tuple(slot for slot in self.slots if slot.name in names)
        self.plain = tuple(slot for slot in self.slots if slot.name not in names)
        self._places = {slot.place: ("p", k, slot.name) for k, slot in enumerate(self.plain)}
        self._places |= {slot.place: ("own", k, slot.name) for k, slot in enumerate(self.own)}
        self._own_start = self.own[0].place if self.own else 0

    def read(self, array: str, index: Value) -> Value:
        """An element of the arrays that the simulation's functions see; those that are known are numbers."""
        if array != "p":
            return Running(Element(array, expression_of(index)))
        if not isinstance(index, Known):  # only coefficients of own terms are read at places that are not known
            return Running(Element("own", self._own_place(expression_of(index))))
        place = int(index.value)
        if place in self._places:
            name, k, label = self._places[place]
            return Running(Element(name, Number(k, "int"), label))
        if place in self._states:
            return Running(self._state(place))
        return Known(float(self.vector[place]) if place < self.vector.size else 0.0)

    def place(self, array: str, index: Value) -> Element | None:
        """Where a new value goes; None for states of effects that the model has not."""
        if array != "p":
            return Element(array, expression_of(index))
        place = int(index.value)  # type: ignore[union-attr]  # nothing is stored at a place that is not known
        return self._state(place) if place in self._states else None

    def _state(self, place: int) -> Element:
        label = self._states[place]
        number = self.used.setdefault(label, len(self.used))
        return Element("s", Number(number, "int"), label)

    def _own_place(self, index: Expression) -> Expression:
        shifted = fold.binary("-", Running(index), Known(self._own_start))
        return _gathered(expression_of(shifted))

    def label_of(self, place: int) -> str:
        """The name of a changing number by its place in the simulation's vector."""
        return self._state(place).label


def own_names(effect: object) -> list[str]:
    """Names of the parameters of an own term's effect."""
    return [parameter.name for parameter in effect.parameters]  # type: ignore[attr-defined]


def _gathered(index: Expression) -> Expression:
    """a + j - b with known a and b as j + (a - b)."""
    total, rest = 0, index
    while isinstance(rest, Operation) and rest.name in ("+", "-"):
        left, right = rest.arguments
        if isinstance(right, Number):
            total += int(right.value) * (1 if rest.name == "+" else -1)
            rest = left
        elif rest.name == "+" and isinstance(left, Number):
            total += int(left.value)
            rest = right
        else:
            break
    if total == 0:
        return rest
    return Operation("+" if total > 0 else "-", (rest, Number(abs(total), "int")), "int")


def word(name: str) -> str:
    """A parameter's name as every language takes it."""
    return re.sub(r"\W", "_", name)
