"""The unknowns of a joint fit: which there are, on which scales they are searched, and how they become parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.balance import Balance
from linid.identification.guess.scales import effect_range, force_scale, look_out, typical_acceleration
from linid.identification.signals.motion import measure_motion
from linid.identification.space.bounds import travel_between_reversals
from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.physics.parameter import Parameter, is_force

ACROSS = "thrust_across"  # of the field's first phase; along it is the force constant
RATIOS = ("static_force", "bristle_stiffness", "bristle_damping")  # searched as ratios to other parameters
_INTERVAL = 4.0  # deviations from end to end of an interval of 95 %
MASS_RANGE = 5.0  # factor about the base's mass
# Presliding deflection F_C/sigma_0: from what the encoder's noise hides to this share of the travel between reversals.
_LEAST_PRESLIDING, _LARGEST_PRESLIDING = 0.03, 0.03


@dataclass(frozen=True)
class Coordinate:
    """One unknown. log: its logarithm is searched; lower, upper: bounds of what is searched; scale: its size; force:
    the residual is linear in it, but where the axis rests; for_mass: kg of the moving mass for which it is counted, 0
    where it is counted as it is; deviation: by which it is known beforehand (0: not)."""

    name: str
    log: bool
    lower: float
    upper: float
    scale: float
    force: bool = False
    for_mass: float = 0.0
    deviation: float = 0.0

    @property
    def stiffness(self) -> float:
        """Inverse of the deviation that it may take in a linear step, 0 where it is free."""
        if self.deviation > 0.0:
            return 1.0 / self.deviation
        return 1.0 / self.scale if self.log else 0.0


@dataclass(frozen=True)
class FieldPhase:
    """The field's phase that a fit begins with, rad of the motor's own angles, at the position y in m."""

    value: float
    y: float


class Coordinates:
    """The unknowns of any model on some recordings, with bounds that scale with the axis.

    Forces are searched on a linear scale, for the residual is linear in them: a fit that starts far off arrives in a
    step; so are the thrust along the field's first phase and across it, K cos and K sin, for with commutated currents
    the valley is a circle in K and phase (Transtrum and Sethna 2012, arXiv:1201.5885). That phase is the one in the
    middle of the motion, where the pole pitch turns the field by the least. Breakaway is searched as F_S/F_C, stiffness
    as presliding deflection F_C/sigma_0, damping as a ratio, so that friction can grow without its presliding growing
    too. Where the mass is searched, forces are counted for the base's mass, F m_0/m: the mass alone then moves just
    what tells it, the recordings with other added masses.
    """

    def __init__(
        self,
        balance: Balance,
        reference: Mapping[str, float],
        limits: Mapping[str, tuple[float, float]],
        told: Mapping[str, tuple[float, float]],
    ) -> None:
        self.limits, self.told = dict(limits), dict(told)
        recordings = balance.recordings
        self.reference = dict(reference)
        self.mass = reference.get("mass", 1.0)
        motion = measure_motion(recordings)
        noise = max(float(np.min(motion.position_noise)), 1e-12)
        travel = travel_between_reversals(recordings)
        speed = max(float(np.quantile(np.abs(motion.v), 0.99)), 10.0 * noise)
        inertia = self.mass * typical_acceleration(recordings)
        self.force = max(abs(reference.get("coulomb_force", 0.0)), 1e-2 * inertia, 1e-15)
        self.speed = speed
        low, high = _LEAST_PRESLIDING * noise, _LARGEST_PRESLIDING * travel
        self.presliding = (math.log(low), math.log(max(high, 10.0 * low)))
        self.middle = float(np.mean(motion.y))
        self.outlook = look_out(balance.base, recordings, self.reference)
        self.force_scale = force_scale(recordings, self.reference)

    def of(
        self,
        model: Model,
        held: Mapping[str, float],
        values: Mapping[str, float],
        sizes: Mapping[str, tuple[float, float]],
    ) -> tuple[Coordinate, ...]:
        """The unknowns of a model; held: SI values that are not identified; values: first values; sizes: bounds of
        coefficients that stand for a whole term."""
        effects = [find_effect(effect) for effect in model.effects]
        amplitudes = {name: effect for effect in effects for name in effect.amplitudes_of(model.kind)}
        owners = {parameter.name: effect for effect in effects for parameter in effect.parameters}
        out = []
        for parameter in model.parameters:
            if parameter.name in held or parameter.name == "stribeck_exponent":
                continue
            if parameter.name in sizes:
                low, high = sizes[parameter.name]
                out.append(Coordinate(parameter.name, False, low, high, max(abs(low), abs(high)), True))
            elif parameter.name in amplitudes:
                effect = amplitudes[parameter.name]
                low, high = effect_range(effect, parameter, self.outlook, self.force_scale, self.mass)
                out.append(Coordinate(parameter.name, False, low, high, high, True))
            else:
                out.append(self._coordinate(parameter, values, held, owners.get(parameter.name)))
        if "mass" in held or "force_constant" in held:  # a known thrust is what tells the mass
            return tuple(out)
        units = {p.name: p.unit for p in model.parameters} | {ACROSS: "N/A"} | dict.fromkeys(sizes, "N")
        return tuple(replace(c, for_mass=self.mass) if not c.log and is_force(units[c.name]) else c for c in out)

    def _coordinate(
        self, parameter: Parameter, values: Mapping[str, float], held: Mapping[str, float], owner: Effect | None
    ) -> Coordinate:
        """A parameter that is no amplitude; owner: the effect that has it, if one does."""
        name = parameter.name
        size = abs(self.reference.get(name, values.get(name, parameter.default)))
        if name in self.told:
            return self._told(name)
        if name in self.limits:
            return Coordinate(name, False, *self.limits[name], size)
        match name:
            case "coulomb_force":
                return Coordinate(name, False, 1e-4 * self.force, 1e3 * self.force, self.force, True)
            case "static_force":
                return Coordinate(name, True, 0.0, math.log(8.0), 1.0)
            case "stribeck_velocity":
                return Coordinate(name, True, math.log(1e-4 * self.speed), math.log(0.1 * self.speed), 1.0)
            case "bristle_stiffness":
                return Coordinate(name, True, *self.presliding, 1.0)
            case "bristle_damping":
                return Coordinate(name, True, math.log(3e-3), math.log(30.0), 1.0)
            case "viscous_friction":
                top = self.force / self.speed
                return Coordinate(name, False, 1e-5 * top, 1e2 * top, top, True)
            case "force_constant":
                return Coordinate(name, False, 1e-3 * size, 1e3 * size, size, True)
            case "mass":
                return Coordinate(name, True, math.log(size / MASS_RANGE), math.log(MASS_RANGE * size), 1.0)
            case "electrical_wavenumber":
                return Coordinate(name, True, math.log(0.9 * size), math.log(1.1 * size), 0.01)
            case "commutation_offset":
                if "force_constant" in held:
                    return Coordinate(name, False, values[name] - math.pi, values[name] + math.pi, 1.0)
                top = 1e3 * abs(self.reference["force_constant"])
                return Coordinate(ACROSS, False, -top, top, 1e-3 * top, True)
        low, high = parameter.lower, parameter.upper
        if owner is not None:
            low, high = owner.range_about(parameter, values.get(name, parameter.default), {**values, **held})
        if parameter.log:
            low, high = math.log(low), math.log(high)
            return Coordinate(name, True, low, high, min(1.0, high - low))
        return Coordinate(name, False, low, high, high - low)

    def _told(self, name: str) -> Coordinate:
        """A parameter that is known beforehand, within its interval of 95 %."""
        low, high = self.told[name]
        log = name in RATIOS
        if log:
            low, high = math.log(low), math.log(high)
        return Coordinate(name, log, low, high, high - low, deviation=(high - low) / _INTERVAL)


def encoded(coordinates: Sequence[Coordinate], model: Model, values: Mapping[str, float]) -> Array:
    """SI values -> what is searched (p,), within the bounds."""
    out = np.empty(len(coordinates))
    for k, c in enumerate(coordinates):
        if c.name == ACROSS:
            out[k] = 0.0
            continue
        value = values.get(c.name, next(p.default for p in model.parameters if p.name == c.name))
        if c.name == "static_force":
            value = value / values["coulomb_force"]
        elif c.name == "bristle_stiffness":
            value = values["coulomb_force"] / value
        elif c.name == "bristle_damping":
            value = value / (2.0 * math.sqrt(values["bristle_stiffness"] * values["mass"]))
        elif c.name == "force_constant":
            value = MOTORS[model.kind].fundamental(value, values)
        if c.for_mass:
            value *= c.for_mass / values["mass"]
        out[k] = min(max(math.log(max(value, 1e-300)) if c.log else value, c.lower), c.upper)
    return out


def vectors_of(
    coordinates: Sequence[Coordinate],
    model: Model,
    held: Mapping[str, float],
    searched: Array,
    phase: FieldPhase,
    ties: Mapping[str, tuple[str, float]],
) -> Array:
    """What is searched (C, p) -> flat parameter vectors (C, VECTOR_SIZE) in SI units; phase: the field's first; ties:
    parameters that keep a ratio to another."""
    searched = np.atleast_2d(searched)
    out = np.empty((searched.shape[0], model.vector({}).size))
    out[:] = model.vector(dict(held))
    names = {c.name for c in coordinates}
    for k, c in enumerate(coordinates):
        if c.name != ACROSS:
            out[:, model.slot(c.name)] = np.exp(searched[:, k]) if c.log else searched[:, k]
    _times_mass(out, coordinates, model)
    for name, (leader, ratio) in ties.items():
        out[:, model.slot(name)] = ratio * out[:, model.slot(leader)]
    if ACROSS in names:
        place = [c.name for c in coordinates].index(ACROSS)
        across = searched[:, place]
        if coordinates[place].for_mass:
            across = across * out[:, model.slot("mass")] / coordinates[place].for_mass
        constant, shift = model.slot("force_constant"), model.slot("commutation_offset")
        turned = phase.y * out[:, model.slot("electrical_wavenumber")]
        out[:, shift] = phase.value - turned + np.arctan2(across, out[:, constant]) / model.turns
        out[:, constant] = np.hypot(out[:, constant], across)
    coulomb, static, stiffness, damping, mass = (
        model.slot(n) for n in ("coulomb_force", "static_force", "bristle_stiffness", "bristle_damping", "mass")
    )
    if "static_force" in names:
        out[:, static] *= out[:, coulomb]
    if "bristle_stiffness" in names:
        out[:, stiffness] = out[:, coulomb] / out[:, stiffness]
    if "bristle_damping" in names:
        out[:, damping] *= 2.0 * np.sqrt(out[:, stiffness] * out[:, mass])
    motor = MOTORS[model.kind]
    if motor.shape and "force_constant" in names:
        shape = {name: out[:, model.slot(name)] for name, _ in motor.shape}
        out[:, model.slot("force_constant")] /= motor.fundamental(np.ones(out.shape[0]), shape)
    model.tie(out)
    return out


def _times_mass(vectors: Array, coordinates: Sequence[Coordinate], model: Model) -> None:
    """Bring what is counted for another mass to that of each vector (C, VECTOR_SIZE), in place."""
    mass = model.slot("mass")
    for c in coordinates:
        if c.for_mass and c.name != ACROSS:
            vectors[:, model.slot(c.name)] *= vectors[:, mass] / c.for_mass
