"""The target `python`: one module that needs nothing but numpy, for reading and teaching."""

from __future__ import annotations

import pprint
from typing import TYPE_CHECKING

from linid.export.target import Exported, Target

if TYPE_CHECKING:
    from linid.export.program.build import ModelProgram

_HEAD = '''"""{title}

A simulation of the axis as `linid simulate` runs it: {what}.
Friction and mass: (40) to (42) of the paper that linid follows; the steps are exact for the equations linearised in
their middle (exponential Rosenbrock, Hochbruck and Ostermann 2010), and halved where the bristle is quick. {units}

    import numpy as np
    import {name}
    t = np.arange(8001) / 8000.0
    run = {name}.simulate({name}.Axis(), t, {example}, y=0.0, v=0.0)
    run.y, run.v, run.friction, run.thrust
"""

import math
from dataclasses import dataclass

import numpy as np

SUBSTEPS = {substeps}  # internal steps per sample, as the model was identified with
TOLERANCE = {tolerance!r}  # share of friction by which a step may be off
INPUTS = {inputs!r}

# Value and unit of every parameter; keyword arguments of `Axis` replace them.
PARAMETERS = {parameters}
'''

_AXIS = '''
class Axis:
    """The axis: its parameters as attributes, and the state in which a simulation left it."""

    def __init__(self, record=0.0, elapsed=0.0, added_mass=0.0, **parameters):
        """record: number of the recording in its campaign; elapsed: s of the campaign at t = 0; added_mass: kg."""
        for name, (value, _) in PARAMETERS.items():
            setattr(self, name, parameters.pop(name, value))
        if parameters:
            raise TypeError("the axis has no parameter " + ", ".join(sorted(parameters)))
        self.own = [getattr(self, name) for name in {own!r}]
        for name in {state!r}:
            setattr(self, name, 0.0)
        self.record, self.elapsed, self.added_mass = record, elapsed, added_mass
        self.table = [0.0] * {table}  # of the motor's field: amplitudes in N/A, cosines and sines of phase steps
        self.c = [0.0] * 16
        prepare(self)


@dataclass
class Run:
    """A simulation at the samples: reading of the position (m), speed (m/s), friction and thrust (N), each (n,)."""

    t: np.ndarray
    y: np.ndarray
    v: np.ndarray
    friction: np.ndarray
    thrust: np.ndarray


def spline(t, inputs):
    """Coefficients (n - 1, 4, 4) of cubic not-a-knot splines through inputs (c, n); n >= 4."""
    h, n = (t[-1] - t[0]) / (len(t) - 1), len(t)
    slopes = np.diff(inputs) / h
    lower, middle, upper = np.ones(n), np.full(n, 4.0), np.ones(n)
    right = np.zeros((len(inputs), n))
    right[:, 1:-1] = 3.0 * (slopes[:, :-1] + slopes[:, 1:])
    middle[0], upper[0], right[:, 0] = 1.0, 2.0, 0.5 * (5.0 * slopes[:, 0] + slopes[:, 1])
    lower[-1], middle[-1], right[:, -1] = 2.0, 1.0, 0.5 * (slopes[:, -2] + 5.0 * slopes[:, -1])
    for k in range(1, n):  # tridiagonal equations of the slopes at the samples, by elimination
        factor = lower[k] / middle[k - 1]
        middle[k] -= factor * upper[k - 1]
        right[:, k] -= factor * right[:, k - 1]
    bends = np.empty_like(right)
    bends[:, -1] = right[:, -1] / middle[-1]
    for k in range(n - 2, -1, -1):
        bends[:, k] = (right[:, k] - upper[k] * bends[:, k + 1]) / middle[k]
    out = np.zeros((n - 1, 4, 4))
    rows = slice(0, len(inputs))
    out[:, rows, 0], out[:, rows, 1] = inputs[:, :-1].T, bends[:, :-1].T
    out[:, rows, 2] = ((3.0 * slopes - 2.0 * bends[:, :-1] - bends[:, 1:]) / h).T
    out[:, rows, 3] = ((bends[:, :-1] + bends[:, 1:] - 2.0 * slopes) / h**2).T
    return out


def held(inputs):
    """Coefficients of inputs (c, n) that stay what they are until the next sample."""
    out = np.zeros((inputs.shape[1] - 1, 4, 4))
    out[:, : len(inputs), 0] = inputs[:, :-1].T
    return out


def simulate(axis, t, inputs, y, v, w=math.nan, coefficients=None, stepping=False, substeps=SUBSTEPS):
    """Run the axis from y (m) and v (m/s) at the first of the times t (n,) in s, which are evenly spaced.

    inputs: (c, n) of {unit}; w: the bristle's deflection in m (nan: that of steady sliding, or of rest under the
    inputs); coefficients: (n - 1, 4, 4) of the inputs between the samples, instead of splines; stepping: whether they
    may differ before and after a sample, as `held` ones do; substeps: internal steps per sample.
    """
    if coefficients is None:
        coefficients = spline(t, np.atleast_2d(np.asarray(inputs, dtype=float)))
    axis.c, axis.intervals = np.ravel(coefficients).tolist(), float(len(coefficients))
    dt, first = float(t[-1] - t[0]) / (len(t) - 1), float(t[0])
    motion = start(axis, {start})
    going = (*motion, False, 1.0, 0.5, 1.0 / 6.0, 0.0, 0, 0)
    rows = [outputs(axis, {first_outputs})]
    for k in range(len(t) - 1):
        {going} = going
        going = advance(axis, {advance})
        {motion} = going[:{motions}]
        now = first + k * dt + dt
        rows.append(outputs(axis, {later_outputs}))
    return Run(np.asarray(t), *(np.array(column) for column in zip(*rows)))
'''


