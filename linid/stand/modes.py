"""Trajectories of the scope modes: what the drive is told, sample by sample of its loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.errors import ConfigError
from linid.stand.mode_descriptions import (
    FreeWheel,
    Mode,
    Moves,
    SineCurrent,
    SinePosition,
    SineVoltage,
    SlowRamp,
    SquareCurrent,
    SquareVoltage,
)

if TYPE_CHECKING:
    from linid.stand.description import AxisDescription


@dataclass(frozen=True)
class Command:
    """What acts on the axis, held constant over each drive loop period; (n,) arrays in SI units.

    control: 0 power stage off, 1 current command, 2 position loop closed. y_reference in m, v_reference in m/s,
    push: external force in N; v0: start velocity in m/s.
    """

    control: int
    current: Array
    y_reference: Array
    v_reference: Array
    push: Array
    v0: float = 0.0


def command(mode: Mode, description: AxisDescription) -> Command:
    """The commands of one recording at the drive's loop rate; arrays of duration / loop_period_s values.

    Raises ConfigError for a mode whose voltages are imposed: it has no loop (`voltage_wave`).
    """
    if isinstance(mode, SineVoltage | SquareVoltage):
        raise ConfigError(
            f"axis {description.name}, recording {mode.name}",
            f"has imposed voltages ({mode.mode}) where the drive's loops are asked for",
            "Take a mode of currents, positions or a free wheel.",
        )
    t = loop_times(mode, description)[:-1]
    if isinstance(mode, FreeWheel):
        return _free_wheel(mode, description, t)
    if isinstance(mode, SinePosition):
        return _follow(t, mode.start_position_m, *sine_position(mode, t))
    if isinstance(mode, Moves):
        return _follow(t, mode.start_position_m, *moves(mode, t))
    return Command(1, current_command(mode, t), np.zeros_like(t), np.zeros_like(t), np.zeros_like(t))


def loop_times(mode: Mode, description: AxisDescription) -> Array:
    """Instants (n + 1,) in s at which the n drive loops of a recording begin, and its end."""
    samples = round(mode.duration_s / description.measurement.sample_period_s)
    loops = np.arange(samples * description.loops_per_sample + 1, dtype=np.float64)
    return np.asarray(loops * np.float64(description.drive.loop_period_s))


def voltage_wave(mode: SineVoltage | SquareVoltage, t: Array) -> tuple[Array, Array]:
    """Imposed voltage in V at the beginning and the end of each loop, (n,) each.

    t: (n + 1,) s, as `loop_times` gives it. A square wave is held over a loop, a sine goes straight from loop to loop.
    """
    if isinstance(mode, SquareVoltage):
        wave = _square(mode.amplitude_v, mode.frequency_hz, mode.phase_rad, t)
        return wave[:-1], wave[:-1]
    wave = _faded_sine(mode.amplitude_v, mode, t)
    return wave[:-1], wave[1:]


def current_command(mode: SineCurrent | SquareCurrent | SlowRamp, t: Array) -> Array:
    """Commanded q-current in A at times t (n,) in s."""
    if isinstance(mode, SlowRamp):
        # Starts at zero and rises; the growing envelope goes from creep to breakaway.
        triangle = 2 / math.pi * np.arcsin(np.sin(2 * math.pi * t / mode.period_s))
        return mode.amplitude_a * triangle * (mode.start_fraction + (1 - mode.start_fraction) * t / mode.duration_s)
    if isinstance(mode, SquareCurrent):
        return _square(mode.amplitude_a, mode.frequency_hz, mode.phase_rad, t)
    return _faded_sine(mode.amplitude_a, mode, t)


def _square(amplitude: float, frequency: float, phase: float, t: Array) -> Array:
    # The allowance decides edges that fall on a loop sample the same way on every processor.
    half_cycles = np.floor(2 * frequency * t + phase / math.pi + 1e-9)
    return amplitude * (1 - 2 * (half_cycles % 2))


def _faded_sine(amplitude: float, mode: SineCurrent | SineVoltage, t: Array) -> Array:
    wave = np.sin(2 * math.pi * mode.frequency_hz * t + mode.phase_rad)
    return amplitude * _fade(t, mode.fade_s)[0] * wave


def sine_position(mode: SinePosition, t: Array) -> tuple[Array, Array]:
    """Reference position in m relative to the start and its velocity in m/s at times t (n,)."""
    omega = 2 * math.pi * mode.frequency_hz
    wave, wave_rate = np.sin(omega * t), omega * np.cos(omega * t)
    fade, fade_rate = _fade(t, mode.fade_s)
    return mode.amplitude_m * fade * wave, mode.amplitude_m * (fade * wave_rate + fade_rate * wave)


def _fade(t: Array, length: float) -> tuple[Array, Array]:
    """Factor rising from 0 to 1 over length s, and its rate in 1/s; quintic: its acceleration never jumps."""
    if length == 0:
        return np.ones_like(t), np.zeros_like(t)
    s = np.minimum(t / length, 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s), 30 * (s * (1 - s)) ** 2 / length


def moves(mode: Moves, t: Array) -> tuple[Array, Array]:
    """Reference position in m relative to the start and its velocity in m/s at times t (n,)."""
    y, v = np.zeros_like(t), np.zeros_like(t)
    start, here = 0.0, 0.0
    for target in mode.targets_m:
        start += mode.dwell_s
        step_y, step_v, length = point_to_point(
            t - start, target - here, mode.speed_m_per_s, mode.acceleration_m_per_s2, mode.jerk_time_s
        )
        y, v = y + step_y, v + step_v
        start, here = start + length, target
    return y, v


def point_to_point(
    t: Array, distance: float, speed: float, acceleration: float, jerk_time: float
) -> tuple[Array, Array, float]:
    """One move from rest to rest starting at t = 0: position (m), velocity (m/s) at t (n,), and its length in s.

    A trapezoid of velocity (a triangle if the speed is not reached), averaged over jerk_time s: exact sums of
    truncated powers. distance in m (signed), speed in m/s, acceleration in m/s^2.
    """
    if distance == 0:
        return np.zeros_like(t), np.zeros_like(t), 0.0
    span = abs(distance)
    ramp = min(speed / acceleration, math.sqrt(span / acceleration))
    cruise = span / (acceleration * ramp) - ramp
    signed = math.copysign(acceleration, distance)
    switches = ((0.0, 1), (ramp, -1), (ramp + cruise, -1), (2 * ramp + cruise, 1))
    length = 2 * ramp + cruise + jerk_time
    inside = np.clip(t, 0.0, length)
    y, v = np.zeros_like(t), np.zeros_like(t)
    for instant, sign in switches:
        late = np.maximum(inside - instant, 0.0)
        if jerk_time == 0:
            y, v = y + sign * late**2 / 2, v + sign * late
        else:
            later = np.maximum(inside - instant - jerk_time, 0.0)
            y = y + sign * (late**3 - later**3) / (6 * jerk_time)
            v = v + sign * (late**2 - later**2) / (2 * jerk_time)
    return signed * y, signed * v, length


def _follow(t: Array, y0: float, y: Array, v: Array) -> Command:
    return Command(2, np.zeros_like(t), y0 + y, v, np.zeros_like(t))


def _free_wheel(mode: FreeWheel, description: AxisDescription, t: Array) -> Command:
    zero = np.zeros_like(t)
    if mode.push_s == 0:
        return Command(0, zero, zero, zero, zero, mode.speed_m_per_s)
    # Impulse of the push: momentum at release plus what Coulomb and mean viscous friction take meanwhile.
    mass, friction = description.mass_kg + mode.added_mass_kg, description.friction
    resist = friction.coulomb_force_n + friction.viscous_friction_n_s_per_m * abs(mode.speed_m_per_s) / 2
    impulse = mass * abs(mode.speed_m_per_s) + resist * mode.push_s
    peak = math.copysign(math.pi / 2 * impulse / mode.push_s, mode.speed_m_per_s)
    push = np.where(t < mode.push_s, peak * np.sin(math.pi * t / mode.push_s), 0.0)
    return Command(0, zero, zero, zero, push)
