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
    motor = MOTORS[model.kind]
    acceleration = typical_acceleration(recordings)
    added = max(r.added_mass for r in recordings)
    mass = fixed.get("mass", added if added > 0.0 else 1.0)
    pull = _pull(recordings) if motor.inputs else 0.0
    if motor.inputs == 1 and "force_constant" in fixed and "mass" not in fixed:
        mass = fixed["force_constant"] * pull / acceleration
    first = {"mass": mass, "coulomb_force": _FRICTION_SHARE * mass * acceleration}
    densities: tuple[float, ...] = ()
    if motor.inputs:
        first["force_constant"] = mass * acceleration / pull
    if motor.phases:
        first |= {"commutation_offset": 0.0, **dict(motor.shape)}
        densities = (WAVENUMBERS[0] / model.turns / 0.9, WAVENUMBERS[1] / model.turns / 1.1)
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


def _pull(recordings: Sequence[Recording]) -> float:
    """RMS of the inputs of driven recordings: of the length of the three phase currents, or of the one input."""
    squares = []
    for r in (r for r in recordings if r.kind != "free_wheel"):
        if r.phase_currents is not None:
            squares.append(np.sum(r.phase_currents**2, axis=0))
        elif r.drive_input is not None:
            squares.append(r.drive_input**2)
    return max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1e-300)
