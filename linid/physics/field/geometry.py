"""A motor's data sheet, and the model parameters that follow from it (30), (32), (35), (37), (38)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from linid.physics.described import Description, Friction, Positive
from linid.physics.field.guideway import field_magnitude, harmonic, k_of, magnet_harmonics, nome_of, theta_guideway
from linid.physics.field.magnet import BarMagnet
from linid.physics.field.magnet_pair import GaussianField, MagnetPair, fit_gaussian
from linid.physics.field.winding import (
    Winding,
    back_emf_per_speed,
    force_per_current,
    half_coil_angle,
    sine_force_constant,
    theta_force_constant,
    theta_harmonic,
)

_MM = 1e-3
_NOMES = (0.02, 0.95)  # what the models take
_NODES = 16  # of the quadrature across the guideway
_EMF_STEP = 0.02  # pole pitches, of the differences of the flux


class Magnet(Description):
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


class Coil(Description):
    """One winding: equal rectangular turns, measured between the middles of its wire bundles."""

    width_mm: Positive = Field(description="across the guideway (l_x)")
    length_mm: Positive = Field(description="along the guideway (l_y)")
    turns: Annotated[int, Field(ge=1)]


class Electrical(Description):
    """One phase's winding as the data sheet has it; three of them make a star or stay separate.

    resistance_ohm, inductance_h: in ohm and H; mutual_inductance_h: in H, between two phases.
    """

    resistance_ohm: Positive
    inductance_h: Positive
    mutual_inductance_h: float = Field(default=0.0, description="between two phases; negative where they oppose")
    connection: Literal["star", "separate"] = "star"

    @model_validator(mode="after")
    def _stores_energy(self) -> Electrical:
        # The inductance matrix has the eigenvalues L - M (twice) and L + 2 M.
        if not -self.inductance_h / 2 < self.mutual_inductance_h < self.inductance_h:
            raise ValueError("mutual_inductance_h must be between -inductance_h / 2 and inductance_h")
        return self

    @property
    def values(self) -> dict[str, float]:
        """Canonical names and SI values; in a star the inductance is L - M, and M has no other effect."""
        star = self.connection == "star"
        values = {"phase_resistance": self.resistance_ohm}
        values["phase_inductance"] = self.inductance_h - (self.mutual_inductance_h if star else 0.0)
        return values if star else values | {"mutual_inductance": self.mutual_inductance_h}


class MotorGeometry(Description):
    """Magnets and windings of a coreless motor in a U-shaped guideway; dimensions in mm as in data sheets."""

    name: str = "motor"
    magnet: Magnet
    air_gap_mm: Positive = Field(description="between the faces of a pair of magnets")
    pole_pitch_mm: Positive = Field(description="between neighbouring pairs, which alternate (chi)")
    coil: Coil
    phase_spacing_mm: Positive = Field(description="between the middles of neighbouring windings (y_p)")
    mass_kg: Positive | None = Field(default=None, description="moving mass, for a model that can be simulated")
    friction: Friction | None = Field(default=None, description="friction, for a model that can be simulated")
    electrical: Electrical | None = Field(default=None, description="resistance and inductance, for one by voltages")

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

    gaussian: a pair's field (13); k: the ratio sigma_y / pole pitch (17) of that Gaussian; nome: q_0; magnitude: K_B,
    dimensionless (35); sine, theta: values of the two models' parameters by name, the phases counted from the middle
    winding above a magnet; best_sine_constant: N/A of the sine of the same fundamental as theta, which (30) exceeds by
    the reciprocal of the field's first harmonic; exact: amplitude in N/A of each odd harmonic of the thrust over the
    current in the exact field of all magnets, by order; matched: the theta parameters, SI, whose first and third
    harmonics are the exact ones, which a Gaussian fitted to a wide, flat-topped field misses.
    """

    geometry: MotorGeometry
    gaussian: GaussianField
    k: float
    nome: float
    magnitude: float
    sine: dict[str, float]
    theta: dict[str, float]
    best_sine_constant: float
    exact: dict[int, float]
    matched: dict[str, float]

    @property
    def matched_k(self) -> float:
        """The ratio k (17) whose nome gives the exact thrust's third harmonic: what a recording shows, not `k`."""
        return k_of(self.matched["nome"])

    def integrated(self, y: float) -> tuple[float, float]:
        """Thrust over current in N/A by integration along the wires (2), and back-EMF over speed in V s/m from the flux
        through the turns (4), of a winding at y (m) in the guideway of Gaussians (15): one number, which is (38)'s."""
        pitch = self.geometry.pole_pitch

        def field(x: float, place: float) -> float:
            return float(self.gaussian.at(x, 0.0) * theta_guideway(place / pitch, self.k))

        winding = self.geometry.winding
        return force_per_current(field, winding, y), back_emf_per_speed(field, winding, y, _EMF_STEP * pitch)


