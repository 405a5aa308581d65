"""Coulomb and Stribeck friction without presliding: the limit of a bristle too stiff for any recording to show."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.physics import friction
from linid.physics.laws.law import Law

# rad/s of the mass on its bristle, and its damping ratio: at an acceleration of 10 m/s^2 the bristle bends by less than
# half a micrometre, and the simulation need not halve its steps much.
_STIFF, _DAMPED = 5e3, 1.0
_STIFFNESS, _DAMPING, _MASS = (
    [p.name for p in friction.PARAMETERS].index(name) for name in ("bristle_stiffness", "bristle_damping", "mass")
)


def _tie(vectors: Array) -> None:
    mass = vectors[:, _MASS]
    vectors[:, _STIFFNESS] = mass * _STIFF**2
    vectors[:, _DAMPING] = 2.0 * _DAMPED * np.sqrt(vectors[:, _STIFFNESS] * mass)


LAW = Law(
    name="coulomb",
    title="Coulomb-Stribeck without presliding",
    meaning="no motion below the breakaway force, and a steady force that falls with speed above",
    source="the stiff limit of LuGre; Armstrong-Helouvry, Dupont and Canudas de Wit 1994, Automatica 30, 1083",
    absent=("bristle_stiffness", "bristle_damping"),
    tie=_tie,
    kernel="lugre",
)
