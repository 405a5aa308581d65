"""What an effect is: compiled terms of the equations of motion with their parameters, all in one file.

Every term is a function decorated with `term` and takes the same arguments:

    (t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2 ..., *parameters)

t: time of the recording in s; y: position in m; v: speed in m/s; i_1, i_2, i_3: inputs in A (a `force` motor has
only i_1, and 0); record: number of the recording in its campaign (float, from 1; 0: none); elapsed: running time of
the campaign in s; s_1, s_2 ...: the effect's own hidden states, as many as its `advance` takes (without one, terms need
take none); parameters: in the order of `Effect.parameters`, SI. Inputs are the logged ones (after `delay`); `field`,
`thrust` and `force` get what the `drive` terms made of them. `load` takes the motor's force first, in N, with all that
`drive`, `field` and `thrust` do to it.
"""

from __future__ import annotations

import dis
import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from linid.physics.motors.registry import MOTORS as ALL_MOTORS
from linid.physics.parameter import Parameter
from linid.physics.term import term as term  # for the effects
from linid.physics.well_formed import fault_of_arguments, well_formed

Slot = Literal["DRIVE", "FORCE", "SENSOR"]
Acts = Literal["all", "one", "some"]
Values = dict[str, float]

COMMON_ARGUMENTS = ("t", "y", "v", "i_1", "i_2", "i_3", "record", "elapsed")
STATELESS = ("delay", "mass", "static")  # terms that get no hidden states
TERM_ARGUMENTS: dict[str, tuple[str, ...]] = {
    "delay": (),
    "drive": COMMON_ARGUMENTS,
    "field": COMMON_ARGUMENTS,
    "thrust": COMMON_ARGUMENTS,
    "force": COMMON_ARGUMENTS,
    "friction": COMMON_ARGUMENTS,
    "level": COMMON_ARGUMENTS,
    "load": ("push", *COMMON_ARGUMENTS),
    "mass": ("record",),
    "static": (),
    "sensor": COMMON_ARGUMENTS,
    "initial": COMMON_ARGUMENTS,
    "advance": ("h", "t", "y", "v", "a", *COMMON_ARGUMENTS[3:]),
}
# What a missing force may depend on, in words.
ARGUMENTS = {
    "position": "position",
    "velocity": "velocity",
    "direction": "direction of motion",
    "motor_force": "motor force",
    "acceleration": "acceleration",
    "travel": "travel since the last reversal",
    "since_reversal": "time since the last reversal",
    "rest_time": "rest before the breakaway",
    "time": "time in the recording",
    "campaign_time": "time in the campaign",
    "recording": "recording",
}
INPUTS = ("i_1", "i_2", "i_3")
PHASE_MOTORS = tuple(name for name, motor in ALL_MOTORS.items() if motor.phases)
MOTORS = tuple(name for name, motor in ALL_MOTORS.items() if motor.inputs)
ALL_KINDS = tuple(ALL_MOTORS)


@dataclass(frozen=True)
class Outlook:
    """What the recordings at hand look like: the scales from which effects take their starting values.

    stroke_low, stroke_high: m (rotary: rad); field_wavenumber: of the motor's field (pi / pole pitch) in rad/m, None
    without a phase motor; top_speed: m/s; top_current: A; durations: s and records: numbers, one per recording;
    period: sampling period in s; campaign_duration: running time of the whole campaign in s; axis: linear or
    rotary; visited: edges (m) of equal shares of all the places that the recordings visit, empty: of the stroke.
    """

    stroke_low: float
    stroke_high: float
    field_wavenumber: float | None
    top_speed: float
    top_current: float
    durations: tuple[float, ...]
    records: tuple[int, ...]
    period: float
    campaign_duration: float = 0.0
    axis: str = "linear"
    visited: tuple[float, ...] = ()

    @property
    def stroke(self) -> float:
        """Length of the stroke in m."""
        return self.stroke_high - self.stroke_low

    def place(self, share: float) -> float:
        """Position in m up to which a share (0 to 1) of all visited places lies."""
        edges = self.visited or (self.stroke_low, self.stroke_high)
        at = min(max(share, 0.0), 1.0) * (len(edges) - 1)
        left = min(int(at), len(edges) - 2)
        return edges[left] + (at - left) * (edges[left + 1] - edges[left])


