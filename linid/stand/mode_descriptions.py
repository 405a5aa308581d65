"""Descriptions of the recordings a stand can make: one class per scope mode, SI values."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class _Mode(BaseModel):
    """What all recordings share: name (also the file's), split, added mass, duration and start position."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
    split: Literal["fit", "held_out"] = "fit"
    added_mass_kg: NotNegative = 0.0
    duration_s: Annotated[float, Field(gt=0, le=600)]
    start_position_m: float


class FreeWheel(_Mode):
    """Power stage off, the forcer coasts; its sign of speed is the direction.

    push_s = 0: the recording starts at release with exactly speed_m_per_s. push_s > 0: it starts at rest with a
    half-sine manual push of that length, dimensioned so that the release speed is about speed_m_per_s.
    """

    mode: Literal["free_wheel"]
    speed_m_per_s: float
    push_s: NotNegative = 0.0


class SineCurrent(_Mode):
    """q-current A sin(2 pi f t + phase), faded in over fade_s so that the oscillation starts without step or drift."""

    mode: Literal["sine_current"]
    amplitude_a: float
    frequency_hz: Positive
    phase_rad: float = 0.0
    fade_s: NotNegative = 1.0


class SquareCurrent(_Mode):
    """q-current A sign(sin(2 pi f t + phase)); a phase of pi/2 makes the first pulse a half one: no drift."""

    mode: Literal["square_current"]
    amplitude_a: float
    frequency_hz: Positive
    phase_rad: float = math.pi / 2


class SinePosition(_Mode):
    """Closed position loop follows A sin(2 pi f t) about the start position, faded in over fade_s."""

    mode: Literal["sine_position"]
    amplitude_m: float
    frequency_hz: Positive
    fade_s: NotNegative = 0.3


class Moves(_Mode):
    """Point-to-point moves with a dwell before each; targets relative to the start position.

    Trapezoidal velocity, made S-shaped by averaging over jerk_time_s (0: plain trapezoid).
    """

    mode: Literal["moves"]
    targets_m: tuple[float, ...] = Field(min_length=1)
    speed_m_per_s: Positive
    acceleration_m_per_s2: Positive
    jerk_time_s: NotNegative = 0.02
    dwell_s: NotNegative = 0.2


class SlowRamp(_Mode):
    """Slow triangle of q-current whose amplitude grows linearly from start_fraction to 1 times amplitude_a.

    Below breakaway the forcer creeps on its bristles (pre-sliding); the last triangles pass breakaway.
    """

    mode: Literal["slow_ramp"]
    amplitude_a: float
    period_s: Positive
    start_fraction: Annotated[float, Field(ge=0, le=1)] = 0.5


class _Voltage(_Mode):
    """The power stage gives voltages, and no current loop acts.

    phases: each phase has this share of the wave, a vector that stands still; without: the voltage vector turns with
    the field, as the drive's commutation does, so that a positive voltage pushes forward.
    """

    amplitude_v: float
    frequency_hz: Positive
    phases: tuple[float, float, float] | None = None


class SineVoltage(_Voltage):
    """Voltage A sin(2 pi f t + phase), faded in over fade_s so that the oscillation starts without step or drift."""

    mode: Literal["sine_voltage"]
    phase_rad: float = 0.0
    fade_s: NotNegative = 1.0


class SquareVoltage(_Voltage):
    """Voltage A sign(sin(2 pi f t + phase)); a phase of pi/2 makes the first pulse a half one: no drift."""

    mode: Literal["square_voltage"]
    phase_rad: float = math.pi / 2


Mode = Annotated[
    FreeWheel | SineCurrent | SquareCurrent | SinePosition | Moves | SlowRamp | SineVoltage | SquareVoltage,
    Field(discriminator="mode"),
]