def exact_thrust(geometry: MotorGeometry, orders: Sequence[int] = (1, 3, 5, 7, 9, 11)) -> dict[int, float]:
    """Harmonics in N/A of the thrust over the current of one winding, from the exact field of infinitely many pairs.

    Of the current at position y above a magnet: sum_n amplitude_n sin(n pi y / pole pitch). No Gaussian is involved.
    Source: (2) over the harmonics of (8).
    """
    winding, pitch = geometry.winding, geometry.pole_pitch
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    # The field is even in x: half of the width stands for the whole.
    half = 0.25 * winding.length_x
    field = magnet_harmonics(geometry.pair, pitch, half * (nodes + 1.0), orders)
    width = 2.0 * half * (weights @ field)
    angle = 0.5 * math.pi * winding.length_y / pitch
    return {n: 2.0 * winding.turns * float(b) * math.sin(n * angle) for n, b in zip(orders, width, strict=True)}


def design(geometry: MotorGeometry) -> MotorDesign:
    """The sine and theta model of a motor from its dimensions (13), (17), (30), (32), (35), (37), (38)."""
    pair, winding, pitch = geometry.pair, geometry.winding, geometry.pole_pitch
    gaussian = fit_gaussian(pair)
    k = gaussian.sigma_y / pitch
    nome, magnitude = nome_of(k), field_magnitude(k)
    sine_constant = sine_force_constant(gaussian.peak, gaussian.sigma_x, winding, pitch)
    sine = {
        "force_constant": sine_constant,
        "electrical_wavenumber": math.pi / pitch,
        "winding_displacement": math.pi * geometry.phase_spacing / pitch,
        "commutation_offset": 0.0,
    }
    theta = {
        "force_constant": theta_force_constant(gaussian.peak, gaussian.sigma_x, winding, magnitude),
        "electrical_wavenumber": 0.5 * math.pi / pitch,
        "winding_displacement": 0.5 * math.pi * geometry.phase_spacing / pitch,
        "commutation_offset": 0.0,
        "winding_length": half_coil_angle(winding, pitch),
        "nome": nome,
    }
    exact = exact_thrust(geometry)
    return MotorDesign(
        geometry,
        gaussian,
        k,
        nome,
        magnitude,
        sine,
        theta,
        harmonic(1, k) * sine_constant,
        exact,
        _matched(theta, exact),
    )


def _matched(theta: dict[str, float], exact: dict[int, float]) -> dict[str, float]:
    """Theta parameters with the exact first harmonic and, as far as a nome can tell, the exact third.

    c_3 / c_1 = q^8 sin(6 z_L) / sin(2 z_L): of the other sign than that ratio of sines there is no nome, and the
    smallest one, of a pure sine, is taken.
    """
    length = theta["winding_length"]
    ratio = exact[3] / exact[1] * math.sin(2.0 * length) / math.sin(6.0 * length)
    lowest, highest = _NOMES
    nome = min(max(ratio, 0.0) ** 0.125, highest) if ratio > lowest**8 else lowest
    return theta | {"nome": nome, "force_constant": exact[1] / theta_harmonic(1, nome, length)}


def load_geometry(path: str | Path) -> MotorGeometry:
    """Read a motor's dimensions from YAML; raises ConfigError, with the line, when it is unreadable or not valid."""
    from linid.config import load_yaml_model

    return load_yaml_model(path, MotorGeometry)
