"""The described axis: what `linid generate` is told about a laboratory stand and its measuring campaign."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from linid.physics.described import Description, Friction, NotNegative, Positive
from linid.stand.mode_descriptions import Mode, SineVoltage, SquareVoltage

# Nomes closer to one would need hundreds of Fourier terms; no real magnet track has them.
NOME_LIMIT = 0.95
# An hour of computing, and as many rows as a file can reasonably have.
_MOST_STEPS, _MOST_SAMPLES = 1e10, 5e7
# Steps within the shortest time constant of the windings: a Runge-Kutta step errs by a millionth of the current then.
_STEPS_OF_WINDING = 10


class SineMotor(Description):
    """F = K_f sum_j sin(omega_g y + alpha_p (j-2) + alpha_S) I_j."""

    kind: Literal["sine"]
    force_constant_n_per_a: float
    electrical_wavenumber_per_m: Positive
    winding_displacement_rad: float
    commutation_offset_rad: float


class ThetaMotor(Description):
    """F = K_f' sum_j Theta0(z_0 y + z_p (j-2) + z_S, q_0) I_j with winding length z_L."""

    kind: Literal["theta"]
    force_constant_n_per_a: float
    electrical_wavenumber_per_m: Positive
    winding_displacement_rad: float
    commutation_offset_rad: float
    winding_length_rad: float
    nome: Annotated[float, Field(gt=0, le=NOME_LIMIT)]


Motor = Annotated[SineMotor | ThetaMotor, Field(discriminator="kind")]


class Winding(Description):
    """Phase windings: U_j = R I_j + L dI_j/dt + M sum_(k != j) dI_k/dt + e_j(y) v; with them voltages are logged.

    connection: in a star the three windings meet in a neutral that is not brought out.
    """

    resistance_ohm: Positive
    inductance_h: Positive
    mutual_inductance_h: float = 0.0
    connection: Literal["star", "separate"]

    @model_validator(mode="after")
    def _stores_energy(self) -> Winding:
        # The inductance matrix has the eigenvalues L - M (twice) and L + 2 M.
        if not -self.inductance_h / 2 < self.mutual_inductance_h < self.inductance_h:
            raise ValueError("mutual_inductance_h must be between -inductance_h / 2 and inductance_h")
        return self

    @property
    def shortest_time_constant(self) -> float:
        """Of the currents, in s: L/R of the voltage vector, or of the mean current where the windings are separate."""
        inductances = [self.inductance_h - self.mutual_inductance_h]
        if self.connection == "separate":
            inductances.append(self.inductance_h + 2 * self.mutual_inductance_h)
        return min(inductances) / self.resistance_ohm


class Stroke(Description):
    """Where the forcer may go; a generated motion that leaves it is refused."""

    lower_m: float
    upper_m: float

    @model_validator(mode="after")
    def _ordered(self) -> Stroke:
        if self.lower_m >= self.upper_m:
            raise ValueError("lower_m must be below upper_m")
        return self


class Drive(Description):
    """Servo drive: sampled P position loop, PI velocity loop, first-order current loop, 120 degree commutation.

    Gains act on sampled exact position and velocity: the drive's interpolated encoder is far finer than the log.
    The log samples the currents in step with the loop, as drives do: while a current rises, its logged values lead
    its mean course by loop_period_s^2 / (12 current_time_constant_s), 0.7 us by default.
    """

    loop_period_s: Positive = 5.0e-5
    current_time_constant_s: Positive = 3.0e-4
    current_limit_a: Positive = 4.0
    position_gain_per_s: NotNegative = 60.0
    velocity_gain_a_s_per_m: NotNegative = 5.0
    velocity_integral_gain_a_per_m: NotNegative = 375.0
    velocity_feedforward: NotNegative = 1.0


