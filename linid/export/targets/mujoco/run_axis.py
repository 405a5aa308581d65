"""Runs an exported axis in MuJoCo along a record: python run_axis.py axis.xml RECORD.csv

The record has a header line, the time in s and the q-current (or the one input), or the three phase currents in A (of
axis_by_voltage.xml: the three phase voltages in V).
Written are t, y and v to standard output, in s, m and m/s (rotary: rad and rad/s).
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np


def control(model: Any, phases: Any, y: float) -> float:
    """The q-current in A of three phase currents (3,) in A at position y in m, or what the file wants of phase voltages
    in V; a single input is taken as it is.
    """
    if len(phases) == 1:
        return float(phases[0])
    wavenumber, displacement, offset, _, scale = model.numeric("commutation").data
    field = np.sin(wavenumber * y + offset + displacement * np.array([-1.0, 0.0, 1.0]))
    return float(scale * (field @ phases) / 1.5)


def start(model: Any, data: Any, y: float, v: float, w: float | None = None, cable: float | None = None) -> None:
    """Put the axis at y in m with speed v in m/s; w: the bristle's deflection in m, cable: the state of the cable's
    hysteresis, -1 to 1; None: the steady ones of that speed.
    """
    data.joint("axis").qpos[0], data.joint("axis").qvel[0] = y, v
    stiffness, coulomb, static, speed, length = model.numeric("bristles").data
    if w is None:
        w = np.sign(v) * (coulomb + (static - coulomb) * np.exp(-((v / speed) ** 2))) / stiffness
    bent = length * (np.sign(v) if cable is None else cable)
    for name, deflection in (("friction", w), *((("cable_hysteresis", bent),) if length > 0.0 else ())):
        data.act[model.actuator_actadr[model.actuator(name).id]] = deflection


def between(t: Any, row: Any, at: Any) -> Any:
    """An input (n,) at other times (m,) in s, by the cubics whose slopes at the samples are those to both neighbours
    (Catmull and Rom 1974); straight lines would take a part of what turns with the field.
    """
    share = np.interp(at, t, np.arange(t.size))
    left = np.minimum(share.astype(int), t.size - 2)
    x = share - left
    before, low, high, after = (row[np.clip(left + k, 0, t.size - 1)] for k in (-1, 0, 1, 2))
    bend = x * (
        high - before + x * (2.0 * before - 5.0 * low + 4.0 * high - after + x * (3.0 * (low - high) + after - before))
    )
    return low + 0.5 * bend


def run(model: Any, t: Any, inputs: Any, y: float = 0.0, v: float = 0.0, *bent: float | None) -> Any:
    """Positions and speeds (2, n) at times t (n,) in s under inputs (1 or 3, n), smooth between the samples; from y in
    m, v in m/s and bent bristles as in `start`.
    """
    import mujoco

    data = mujoco.MjData(model)
    start(model, data, y, v, *bent)
    joint, h = data.joint("axis"), model.opt.timestep
    ends = np.rint((t - t[0]) / h).astype(int)
    middles = t[0] + h * (np.arange(ends[-1]) + 0.5)
    # Late phase currents meet the field where it is now: no delay of the q-current says that.
    late = model.numeric("commutation").data[3] if len(inputs) > 1 else 0.0
    courses = np.array([between(t, np.asarray(row), middles - late) for row in inputs])
    out = np.empty((2, t.size))
    out[:, 0] = y, v
    for k in range(1, t.size):
        for now in range(ends[k - 1], ends[k]):
            if courses.size:
                data.ctrl[0] = control(model, courses[:, now], joint.qpos[0])
            mujoco.mj_step(model, data)
        rest = t[k] - t[0] - ends[k] * h
        out[:, k] = joint.qpos[0] + rest * joint.qvel[0], joint.qvel[0]
    return out


if __name__ == "__main__":
    table = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1, ndmin=2).T
    import mujoco

    found = run(mujoco.MjModel.from_xml_path(sys.argv[1]), table[0], table[1:])
    np.savetxt(sys.stdout, np.column_stack([table[0], *found]), "%.9g", ",", header="t (s),y,v", comments="")
