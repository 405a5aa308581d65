"""A motor's data sheet, and the model parameters that follow from it (30), (32), (35), (37), (38)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from linid.physics.field.guideway import field_magnitude, harmonic, nome_of
from linid.physics.field.magnet import BarMagnet
from linid.physics.field.magnet_pair import GaussianField, MagnetPair, fit_gaussian
from linid.physics.field.winding import (
    Winding,
    half_coil_angle,
    sine_force_constant,
    theta_force_constant,
)

Positive = Annotated[float, Field(gt=0)]
_MM = 1e-3


class Described(BaseModel):
    """Base: unknown keys are errors, values cannot be changed afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Magnet(Described):
    """One bar magnet, magnetised through its thickness."""

    width_mm: Positive = Field(description="across the guideway (x)")
    length_mm: Positive = Field(description="along the guideway (y)")
    thickness_mm: Positive = Field(description="through the magnet (z)")
    remanence_t: float = Field(description="remanence in T, negative for the other polarity")

    @model_validator(mode="after")
    def _magnetic(self) -> Magnet:
        if self.remanence_t == 0.0:
            raise ValueError("remanence_t must not be zero")
        return self


class Coil(Described):
    """One winding: equal rectangular turns, measured between the middles of its wire bundles."""

    width_mm: Positive = Field(description="across the guideway (l_x)")
    length_mm: Positive = Field(description="along the guideway (l_y)")
    turns: Annotated[int, Field(ge=1)]


class MotorGeometry(Described):
    """Magnets and windings of a coreless motor in a U-shaped guideway; dimensions in mm as in data sheets."""

    name: str = "motor"
    magnet: Magnet
    air_gap_mm: Positive = Field(description="between the faces of a pair of magnets")
    pole_pitch_mm: Positive = Field(description="between neighbouring pairs, which alternate (chi)")
    coil: Coil
    phase_spacing_mm: Positive = Field(description="between the middles of neighbouring windings (y_p)")

    @model_validator(mode="after")
    def _magnets_fit(self) -> MotorGeometry:
        if self.magnet.length_mm > self.pole_pitch_mm:
            raise ValueError("magnet.length_mm must not exceed pole_pitch_mm: neighbouring magnets would overlap")
        if self.coil.length_mm >= 2.0 * self.pole_pitch_mm:
            raise ValueError("coil.length_mm must be below two pole pitches")
        return self

    @property
    def pair(self) -> MagnetPair:
        """The pair of magnets, SI."""
        m = self.magnet
        bar = BarMagnet(m.width_mm * _MM, m.length_mm * _MM, m.thickness_mm * _MM, m.remanence_t)
        return MagnetPair(bar, self.air_gap_mm * _MM)

    @property
    def winding(self) -> Winding:
        """One phase's winding, SI."""
        return Winding(self.coil.width_mm * _MM, self.coil.length_mm * _MM, self.coil.turns)

    @property
    def pole_pitch(self) -> float:
        """chi, m."""
        return self.pole_pitch_mm * _MM

    @property
    def phase_spacing(self) -> float:
        """y_p, m."""
        return self.phase_spacing_mm * _MM


@dataclass(frozen=True)
class MotorDesign:
    """What dimensions say about a motor, SI.

    gaussian: a pair's field (13); k: sigma_y / pole pitch (17); nome: q_0; magnitude: K_B (35); sine, theta: values of
    the two models' parameters by name, the phases counted from the middle winding above a magnet; best_sine_constant:
    N/A of the sine of the same fundamental as theta, which (30) exceeds by the reciprocal of the field's first
    harmonic.
    """

    geometry: MotorGeometry
    gaussian: GaussianField
    k: float
    nome: float
    magnitude: float
    sine: dict[str, float]
    theta: dict[str, float]
    best_sine_constant: float


def design(geometry: MotorGeometry) -> MotorDesign:
    """The sine and theta model of a motor from its dimensions."""
    pair, winding, pitch = geometry.pair, geometry.winding, geometry.pole_pitch
    gaussian = fit_gaussian(pair)
    k = gaussian.sigma_y / pitch
    nome, magnitude = nome_of(k), field_magnitude(k)
    sine_constant = sine_force_constant(gaussian.peak, gaussian.sigma_x, winding, pitch)
    sine = {
        "force_constant": sine_constant,
        "guideway_density": math.pi / pitch,
        "winding_displacement": math.pi * geometry.phase_spacing / pitch,
        "shift": 0.0,
    }
    theta = {
        "force_constant": theta_force_constant(gaussian.peak, gaussian.sigma_x, winding, magnitude),
        "guideway_density": 0.5 * math.pi / pitch,
        "winding_displacement": 0.5 * math.pi * geometry.phase_spacing / pitch,
        "shift": 0.0,
        "winding_length": half_coil_angle(winding, pitch),
        "nome": nome,
    }
    return MotorDesign(geometry, gaussian, k, nome, magnitude, sine, theta, harmonic(1, k) * sine_constant)


def load_geometry(path: str | Path) -> MotorGeometry:
    """Read a motor's dimensions from YAML; raises ConfigError, with the line, when it is unreadable or not valid."""
    from linid.config import load_yaml_model

    return load_yaml_model(path, MotorGeometry)
