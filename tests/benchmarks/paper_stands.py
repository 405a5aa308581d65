"""The generated stand with the motors and friction of the paper's tables 2 and 3."""

from __future__ import annotations

import math
from functools import cache

from linid.reproduction.printed import TABLE_2, TABLE_3, meant
from linid.stand.description import AxisDescription, SineMotor, ThetaMotor
from linid.stand.generate import GeneratedCampaign, generate
from tests.identification.stand import stand

# One recording of each driven mode is enough for the intervals, and a fit then takes a third of the time.
DRIVEN = ("slow_ramp_1", "sine_current_2", "sine_position_1", "moves_1")
FREE_WHEELS = ("freewheel_1", "freewheel_2", "freewheel_4", "freewheel_5")
# These motors push with more than the stand's force: as much current would leave its stroke.
_SINE_CURRENT = {"sine": -0.2, "theta": -0.1}


@cache
def table_2() -> GeneratedCampaign:
    """The sine motor of table 2. A negative force constant is a positive one half a period on."""
    values = meant(TABLE_2)
    motor = SineMotor(
        kind="sine",
        force_constant_n_per_a=-values["force_constant"],
        electrical_wavenumber_per_m=values["electrical_wavenumber"],
        winding_displacement_rad=values["winding_displacement"],
        commutation_offset_rad=values["commutation_offset"] - math.pi,
    )
    return _campaign(motor, values)


@cache
def table_3() -> GeneratedCampaign:
    """The theta motor of table 3. A negative winding length is a positive one and a negative force constant."""
    values = meant(TABLE_3)
    motor = ThetaMotor(
        kind="theta",
        force_constant_n_per_a=values["force_constant"],
        electrical_wavenumber_per_m=values["electrical_wavenumber"],
        winding_displacement_rad=values["winding_displacement"],
        commutation_offset_rad=values["commutation_offset"],
        winding_length_rad=-values["winding_length"],
        nome=values["nome"],
    )
    return _campaign(motor, values)


def _campaign(motor: SineMotor | ThetaMotor, values: dict[str, float]) -> GeneratedCampaign:
    """The fitted recordings of the stand with another motor and the friction that goes with it."""
    description: AxisDescription = stand(only=FREE_WHEELS[:1]).description
    friction = description.friction.model_copy(
        update={
            "coulomb_force_n": values["coulomb_force"],
            "static_force_n": values["static_force"],
            "stribeck_velocity_m_per_s": values["stribeck_velocity"],
            "bristle_stiffness_n_per_m": values["bristle_stiffness"],
            "bristle_damping_n_s_per_m": values["bristle_damping"],
            "viscous_friction_n_s_per_m": values["viscous_friction"],
        }
    )
    modes = tuple(
        mode.model_copy(update={"amplitude_a": _SINE_CURRENT[motor.kind]}) if mode.name == "sine_current_2" else mode
        for mode in description.campaign
    )
    described = description.model_copy(update={"motor": motor, "friction": friction, "campaign": modes})
    return generate(described, seed=1, only=FREE_WHEELS + DRIVEN)
