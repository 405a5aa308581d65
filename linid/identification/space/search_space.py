"""Genes: the search space [0, 1]^p and its translation into the flat vector of physical parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from linid.physics.model import MASS, VECTOR_SIZE, Model
from linid.physics.motors import fundamental_force_constant

Array = NDArray[np.float64]
_COULOMB, _STATIC, _SIGMA_0, _SIGMA_1 = 0, 1, 4, 5
# Standard deviation of a uniform prior over the search box in gene units: what a parameter that the data
# say nothing about keeps.
BOX_STD = 1.0 / np.sqrt(12.0)


@dataclass(frozen=True)
class Gene:
    """One searched quantity. For `static_force` the bounds are of F_S/F_C (never below 1), for
    `bristle_damping` of sigma_1/(2 sqrt(sigma_0 m)): both hold for axes of any size."""

    name: str
    lower: float
    upper: float
    log: bool

    def value(self, gene: Array) -> Array:
        """Gene in [0, 1] -> searched quantity."""
        if self.log:
            return np.asarray(self.lower * (self.upper / self.lower) ** gene)
        return np.asarray(self.lower + (self.upper - self.lower) * gene)

    def gene(self, value: float) -> float:
        """Searched quantity -> gene, clipped to [0, 1]."""
        if self.log:
            fraction = np.log(max(value, 1e-300) / self.lower) / np.log(self.upper / self.lower)
        else:
            fraction = (value - self.lower) / (self.upper - self.lower)
        return float(min(max(fraction, 0.0), 1.0))


@dataclass(frozen=True)
class SearchSpace:
    """The genes of a model; `fixed` holds SI values of everything that is not searched.

    stribeck: False ties F_S to F_C (no Stribeck effect); fundamental: the gene of a theta motor's force constant is of
    the first harmonic of its thrust, which the recordings tell whatever the shape of the field is.
    """

    model: Model
    genes: tuple[Gene, ...]
    fixed: dict[str, float]
    stribeck: bool = True
    fundamental: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the searched parameters."""
        return tuple(gene.name for gene in self.genes)

    def holding(self, values: dict[str, float]) -> SearchSpace:
        """The same space with some parameters fixed at SI values instead of searched."""
        genes = tuple(gene for gene in self.genes if gene.name not in values)
        return replace(self, genes=genes, fixed={**self.fixed, **values})

    def vectors(self, population: Array) -> Array:
        """Population (C, p) of genes -> flat parameter vectors (C, VECTOR_SIZE) in SI units."""
        population = np.atleast_2d(population)
        out = np.empty((population.shape[0], VECTOR_SIZE))
        out[:] = self.model.vector(self.fixed)
        for column, gene in enumerate(self.genes):
            out[:, self.model.slot(gene.name)] = gene.value(population[:, column])
        names = self.names
        if "static_force" in names:
            out[:, _STATIC] *= out[:, _COULOMB]
        if not self.stribeck:
            out[:, _STATIC] = out[:, _COULOMB]
        if "bristle_damping" in names:
            out[:, _SIGMA_1] *= 2.0 * np.sqrt(out[:, _SIGMA_0] * out[:, MASS])
        if self.fundamental and "force_constant" in names:
            nome, length, constant = (self.model.slot(n) for n in ("nome", "winding_length", "force_constant"))
            out[:, constant] /= fundamental_force_constant(np.ones(out.shape[0]), out[:, length], out[:, nome])
        return out

    def encode(self, values: dict[str, float]) -> Array:
        """SI values -> genes (p,); a parameter that is not given sits in the middle."""
        known = {**self.fixed, **values}
        genes = np.full(len(self.genes), 0.5)
        for column, gene in enumerate(self.genes):
            if gene.name not in values:
                continue
            value = values[gene.name]
            if gene.name == "static_force":
                value /= known["coulomb_force"]
            elif gene.name == "bristle_damping":
                value /= 2.0 * np.sqrt(known["bristle_stiffness"] * known["mass"])
            elif gene.name == "force_constant" and self.fundamental:
                value = fundamental_force_constant(value, known["winding_length"], known["nome"])
            genes[column] = gene.gene(value)
        return genes

    def natural_jacobian(self, genes: Array, step: float = 1e-6) -> Array:
        """d(parameter)/d(gene), (p, p) in SI units, for the delta method; central differences."""
        p = len(self.genes)
        slots = [self.model.slot(name) for name in self.names]
        shifts = step * np.eye(p)
        up = self.vectors(genes + shifts)[:, slots]
        down = self.vectors(genes - shifts)[:, slots]
        return np.asarray((up - down).T / (2.0 * step))
