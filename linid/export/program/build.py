"""The program of one model: its functions, its parameters with their values, and what it keeps from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from linid.export.program.entries import ENTRIES
from linid.export.program.layout import INTERVALS, ModelMemory, Slot, parameters_of
from linid.export.target import Exported
from linid.export.translate.program import Program
from linid.export.translate.tree import Expression, Function, Number, Operation
from linid.export.translate.values import Group, Known, Running, Value, View, leaves
from linid.physics import model as places
from linid.physics.laws.registry import find_law
from linid.physics.model import Model
from linid.physics.motors.motor import MAX_HARMONICS
from linid.simulation.bundle import Bundle
from linid.simulation.course import AxisState
from linid.simulation.kernel import Going
from linid.simulation.run import REVERSAL_TOLERANCE
from linid.simulation.terms import terms_of

_REAL, _WHOLE, _TRUTH = (Running(Number(0, kind)) for kind in ("float", "int", "bool"))  # type: ignore[arg-type]
_THREE = Group((_REAL, _REAL, _REAL))
_MOTION = Group((_REAL, _REAL, _REAL, _REAL, _THREE, Group((_REAL, _REAL))), AxisState)
_GOING = Group((_MOTION, _TRUTH, _THREE, _REAL, _WHOLE, _WHOLE), Going)
_CLOCK = Group((_REAL, _REAL, _WHOLE, _REAL))
MOTION = tuple(path for path, _ in leaves(_MOTION))
HISTORY = 512  # steps of which the inputs are remembered where they act late
GOING = tuple(path.removeprefix("motion_") for path, _ in leaves(_GOING))


@dataclass(frozen=True)
class ModelProgram:
    """A model as a program.

    functions: each after what it calls; entries: those that are called from outside, by `prepare`, `start`, `advance`
    and `outputs`; parameters, own: in the order of the arrays `p` and `own`; state: names in the order of the array
    `s`; inputs: names of what drives the axis; tolerance: of a followed step, at one step per internal step of the fit;
    substeps: of the fit; delayed: whether inputs act late; table: numbers of the array `table`.
    """

    functions: tuple[Function, ...]
    entries: dict[str, Function]
    parameters: tuple[Slot, ...]
    own: tuple[Slot, ...]
    state: tuple[str, ...]
    inputs: tuple[str, ...]
    tolerance: float
    substeps: int
    delayed: bool
    table: int = 3 * MAX_HARMONICS


def program_of(exported: Exported) -> ModelProgram:
    """The program of a model; raises ConfigError for an effect, motor or law whose source cannot be translated."""
    return _program(exported.model, tuple(exported.vector.tolist()), exported.result.axis, exported.result.substeps)


@lru_cache(maxsize=16)
def _program(model: Model, numbers: tuple[float, ...], axis: str, substeps: int) -> ModelProgram:
    import numpy as np

    vector = np.array(numbers)
    law = find_law(find_law(model.law).steps)
    terms = terms_of(model, law=law.name)
    memory = ModelMemory(model, parameters_of(model, vector, axis), vector)
    program = Program(memory)
    motor = model.driven_by
    p, table = View("p", 0, (places.WORK_SIZE + 5,)), View("table", 0, (3, MAX_HARMONICS))
    fixed = Bundle(
        on=model.mask,
        powered=motor.inputs > 0,
        motor=model.motor,
        harmonics=_harmonics(program, terms, model, p, table),
        rate=law.rate,
        shape=law.shape,
    )
    intervals = memory.read("p", Known(INTERVALS))
    assert isinstance(intervals, Running)
    count: Expression = Operation("int", (intervals.expression,), "int")
    coefficients = View("c", 0, (Running(count), 4, 4))
    given: dict[str, list[Value]] = {
        "prepare": [],
        "start": [_CLOCK, _THREE],
        "advance": [_CLOCK, _WHOLE, _TRUTH, _GOING],
        "outputs": [_REAL, _MOTION],
    }
    for name in ("record", "elapsed", "added_mass"):
        memory.label_of(_PLACES[name])
    made = {
        name: program.entry(function, [Known(terms), Known(fixed), Group((p, table, coefficients)), *given[name]], name)
        for name, function in ENTRIES.items()
    }
    entries = {name: one.function for name, one in made.items()}
    functions = program.needed([one.name for one in entries.values()])
    inputs = ("current_u", "current_v", "current_w") if motor.phases else ("drive",) if motor.inputs else ()
    return ModelProgram(
        tuple(functions),
        entries,
        memory.plain,
        memory.own,
        tuple(memory.used),
        inputs,
        REVERSAL_TOLERANCE / substeps**2,
        substeps,
        bool(terms.acts.delay),
    )


_PLACES = {"record": places.RECORD, "elapsed": places.ELAPSED, "added_mass": places.ADDED_MASS}


def _harmonics(program: Program, terms: Any, model: Model, p: View, table: View) -> int | None:
    """How many harmonics the motor's field has, None where that hangs on its parameters."""
    made = program.make(terms.motor.prepare, [Known(model.motor), p, table])
    assert isinstance(made.result, Group)
    first = made.result.items[0]
    return int(first.value) if isinstance(first, Known) else None
