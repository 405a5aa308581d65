"""Random axes and campaigns: a base axis within realistic limits, and what an experimenter would record on it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from linid.challenge.entries import AxisSizes
from linid.challenge.hidden_axis import HiddenAxis, thrust_per_ampere
from linid.physics.described import Friction
from linid.stand.description import AxisDescription, Drive, Measurement, SineMotor, Stroke, ThetaMotor
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

Random = np.random.Generator
# (kind, splits): the free wheels come in pairs without, with one and with two added masses.
PLAN: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("freewheel", ("fit", "fit", "held_out", "fit", "fit", "held_out")),
    ("slow_ramp", ("fit", "held_out")),
    ("sine_current", ("fit", "fit", "held_out")),
    ("square_current", ("fit", "held_out")),
    ("sine_position", ("fit", "fit", "held_out")),
    ("moves", ("fit", "fit", "held_out")),
)
FRESH_PLAN: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("freewheel", ("held_out", "held_out")),
    ("sine_current", ("held_out",)),
    ("sine_position", ("held_out",)),
    ("moves", ("held_out",)),
)
TRAVEL = 0.32  # largest excursion of driven recordings from the middle, in strokes
FASTEST = 1.8  # m/s, of free wheels


def _even(random: Random, low: float, high: float, digits: int | None = None) -> float:
    value = float(random.uniform(low, high))
    return value if digits is None else _round(value, digits)


def _log(random: Random, low: float, high: float, digits: int | None = None) -> float:
    value = float(np.exp(random.uniform(math.log(low), math.log(high))))
    return value if digits is None else _round(value, digits)


def _round(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def draw_axis(name: str, random: Random) -> HiddenAxis:
    """A base axis: mass 0.3 to 3 kg, pole pitch 8 to 30 mm, sine or theta motor, LuGre friction, drive and sensors.

    Its campaign is that of `draw_modes`.
    """
    mass = _log(random, 0.3, 3.0)
    friction = _draw_friction(random, mass)
    thrust = _log(random, 15.0, 80.0)
    motor = _draw_motor(random, thrust)
    bandwidth = _log(random, 150.0, 450.0)  # of the velocity loop, rad/s
    drive = Drive(
        current_time_constant_s=_even(random, 2e-4, 6e-4),
        current_limit_a=_round(2.0 * (25.0 * mass + 12.0 * friction.static_force_n) / thrust, 2),
        position_gain_per_s=_round(bandwidth * _even(random, 0.12, 0.2), 2),
        velocity_gain_a_s_per_m=_round(bandwidth * mass / thrust, 3),
        velocity_integral_gain_a_per_m=_round(bandwidth * mass / thrust * bandwidth * _even(random, 0.12, 0.25), 3),
    )
    measurement = Measurement(
        position_noise_rms_m=_log(random, 1e-7, 8e-7, 2), current_noise_rms_a=_log(random, 1e-3, 6e-3, 2)
    )
    stroke = Stroke(lower_m=0.0, upper_m=_even(random, 0.6, 1.1, 2))
    place = FreeWheel(name="place", mode="free_wheel", duration_s=1.0, start_position_m=0.0, speed_m_per_s=0.0)
    bare = HiddenAxis(
        name=name,
        mass_kg=mass,
        friction=friction,
        motor=motor,
        stroke=stroke,
        drive=drive,
        measurement=measurement,
        campaign=(place,),
    )
    return bare.model_copy(update={"campaign": draw_modes(bare, random, PLAN)})


def _draw_friction(random: Random, mass: float) -> Friction:
    coulomb = mass * _log(random, 2.0, 5.0)
    stiffness = coulomb / _log(random, 8e-5, 3e-4)
    return Friction(
        coulomb_force_n=coulomb,
        static_force_n=coulomb * _even(random, 1.1, 1.9),
        stribeck_velocity_m_per_s=_log(random, 2e-3, 2e-2),
        bristle_stiffness_n_per_m=stiffness,
        bristle_damping_n_s_per_m=2 * _even(random, 0.1, 0.6) * math.sqrt(stiffness * mass),
        viscous_friction_n_s_per_m=coulomb * _log(random, 0.4, 2.0),
    )


def _draw_motor(random: Random, thrust: float) -> SineMotor | ThetaMotor:
    """A motor of `thrust` newton per ampere of q-current; its windings sit within some per cent of 120 degrees."""
    density = math.pi / _log(random, 8e-3, 30e-3)
    spread = 2 * math.pi / 3 * (1 + _even(random, -0.04, 0.04))
    per_phase = thrust / (0.5 * (1 + 2 * math.cos(spread - 2 * math.pi / 3)))
    shift = _even(random, 0.2, 2.9)
    if random.random() < 0.5:
        return SineMotor(
            kind="sine",
            force_constant_n_per_a=per_phase,
            electrical_wavenumber_per_m=density,
            winding_displacement_rad=spread,
            commutation_offset_rad=shift,
        )
    nome, winding = _even(random, 0.25, 0.55), _even(random, 0.5, 0.8)
    return ThetaMotor(
        kind="theta",
        force_constant_n_per_a=per_phase / (8 * nome * math.sin(2 * winding)),
        electrical_wavenumber_per_m=density / 2,
        winding_displacement_rad=spread / 2,
        commutation_offset_rad=shift / 2,
        winding_length_rad=winding,
        nome=nome,
    )


def scales(description: HiddenAxis) -> AxisSizes:
    """Round numbers of an axis."""
    thrust = thrust_per_ampere(description)
    stroke = description.stroke.upper_m
    return AxisSizes(
        mass=description.mass_kg,
        coulomb=description.friction.coulomb_force_n,
        thrust=thrust,
        current=3 * description.friction.static_force_n / thrust,
        limit=description.drive.current_limit_a,
        stroke=stroke,
        reach=TRAVEL * stroke,
        radius=description.radius_m,
    )


def draw_modes(
    description: AxisDescription, random: Random, plan: tuple[tuple[str, tuple[str, ...]], ...]
) -> tuple[Mode, ...]:
    """The recordings of a plan: free wheels with added masses, current and position commands, within the stroke."""
    unit = max(0.1, _round(description.mass_kg * _even(random, 0.5, 1.0), 1))
    modes: list[Mode] = []
    for kind, splits in plan:
        for place, split in enumerate(splits):
            known: dict[str, Any] = {"name": f"{kind}_{place + 1}", "split": split}
            if kind == "freewheel":
                masses = (0.0, unit, 2 * unit)
                known["added_mass_kg"] = round(masses[place // 2 if len(splits) > 3 else place % 3], 3)
                modes.append(_free_wheel(description, random, forward=place % 2 == 0, **known))
            else:
                known["start_position_m"] = description.stroke.upper_m / 2
                modes.append(_DRAW[kind](description, random, **known))
    return tuple(modes)


def _free_wheel(d: AxisDescription, random: Random, *, forward: bool, added_mass_kg: float, **known: Any) -> FreeWheel:
    braking = d.friction.coulomb_force_n / (d.mass_kg + added_mass_kg)
    speed = min(FASTEST, math.sqrt(2 * braking * d.stroke.upper_m * _even(random, 0.15, 0.6)))
    start = d.stroke.upper_m * (0.15 if forward else 0.85)
    return FreeWheel(
        mode="free_wheel",
        duration_s=1.5,
        start_position_m=_round(start, 3),
        added_mass_kg=added_mass_kg,
        speed_m_per_s=_round(speed if forward else -speed, 3),
        **known,
    )


def _slow_ramp(d: AxisDescription, random: Random, **known: Any) -> SlowRamp:
    sign = 1 if random.random() < 0.5 else -1
    amplitude = sign * d.friction.static_force_n * _even(random, 1.07, 1.15) / thrust_per_ampere(d)
    return SlowRamp(
        mode="slow_ramp",
        duration_s=4.0,
        amplitude_a=_round(amplitude, 4),
        period_s=_even(random, 0.9, 1.7, 2),
        start_fraction=_even(random, 0.35, 0.55, 2),
        **known,
    )


def _swing(d: AxisDescription, random: Random, strongest: float) -> tuple[float, float]:
    """Amplitude in A and frequency in Hz of an open-loop oscillation that stays near its start."""
    sign = 1 if random.random() < 0.5 else -1
    force = d.friction.static_force_n * _log(random, 2.0, strongest)
    travel = d.stroke.upper_m * _even(random, 0.03, 0.09)
    frequency = math.sqrt(force / (d.mass_kg * travel)) / (2 * math.pi)
    return _round(sign * force / thrust_per_ampere(d), 3), _round(frequency, 3)


def _sine_current(d: AxisDescription, random: Random, **known: Any) -> SineCurrent:
    amplitude, frequency = _swing(d, random, 6.0)
    return SineCurrent(mode="sine_current", duration_s=4.0, amplitude_a=amplitude, frequency_hz=frequency, **known)


def _square_current(d: AxisDescription, random: Random, **known: Any) -> SquareCurrent:
    amplitude, frequency = _swing(d, random, 9.0)
    return SquareCurrent(mode="square_current", duration_s=3.0, amplitude_a=amplitude, frequency_hz=frequency, **known)


def _sine_position(d: AxisDescription, random: Random, **known: Any) -> SinePosition:
    amplitude = d.stroke.upper_m * _even(random, 0.06, 0.27)
    frequency = min(_even(random, 0.5, 1.1) / amplitude, math.sqrt(18.0 / amplitude) / (2 * math.pi)) / (2 * math.pi)
    return SinePosition(
        mode="sine_position",
        duration_s=4.0,
        amplitude_m=_round(amplitude, 3),
        frequency_hz=_round(max(frequency, 0.6), 3),
        **known,
    )


def _moves(d: AxisDescription, random: Random, **known: Any) -> Moves:
    reach, targets, here = TRAVEL * d.stroke.upper_m, [], 0.0
    for _ in range(int(random.integers(5, 8))):
        target = here
        while abs(target - here) < 0.02:
            target = round(_even(random, -reach, reach), 3)
        targets.append(target)
        here = target
    return Moves(
        mode="moves",
        duration_s=4.5,
        targets_m=tuple(targets),
        speed_m_per_s=_even(random, 0.5, 1.5, 2),
        acceleration_m_per_s2=_even(random, 5, 20, 2),
        dwell_s=_even(random, 0.25, 0.4, 2),
        **known,
    )


_DRAW: dict[str, Any] = {
    "slow_ramp": _slow_ramp,
    "sine_current": _sine_current,
    "square_current": _square_current,
    "sine_position": _sine_position,
    "moves": _moves,
}


def tamed(mode: Mode) -> Mode:
    """The same recording with a gentler command, as an experimenter would choose who saw the axis run away."""
    if isinstance(mode, FreeWheel):
        return mode.model_copy(update={"speed_m_per_s": _round(0.75 * mode.speed_m_per_s, 3)})
    if isinstance(mode, SineCurrent | SquareCurrent):
        softer = {"amplitude_a": _round(0.8 * mode.amplitude_a, 3), "frequency_hz": _round(1.25 * mode.frequency_hz, 3)}
        return mode.model_copy(update=softer)
    if isinstance(mode, SlowRamp):
        return mode.model_copy(update={"amplitude_a": _round(0.93 * mode.amplitude_a, 4)})
    if isinstance(mode, SinePosition):
        return mode.model_copy(update={"amplitude_m": _round(0.8 * mode.amplitude_m, 3)})
    if isinstance(mode, SineVoltage | SquareVoltage):
        return mode.model_copy(update={"amplitude_v": _round(0.8 * mode.amplitude_v, 3)})
    return mode.model_copy(update={"targets_m": tuple(round(0.8 * y, 3) for y in mode.targets_m)})