def no_grid(outlook: Outlook) -> tuple[Values, ...]:
    """The grid of an effect that has only amplitudes."""
    return ({},)


def no_most(values: Values) -> Values:
    """The upper bounds of an effect whose parameters hang on nothing."""
    return {}


@dataclass(frozen=True)
class Effect:
    """One physical effect. Terms that are None do nothing; those given are compiled (`@term`).

    delay(*parameters) -> s by which the inputs act late; drive -> (i_1, i_2, i_3) that the motor really gets; field ->
    position in m that the motor's field sees; thrust -> factor on the motor force; friction -> factor on the whole
    bristle force, stiffness included; level -> factor on the sliding and breakaway friction alone; load(push, ...) -> N
    added to these two before that factor; force -> N on the mass; mass(record, *parameters) -> kg added to the moving
    mass; static(*parameters) -> N added to the static force, which stays above F_C; sensor -> reading error in m;
    initial -> (s_1, ...) at the start (default 0); advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, ...,
    *parameters) -> (s_1, ...) after h seconds, where t, y, v, i are those of the middle of the step and a (m/s^2) is
    its mean acceleration.

    amplitudes: parameters that enter (nearly) linearly; the effect is absent where all are 0, their default.
    preset: parameters that are never searched but set by whoever fits. phase_only: parameters that exist only
    with three phase currents, single_only: only without. orders: preset parameters, one per pair of
    amplitudes (sine, cosine), that are chosen one after the other by what they explain where there are no phase
    currents; the grid then holds the candidates for the first. period: the parameter that is a period in position of
    a reading error, sought in the residual besides the grid. kinds: motors that the effect makes sense with.
    grid(outlook) -> starting values of all parameters but the amplitudes, the likeliest first; an empty grid: nothing
    to be seen in such recordings. most(values) -> upper bounds of parameters that hang on preset ones, SI.
    acts: in all recordings, in one or in some; mark: the preset parameter that says in which: of one its number, of
    some the sum of 2^(number - 1). parts: how often the effect can occur, each time with parameters of its own, whose
    names end in _1, _2 ...; `mark` is that of part 1, and so are all values of the grid.
    depends_on: what the force that lacks without the effect depends on, names of `ARGUMENTS` with the main one
    first; of several honest answers the most usual first; (): not said.
    changes: the base parameter of which it is another value where it acts in all recordings; effects that are nothing
    else (`acts` all) are sought beside a given model only, since a base that is identified has them itself.
    physics: one line; exposed_by: the recording that shows it; confused_with: effects that look alike;
    includes: effects that this one is with some parameters at zero; play: the parameter, one of the amplitudes, that is
    play between motor and reading, so that waits of the reading tell how the motor moves; told: the measured motion and
    the inputs tell its hidden states, noisy as they are: predictions start from these; own: the term of a formula
    (own_terms/own_term.py), which takes the place of compiled ones.
    """

    name: str
    slot: Slot
    physics: str
    parameters: tuple[Parameter, ...]
    amplitudes: tuple[str, ...]
    exposed_by: str
    depends_on: tuple[tuple[str, ...], ...] = ()
    confused_with: tuple[str, ...] = ()
    includes: tuple[str, ...] = ()
    changes: str = ""
    preset: tuple[str, ...] = ()
    phase_only: tuple[str, ...] = ()
    single_only: tuple[str, ...] = ()
    orders: tuple[str, ...] = ()
    period: str = ""
    acts: Acts = "all"
    mark: str = ""
    parts: int = 1
    kinds: tuple[str, ...] = ALL_KINDS
    grid: Callable[[Outlook], tuple[Values, ...]] = no_grid
    most: Callable[[Values], Values] = no_most
    delay: Any = None
    drive: Any = None
    field: Any = None
    thrust: Any = None
    force: Any = None
    friction: Any = None
    level: Any = None
    load: Any = None
    mass: Any = None
    static: Any = None
    sensor: Any = None
    initial: Any = None
    advance: Any = None
    told: bool = False
    play: str = ""
    own: Any = None

    @property
    def short(self) -> str:
        """Its name alone, where `name` is the text of an own term."""
        return self.name if self.own is None else str(self.own.name)

    @property
    def terms(self) -> dict[str, Any]:
        """The terms that this effect has, by name."""
        return {name: getattr(self, name) for name in TERM_ARGUMENTS if getattr(self, name) is not None}

    @property
    def states(self) -> int:
        """Number of its hidden states."""
        return 0 if self.advance is None else self.states_of("advance")

    def states_of(self, term: str) -> int:
        """Number of hidden states that one of its terms takes, all of them or none."""
        return _states_in(getattr(self, term).py_func)

    @property
    def pushes_by_speed(self) -> bool:
        """Whether what it does to the forces on the mass hangs on the speed."""
        if self.own is not None:
            return bool(self.own.variables & {"v", "acceleration", "stribeck"})
        return self.reads(("thrust", "force"), "v")

    @property
    def pushes_by_inputs(self) -> bool:
        """Whether what it does to the forces on the mass hangs on what the motor gets, beside the motor's force."""
        return self.own is None and self.reads(("thrust", "force"), *INPUTS)

    def reads(self, terms: Iterable[str], *arguments: str) -> bool:
        """Whether one of these terms, so far as it has them, reads one of these arguments."""
        asked = [self.terms[name].py_func for name in terms if name in self.terms]
        return any(_used(function) & set(arguments) for function in asked)

    def states_are_driven_by(self, argument: str) -> bool:
        """Whether its hidden states go on as the position "y", the speed "v" or the acceleration "a" has it."""
        return self.reads(("advance",), argument)

    def arguments_of(self, term: str) -> tuple[str, ...]:
        """The arguments of one of its terms, before the parameters."""
        return TERM_ARGUMENTS[term] + tuple(f"s_{k}" for k in range(1, self.states_of(term) + 1))

    def parameters_of(self, kind: str) -> tuple[Parameter, ...]:
        """The parameters that mean something for a motor model of this kind."""
        absent = self.single_only if kind in PHASE_MOTORS else self.phase_only
        return tuple(p for p in self.parameters if p.name not in absent)

    def amplitudes_of(self, kind: str) -> tuple[str, ...]:
        """The amplitudes that mean something for a motor model of this kind."""
        return tuple(p.name for p in self.parameters_of(kind) if p.name in self.amplitudes)

    @property
    def per_recording(self) -> bool:
        """Whether it acts in single recordings only."""
        return self.acts != "all"

    @property
    def of_given_models(self) -> bool:
        """Whether it is sought beside a given model only."""
        return bool(self.changes) and not self.per_recording

    def range_about(self, parameter: Parameter, first: float, values: Values) -> tuple[float, float]:
        """Search range, low and high in SI, of a parameter that is no amplitude.

        first: its first value, SI; values: SI by name, with the preset ones. Source: linid's own, `reach` and `most`.
        """
        low, high, reach = parameter.lower, parameter.upper, parameter.reach
        if reach > 0.0:
            low, high = (first / reach, first * reach) if parameter.log else (first - reach, first + reach)
        most = self.most(values).get(parameter.name, high)
        if high <= most:
            return low, high
        return (min(low, most / max(reach, 2.0)) if parameter.log else low), most

    def acts_in(self, values: Values, number: int) -> bool:
        """Whether it acts in recording `number` (from 1) with these values; amplitudes that are not given count."""
        if not self.per_recording:
            return True
        for k in range(1, self.parts + 1):
            mark = int(values.get(self._in_part(self.mark, k), 0.0))
            marked = number == mark if self.acts == "one" else number >= 1 and mark >> (number - 1) & 1
            if number >= 1 and marked and any(values.get(name, 1.0) for name in self.amplitudes_of_part(k)):
                return True
        return False

    def part(self, k: int) -> tuple[Parameter, ...]:
        """The parameters of part k, from 1; all, where the effect has but one part."""
        return self.parameters if self.parts == 1 else tuple(p for p in self.parameters if p.name.endswith(f"_{k}"))

    def amplitudes_of_part(self, k: int) -> tuple[str, ...]:
        """The amplitudes of part k, from 1."""
        return tuple(p.name for p in self.part(k) if p.name in self.amplitudes)

    def moved(self, values: Values, k: int) -> Values:
        """The values of part 1, such as those of a grid's entry, as values of part k."""
        return {self._in_part(name, k): value for name, value in values.items()}

    def free_part(self, values: Values) -> int:
        """The first part that acts nowhere yet with these values, from 1; 0: none is left."""
        marks = [values.get(self._in_part(self.mark, k), 0.0) for k in range(1, self.parts + 1)] if self.mark else []
        return 1 + marks.index(0.0) if 0.0 in marks else 0

    def held(self, values: Values) -> Values:
        """What is not searched, given the values: the preset ones of them, and all of parts that act nowhere."""
        out = {p.name: values[p.name] for p in self.parameters if p.name in self.preset and p.name in values}
        for k in range(1, self.parts + 1) if self.parts > 1 else ():
            if not values.get(self._in_part(self.mark, k), 0.0):
                out |= {p.name: p.default for p in self.part(k)}
        return out

    def _in_part(self, name: str, k: int) -> str:
        """The name of a parameter of part 1 as it is in part k."""
        return name if self.parts == 1 else f"{name.removesuffix('_1')}_{k}"

    def applies(self, kind: str, outlook: Outlook) -> bool:
        """Whether the effect makes sense with such a motor and such recordings."""
        return kind in self.kinds and bool(self.grid(outlook))


