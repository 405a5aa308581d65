"""The drive and the motions under which a feed-forward is judged, where the user or the recordings name none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.closed_loop import measured_q_current
from linid.simulation.controller import Controller

# The velocity loop of configs/controller.yaml on the stand: gain times force per ampere over mass, rad/s.
_BANDWIDTH = 380.0
_CYCLE = 2.5e-4  # s
_NO_LIMIT = 1e12  # A
_LONGEST = 10.0  # s, of logged references together
_PERIOD = 1e-3  # s, of moves that are made up
_DWELL = 0.3  # s, before and between them
_MOVE = 1.2  # s, of the quick ones at most
_MARGIN = 0.05  # of the travel, that moves keep away from either end
_OFTEN = 99.0  # percentile that stands for the largest, which may be noise
_SHARE = 0.5  # of the recorded force, that accelerates
_JERK_SPEED, _JERK_ACCELERATION = 1.875, 10.0 / np.sqrt(3.0)  # largest of a move of least jerk over one second


def thrust_per_q_current(model: Model, values: dict[str, float]) -> float:
    """Force in N per q-current in A, or per unit of the one input. values: SI by name."""
    constant = values["force_constant"]
    return 1.5 * float(model.driven_by.fundamental(constant, values)) if model.phases else constant


def usual_drive(model: Model, values: dict[str, float]) -> Controller:
    """linid's default loops with a velocity gain that suits this axis, and without a current limit.

    values: SI by name. Forces per kilogram do as well: only the ratio of thrust and mass counts.
    """
    gain = _BANDWIDTH * values["mass"] / abs(thrust_per_q_current(model, values))
    return Controller(velocity_gain_a_s_per_m=gain, current_limit_a=_NO_LIMIT, cycle_time_s=_CYCLE)


def drive_words(controller: Controller, given: bool, axis: str, unit: str) -> str:
    """Which loops, for people. given: whether the user has named them; axis: linear or rotary; unit: of the input."""
    length = "rad" if axis == "rotary" else "m"
    time = controller.velocity_integral_time_s
    loops = (
        f"position gain {controller.position_gain_per_s:g} 1/s, velocity gain "
        f"{controller.velocity_gain_a_s_per_m:.3g} {unit} s/{length}, "
        f"{'no integral part' if time is None else f'integral time {1e3 * time:g} ms'}, "
        f"cycle {1e3 * controller.cycle_time_s:g} ms"
    )
    if given:
        return f"the given drive ({loops}, current limit {controller.current_limit_a:g} A)"
    return f"linid's default drive, its velocity gain suited to the mass ({loops}, no current limit)"


def courses_of(recordings: Sequence[Recording], model: Model, values: dict[str, float]) -> tuple[list[Recording], str]:
    """Motions to be commanded, as recordings whose `y` is the command, and which they are, for people.

    Held-out recordings' logged references, smoothed as their steps and rounding ask for; where there are none, moves of
    least jerk over the travel of the driven ones. values: SI by name. The list is empty where nothing moves.
    """
    driven = [r for r in recordings if r.kind != "free_wheel" and r.measured]
    driven = [r for r in driven if r.split == "held_out"] or driven
    logged = [r for r in driven if r.reference is not None]
    if logged:
        chosen = _within(logged)
        return chosen, f"the references logged with {', '.join(r.name for r in chosen)}"
    if not driven:
        return [], ""
    low, high = min(float(np.min(r.y)) for r in driven), max(float(np.max(r.y)) for r in driven)
    speed = max(float(np.percentile(np.abs(r.motion.v), _OFTEN)) for r in driven)
    pushed = max(float(np.percentile(np.abs(_input(model, values, r)), _OFTEN)) for r in driven)
    acceleration = _SHARE * pushed * abs(thrust_per_q_current(model, values)) / values["mass"]
    if not (high > low and speed > 0.0 and acceleration > 0.0):
        return [], ""
    t, y = moves(low, high, speed, acceleration)
    course = Recording("moves", t, y, axis=driven[0].axis, elapsed=driven[0].elapsed)
    return [course], "moves of least jerk over the recorded travel, to and fro, at the recorded and half the speed"


def _within(logged: Sequence[Recording]) -> list[Recording]:
    """Logged references as positions, up to a time together."""
    chosen: list[Recording] = []
    left = _LONGEST
    for one in logged:
        assert one.reference is not None
        count = min(one.t.size, int(left * (one.t.size - 1) / one.duration) + 1)
        if count * one.period < min(1.0, one.duration):
            break
        left -= (count - 1) * one.period
        smooth = replace(one, y=one.reference).motion.y[:count]
        bare = Recording(one.name, one.t[:count], smooth, axis=one.axis, number=one.number, elapsed=one.elapsed)
        chosen.append(bare)
    return chosen


def _input(model: Model, values: dict[str, float], recording: Recording) -> Array:
    if model.phases and recording.phase_currents is not None:
        return measured_q_current(model, values, recording)
    return np.zeros(1) if recording.drive_input is None else recording.drive_input


def moves(low: float, high: float, speed: float, acceleration: float) -> tuple[Array, Array]:
    """Moves to and fro between two positions in m, at this speed in m/s at most, then at half of it.

    acceleration: in m/s^2, at most. The way is shortened about its middle where moves would take long. Returns times
    (n,) in s and positions (n,) in m: 10 x^3 - 15 x^4 + 6 x^5 of the way at a share x of the time, of least jerk (Flash
    and Hogan 1985, J. Neurosci. 5, 1688).
    """
    way = (1.0 - 2.0 * _MARGIN) * (high - low)
    way = min(way, _MOVE * speed / _JERK_SPEED, _MOVE**2 * acceleration / _JERK_ACCELERATION)
    time = max(_JERK_SPEED * way / speed, np.sqrt(_JERK_ACCELERATION * way / acceleration))
    start, rest = 0.5 * (low + high - way), round(_DWELL / _PERIOD)
    pieces = [np.zeros(rest)]
    for k, factor in enumerate((1.0, 1.0, 2.0, 2.0)):
        x = np.linspace(0.0, 1.0, max(2, round(factor * time / _PERIOD)))
        course = x**3 * (10.0 + x * (6.0 * x - 15.0))
        course = course if k % 2 == 0 else 1.0 - course
        pieces += [course, np.full(rest, course[-1])]
    y = start + way * np.concatenate(pieces)
    return np.arange(y.size) * _PERIOD, y
