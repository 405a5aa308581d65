"""Search coordinates: the search space [0, 1]^p and its translation into the flat vector of physical parameters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from linid.arrays import Array
from linid.physics.model import MASS, Model
from linid.physics.motors.registry import MOTORS

_COULOMB, _STATIC, _SIGMA_0, _SIGMA_1 = 0, 1, 4, 5
# Standard deviation of a uniform prior over the search box in search coordinates: what a parameter that the data
# say nothing about keeps.
BOX_STD = 1.0 / np.sqrt(12.0)


@dataclass(frozen=True)
class SearchParameter:
    """One searched quantity. For `static_force` the bounds are of F_S/F_C (never below 1), for
    `bristle_damping` of sigma_1/(2 sqrt(sigma_0 m)): both hold for axes of any size."""

    name: str
    lower: float
    upper: float
    log: bool

    def value(self, coordinate: Array) -> Array:
        """Coordinate in [0, 1] -> searched quantity, of the same shape."""
        if self.log:
            return np.asarray(self.lower * (self.upper / self.lower) ** coordinate)
        return np.asarray(self.lower + (self.upper - self.lower) * coordinate)

    def coordinate(self, value: float) -> float:
        """Searched quantity -> search coordinate, clipped to [0, 1]."""
        if self.log:
            fraction = np.log(max(value, 1e-300) / self.lower) / np.log(self.upper / self.lower)
        else:
            fraction = (value - self.lower) / (self.upper - self.lower)
        return float(min(max(fraction, 0.0), 1.0))


@dataclass(frozen=True)
class SearchSpace:
    """The search coordinates of a model; `fixed` holds SI values of everything that is not searched.

    stribeck: False ties F_S to F_C (no Stribeck effect); fundamental: the search coordinate of a theta motor's force
    constant is of the first harmonic of its thrust, which the recordings tell whatever the shape of the field is; ties:
    parameters that keep a ratio to a searched one.
    """

    model: Model
    parameters: tuple[SearchParameter, ...]
    fixed: dict[str, float]
    stribeck: bool = True
    fundamental: bool = False
    ties: dict[str, tuple[str, float]] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the searched parameters."""
        return tuple(searched.name for searched in self.parameters)

    def holding(self, values: dict[str, float]) -> SearchSpace:
        """The same space with some parameters fixed at SI values instead of searched."""
        parameters = tuple(searched for searched in self.parameters if searched.name not in values)
        return replace(self, parameters=parameters, fixed={**self.fixed, **values})

    def vectors(self, population: Array) -> Array:
        """Population (C, p) of search coordinates -> flat parameter vectors (C, size of the model's) in SI units."""
        population = np.atleast_2d(population)
        held = self.model.vector(self.fixed)
        out = np.empty((population.shape[0], held.size))
        out[:] = held
        for column, searched in enumerate(self.parameters):
            out[:, self.model.slot(searched.name)] = searched.value(population[:, column])
        names = self.names
        for name, (leader, ratio) in self.ties.items():
            out[:, self.model.slot(name)] = ratio * out[:, self.model.slot(leader)]
        if "static_force" in names:
            out[:, _STATIC] *= out[:, _COULOMB]
        if not self.stribeck:
            out[:, _STATIC] = out[:, _COULOMB]
        if "bristle_damping" in names:
            out[:, _SIGMA_1] *= 2.0 * np.sqrt(out[:, _SIGMA_0] * out[:, MASS])
        if self.fundamental and "force_constant" in names:
            motor = MOTORS[self.model.kind]
            shape = {name: out[:, self.model.slot(name)] for name, _ in motor.shape}
            out[:, self.model.slot("force_constant")] /= motor.fundamental(np.ones(out.shape[0]), shape)
        self.model.tie(out)
        return out

    def values(self, point: Array) -> dict[str, float]:
        """SI values of all parameters of the model at search coordinates, point (p,)."""
        vector = self.vectors(point)[0]
        return {p.name: float(vector[self.model.slot(p.name)]) for p in self.model.parameters}

    def encode(self, values: dict[str, float]) -> Array:
        """SI values -> search coordinates (p,); a parameter that is not given sits in the middle."""
        known = {**self.fixed, **values}
        point = np.full(len(self.parameters), 0.5)
        for column, searched in enumerate(self.parameters):
            if searched.name not in values:
                continue
            value = values[searched.name]
            if searched.name == "static_force":
                value /= known["coulomb_force"]
            elif searched.name == "bristle_damping":
                value /= 2.0 * np.sqrt(known["bristle_stiffness"] * known["mass"])
            elif searched.name == "force_constant" and self.fundamental:
                value = MOTORS[self.model.kind].fundamental(value, known)
            point[column] = searched.coordinate(value)
        return point

    def natural_jacobian(self, point: Array, step: float = 1e-6) -> Array:
        """d(parameter)/d(search coordinate) at a point (p,), (p, p) in SI units, for the delta method; central
        differences.
        """
        p = len(self.parameters)
        slots = [self.model.slot(name) for name in self.names]
        shifts = step * np.eye(p)
        up = self.vectors(point + shifts)[:, slots]
        down = self.vectors(point - shifts)[:, slots]
        return np.asarray((up - down).T / (2.0 * step))
