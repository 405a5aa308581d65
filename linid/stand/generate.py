"""Generating a campaign: each described recording is simulated once, then measured with seeded noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linid.arrays import Array
from linid.errors import ConfigError, UsageError
from linid.recording.recording import Recording
from linid.stand.description import AxisDescription
from linid.stand.measurement import measure, measure_voltages, quantise
from linid.stand.mode_descriptions import FreeWheel, Mode, Moves, SinePosition, SineVoltage, SquareVoltage

if TYPE_CHECKING:
    from linid.stand.plant import PlantRun
    from linid.stand.voltage_plant import VoltageRun


class ExactMotion(NamedTuple):
    """Noise-free motion at the logged instants: t (n,) s, y (n,) m, v (n,) m/s, currents (3, n) A, voltages (3, n) V.

    voltages: None where the winding is not described; reference: (n,) m, the set position, None where none is logged.
    """

    t: Array
    y: Array
    v: Array
    currents: Array
    voltages: Array | None = None
    reference: Array | None = None


@dataclass(frozen=True)
class GeneratedCampaign:
    """A generated campaign: measured recordings, the exact motion behind them, and the true parameters.

    truth: canonical parameter name -> SI value; exact: recording name -> ExactMotion; seed: of the noise.
    """

    description: AxisDescription
    recordings: tuple[Recording, ...]
    exact: dict[str, ExactMotion]
    truth: dict[str, float]
    seed: int


def generate(description: AxisDescription, *, seed: int, only: Sequence[str] | None = None) -> GeneratedCampaign:
    """Simulate and measure the campaign of a described axis.

    seed: of the measurement noise, >= 0; the motion itself is deterministic. only: recording names to make
    (default all); their bits do not depend on which others are made.
    Raises UsageError for a negative seed or an unknown name, ConfigError when a motion leaves the stroke or does not
    stay finite, or imposed voltages bring forth more than the drive's current limit.
    """
    _check_seed(seed)
    known = [mode.name for mode in description.campaign]
    unknown = sorted(set(only or ()) - set(known))
    if unknown:
        raise UsageError(
            f"axis {description.name}", f"no recording named {', '.join(unknown)}", f"Known: {', '.join(known)}."
        )
    exact = {mode.name: _exact(mode, description) for mode in description.campaign if only is None or mode.name in only}
    return GeneratedCampaign(
        description, _measured(description, exact, seed), exact, true_parameters(description), seed
    )


def resample_noise(generated: GeneratedCampaign, seed: int) -> GeneratedCampaign:
    """The same exact motion measured again with another noise seed, bit for bit what `generate` would give.

    Raises UsageError for a negative seed.
    """
    _check_seed(seed)
    return replace(generated, recordings=_measured(generated.description, generated.exact, seed), seed=seed)


def true_parameters(description: AxisDescription) -> dict[str, float]:
    """The true parameters of a described axis under their canonical names, SI units.

    electrical_wavenumber, winding_displacement and shift are omega_g, alpha_p, alpha_S of the sine motor and z_0, z_p,
    z_S of the theta motor; force_constant is K_f or K_f'. In a star phase_inductance is L - M: M has no other effect.
    """
    motor = description.motor
    truth = description.friction.values | {
        "mass": description.mass_kg,
        "force_constant": motor.force_constant_n_per_a,
        "electrical_wavenumber": motor.electrical_wavenumber_per_m,
        "winding_displacement": motor.winding_displacement_rad,
        "commutation_offset": motor.commutation_offset_rad,
    }
    if motor.kind == "theta":
        truth |= {"winding_length": motor.winding_length_rad, "nome": motor.nome}
    winding = description.winding
    if winding is not None:
        truth |= {"phase_resistance": winding.resistance_ohm}
        if winding.connection == "star":
            truth |= {"phase_inductance": winding.inductance_h - winding.mutual_inductance_h}
        else:
            truth |= {"phase_inductance": winding.inductance_h, "mutual_inductance": winding.mutual_inductance_h}
    if description.constant_force_n != 0:
        truth["constant_force"] = description.constant_force_n
    return truth


def _check_seed(seed: int) -> None:
    if seed < 0:
        raise UsageError("seed", f"is {seed}, must not be negative", "Give a whole number from 0.")


def _exact(mode: Mode, description: AxisDescription) -> ExactMotion:
    from linid.stand.modes import command
    from linid.stand.plant import plant_parameters, simulate
    from linid.stand.winding import phase_voltages

    if isinstance(mode, SineVoltage | SquareVoltage):
        return _driven_by_voltage(mode, description)
    told = command(mode, description)
    run = simulate(description, told, start_position=mode.start_position_m, added_mass=mode.added_mass_kg)
    _check_motion(mode, description, run)
    winding = description.winding
    voltages = phase_voltages(winding, plant_parameters(description), run) if winding is not None else None
    logged = description.measurement.log_reference and isinstance(mode, SinePosition | Moves)
    reference = told.y_reference[:: description.loops_per_sample] if logged else None
    return ExactMotion(run.t, run.y, run.v, run.phase_currents, voltages, reference)


def _driven_by_voltage(mode: SineVoltage | SquareVoltage, description: AxisDescription) -> ExactMotion:
    from linid.stand.voltage_plant import simulate_by_voltage

    run = simulate_by_voltage(description, mode)
    _check_motion(mode, description, run)
    largest, limit = float(np.max(np.abs(run.phase_currents))), description.drive.current_limit_a
    if largest > limit:
        raise ConfigError(
            _place(mode, description),
            f"its voltages bring forth {largest:.3g} A, over the drive's limit of {limit:g} A",
            "Lower amplitude_v, or raise current_limit_a of the drive.",
        )
    return ExactMotion(run.t, run.y, run.v, run.phase_currents, run.phase_voltages)


def _place(mode: Mode, description: AxisDescription) -> str:
    return f"axis {description.name}, recording {mode.name}"


def _check_motion(mode: Mode, description: AxisDescription, run: PlantRun | VoltageRun) -> None:
    place = _place(mode, description)
    if not (np.all(np.isfinite(run.y)) and np.all(np.isfinite(run.w))):
        raise ConfigError(place, "the motion does not stay finite", "Shorten integration_step_s or lower the gains.")
    low, high = run.peak
    lower, upper = description.stroke.lower_m, description.stroke.upper_m
    if low < lower or high > upper:
        raise ConfigError(
            place,
            f"moves between {low:.3f} m and {high:.3f} m, outside the stroke {lower:g} to {upper:g} m",
            "Lower its amplitude, speed or duration, or start it elsewhere.",
        )


def _measured(description: AxisDescription, exact: dict[str, ExactMotion], seed: int) -> tuple[Recording, ...]:
    return tuple(
        _recording(mode, description, exact[mode.name], seed, index)
        for index, mode in enumerate(description.campaign)
        if mode.name in exact
    )


def _recording(mode: Mode, description: AxisDescription, motion: ExactMotion, seed: int, index: int) -> Recording:
    coasting = isinstance(mode, FreeWheel)
    y, currents = measure(
        motion.y, motion.currents, description.measurement, seed=seed, index=index, powered=not coasting
    )
    voltages = None
    if motion.voltages is not None:
        voltages = measure_voltages(motion.voltages, description.measurement, seed=seed, index=index)
    resolution, set_position = description.measurement.position_resolution_m, motion.reference
    return Recording(
        name=mode.name,
        t=motion.t.copy(),
        y=y,
        phase_currents=currents,
        phase_voltages=voltages,
        kind="free_wheel" if coasting else "motor",
        split=mode.split,
        added_mass=mode.added_mass_kg,
        reference=None if set_position is None else quantise(set_position, resolution),
    )