def _files(exported: Exported) -> dict[str, bytes]:
    from linid.export.program.build import program_of

    return {f"{exported.name}.py": python_module(exported, program_of(exported)).encode("utf-8")}


def python_module(exported: Exported, program: ModelProgram) -> str:
    """The module's text."""
    from linid.export.program.words import inputs_in_words, title_of, units_of
    from linid.export.translate.writers.python import PRELUDE, PythonWriter

    parameters = {slot.name: (slot.value, slot.unit) for slot in (*program.parameters, *program.own)}
    head = _HEAD.format(
        title=title_of(exported),
        what=inputs_in_words(exported),
        units=units_of(exported),
        name=exported.name,
        example=f"np.zeros(({max(len(program.inputs), 1)}, t.size))",
        substeps=program.substeps,
        tolerance=program.tolerance,
        inputs=program.inputs,
        parameters=pprint.pformat(parameters, sort_dicts=False, width=110),
    )
    parts = [head + PRELUDE, PythonWriter().program(list(program.functions)), _driver(exported, program)]
    return "\n\n".join(part.strip("\n") for part in parts).replace("\n\n\n\n", "\n\n\n") + "\n"


def _driver(exported: Exported, program: ModelProgram) -> str:
    """The axis and the loop over the samples, which hand every function what it takes."""
    from linid.export.program.build import GOING, MOTION
    from linid.export.program.words import unit_of_inputs

    clock = {"clock_1": "first", "clock_2": "dt", "clock_3": "substeps", "clock_4": "TOLERANCE"}
    begin = {"start_of_axis_1": "float(y)", "start_of_axis_2": "float(v)", "start_of_axis_3": "float(w)"}
    going = {f"going_{name}" if name not in MOTION else f"going_motion_{name}": name for name in GOING}
    motion = {f"motion_{name}": f"motion[{k}]" for k, name in enumerate(MOTION)}

    def arguments(entry: str, known: dict[str, str]) -> str:
        return ", ".join(known[one.name] for one in program.entries[entry].arguments)

    text = _AXIS.replace("{own!r}", repr(tuple(slot.name for slot in program.own)))
    text = text.replace("{state!r}", repr(program.state)).replace("{table}", str(program.table))
    for key, value in {
        "unit": unit_of_inputs(exported),
        "start": arguments("start", clock | begin),
        "first_outputs": arguments("outputs", motion | {"t": "first"}),
        "later_outputs": arguments("outputs", {f"motion_{name}": name for name in MOTION} | {"t": "now"}),
        "going": ", ".join(GOING),
        "motion": ", ".join(MOTION),
        "motions": str(len(MOTION)),
        "advance": arguments("advance", clock | going | {"n": "k", "stepping": "stepping"}),
    }.items():
        text = text.replace(f"{{{key}}}", value)
    return text


TARGET = Target(
    name="python",
    purpose="A Python module of the whole model that needs numpy alone, for reading and teaching.",
    files=_files,
)
