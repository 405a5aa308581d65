"""The box of a search from scratch: from the sizes of motion and inputs alone, no regression."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linid.identification.guess.scales import typical_acceleration
from linid.identification.settings import FitSettings
from linid.identification.space.bounds import build_space
from linid.identification.space.search_space import SearchSpace
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording

WAVENUMBERS = (20.0, 1500.0)  # rad/m (rotary: per rad), electrical: pole pitches of 2 mm to 157 mm
_FRICTION_SHARE = 0.3  # of the inertial force, middle of F_C's three decades


def scratch_space(
    model: Model, recordings: Sequence[Recording], fixed: dict[str, float], settings: FitSettings
) -> SearchSpace:
    """Search coordinates over decades about the sizes that the recordings have. fixed: SI values that are given."""
    added = max(r.added_mass for r in recordings)
    mass = fixed.get("mass", added if added > 0.0 else 1.0)
    inertia = mass * typical_acceleration(recordings)
    first = {"mass": mass, "coulomb_force": _FRICTION_SHARE * inertia}
    motor = MOTORS[model.kind]
    densities: tuple[float, ...] = ()
    if motor.phases:
        currents = [r.phase_currents for r in recordings if r.phase_currents is not None and r.kind != "free_wheel"]
        current = float(np.sqrt(np.mean(np.concatenate([np.sum(one**2, axis=0) for one in currents]))))
        first |= {"force_constant": inertia / current, "commutation_offset": 0.0, **dict(motor.shape)}
        densities = (WAVENUMBERS[0] / model.turns / 0.9, WAVENUMBERS[1] / model.turns / 1.1)
    elif motor.inputs == 1:
        inputs = [r.drive_input for r in recordings if r.drive_input is not None]
        first["force_constant"] = inertia / float(np.sqrt(np.mean(np.concatenate(inputs) ** 2)))
    return build_space(
        model,
        recordings,
        {**first, **fixed},
        fixed,
        settings.bounds,
        settings.free_exponent,
        densities,
        settings.stribeck,
    )