class Measurement(Description):
    """What the scope logs; a resolution of 0 means unquantised. Voltages only where the winding is described.

    log_reference: the set position is logged too where the position loop is closed.
    """

    sample_period_s: Positive = 1.0e-3
    position_resolution_m: NotNegative = 1.0e-7
    position_noise_rms_m: NotNegative = 2.0e-7
    current_resolution_a: NotNegative = 1.0e-3
    current_noise_rms_a: NotNegative = 3.0e-3
    voltage_resolution_v: NotNegative = 0.0
    voltage_noise_rms_v: NotNegative = 2.0e-2
    log_reference: bool = False


class AxisDescription(Description):
    """One linear axis, its drive, its measurement and the campaign to be recorded; all values SI."""

    name: Annotated[str, Field(min_length=1)]
    axis: Literal["linear"] = "linear"
    mass_kg: Positive
    constant_force_n: float = 0.0
    friction: Friction
    motor: Motor
    winding: Winding | None = None
    stroke: Stroke
    drive: Drive = Drive()
    measurement: Measurement = Measurement()
    integration_step_s: Positive = 1.0e-5
    campaign: tuple[Mode, ...] = Field(min_length=1)

    @field_validator("campaign")
    @classmethod
    def _names_differ(cls, campaign: tuple[Mode, ...]) -> tuple[Mode, ...]:
        names = [mode.name for mode in campaign]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(f"recording names must differ, repeated: {', '.join(repeated)}")
        return campaign

    @model_validator(mode="after")
    def _ends(self) -> AxisDescription:
        seconds = sum(mode.duration_s for mode in self.campaign)
        for name, period, most in (
            ("integration_step_s", self.integration_step_s, _MOST_STEPS),
            ("measurement.sample_period_s", self.measurement.sample_period_s, _MOST_SAMPLES),
        ):
            if seconds / period > most:
                raise ValueError(f"{name} is too short: the campaign of {seconds:g} s takes more than {most:g} of them")
        return self

    @model_validator(mode="after")
    def _periods_nest(self) -> AxisDescription:
        _whole_ratio("drive.loop_period_s", self.drive.loop_period_s, "integration_step_s", self.integration_step_s)
        _whole_ratio(
            "measurement.sample_period_s",
            self.measurement.sample_period_s,
            "drive.loop_period_s",
            self.drive.loop_period_s,
        )
        return self

    @model_validator(mode="after")
    def _voltages_have_windings(self) -> AxisDescription:
        driven = [mode.name for mode in self.campaign if isinstance(mode, SineVoltage | SquareVoltage)]
        if driven and self.winding is None:
            raise ValueError(f"{driven[0]} imposes voltages, which need a winding (resistance_ohm, inductance_h)")
        if (
            driven
            and self.winding
            and _STEPS_OF_WINDING * self.integration_step_s > self.winding.shortest_time_constant
        ):
            raise ValueError(
                f"integration_step_s must be at most a tenth of the windings' time constant of "
                f"{self.winding.shortest_time_constant:g} s where voltages are imposed ({driven[0]})"
            )
        return self

    @property
    def substeps(self) -> int:
        """Integration steps per drive loop period."""
        return round(self.drive.loop_period_s / self.integration_step_s)

    @property
    def loops_per_sample(self) -> int:
        """Drive loop periods per logged sample."""
        return round(self.measurement.sample_period_s / self.drive.loop_period_s)


def _whole_ratio(long_name: str, long: float, short_name: str, short: float) -> None:
    ratio = long / short
    if round(ratio) < 1 or not math.isclose(ratio, round(ratio), rel_tol=1e-9):
        raise ValueError(f"{long_name} must be a whole multiple of {short_name} (ratio is {ratio:g})")


def load_axis_description(path: str | Path) -> AxisDescription:
    """Read an axis description from a YAML file.

    path: file like configs/stand_axis.yaml. Raises ConfigError, with the line, when it is unreadable or not valid.
    """
    from linid.config import load_yaml_model

    return load_yaml_model(path, AxisDescription)