def check_effect(effect: Any, place: str) -> Effect:
    """The effect itself if it is well formed; raises ConfigError that names what is not."""
    return well_formed(effect, Effect, place, _fault)


def _fault(effect: Effect) -> str:
    """What is wrong with an effect, or nothing."""
    names = [parameter.name for parameter in effect.parameters]
    if effect.slot not in ("DRIVE", "FORCE", "SENSOR"):
        return f"its slot is {effect.slot!r}, expected DRIVE, FORCE or SENSOR"
    if not effect.terms.keys() - {"initial", "advance"}:
        return "it has no term that acts on the axis"
    if effect.initial is not None and effect.advance is None:
        return "it has `initial` but no `advance`"
    for listed in ("amplitudes", "preset", "phase_only", "single_only", "orders"):
        strange = sorted(set(getattr(effect, listed)) - set(names))
        if strange:
            return f"`{listed}` names {strange[0]!r}, which is no parameter of it"
    if effect.period and effect.period not in names:
        return f"`period` names {effect.period!r}, which is no parameter of it"
    if not effect.amplitudes:
        return "`amplitudes` is empty"
    if effect.acts not in ("all", "one", "some"):
        return f"it acts in {effect.acts!r}, expected all, one or some"
    if effect.per_recording != bool(effect.mark):
        return "`mark` and `acts` do not go together: a mark says in which recordings, if not in all"
    if effect.mark and effect.mark not in effect.preset:
        return f"`mark` names {effect.mark!r}, which is not among its `preset` ones"
    if effect.parts > 1 and not effect.mark.endswith("_1"):
        return "it has several parts, but no mark of part 1"
    first = [p.name.removesuffix("_1") for p in effect.part(1)]
    equal = [f"{name}_{k}" for name in first for k in range(1, effect.parts + 1)]
    if effect.parts > 1 and sorted(names) != sorted(equal):
        return f"its parameters are not those of {effect.parts} equal parts, with names that end in _1, _2 ..."
    strange = sorted({name for answer in effect.depends_on for name in answer} - set(ARGUMENTS))
    if strange:
        return f"`depends_on` names {strange[0]!r}, expected some of {', '.join(ARGUMENTS)}"
    for parameter in effect.parameters:
        if parameter.name in effect.amplitudes and (parameter.default != 0.0 or parameter.log):
            return f"the amplitude {parameter.name!r} must have the default 0 and a linear scale"
    for name, function in effect.terms.items():
        states = effect.states_of(name)
        if effect.states and states not in ((0,) if name in STATELESS else (0, effect.states)):
            return f"its term `{name}` takes {states} hidden states, `advance` takes {effect.states}"
        fault = fault_of_arguments(name, function, (*effect.arguments_of(name), *names))
        if fault:
            return fault
    return ""


@cache  # every simulation asks
def _states_in(function: Callable[..., Any]) -> int:
    """Number of arguments that are hidden states."""
    names = inspect.signature(function).parameters
    return sum(name.startswith("s_") and name[2:].isdigit() for name in names)


def _used(function: Callable[..., Any]) -> set[str]:
    """The arguments and variables that a function reads."""
    loads = [i.argval for i in dis.get_instructions(function) if i.opname.startswith("LOAD_")]
    return {name for found in loads for name in (found if isinstance(found, tuple) else (found,))}
