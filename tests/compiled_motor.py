"""The motor as the compiled simulation has it, one force at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numba import njit

from linid.physics.model import Model
from linid.physics.motors.motor import MAX_HARMONICS
from linid.simulation.forces import Axis, motor_forces
from linid.simulation.terms import terms_of

_TERMS = terms_of(bare=True)


@njit(error_model="numpy")
def _axis(motor, p):
    table = np.zeros((3, MAX_HARMONICS))
    harmonics, wavenumber, phase = _TERMS.motor.prepare(motor, p, table)
    return Axis(0, True, motor, harmonics, wavenumber, phase, p, table)


@njit(error_model="numpy")
def _thrust(motor, p, y, currents):
    return _TERMS.motor.thrust(_axis(motor, p), y, currents)


@njit(error_model="numpy")
def _constants(motor, p, y):
    return _TERMS.motor.constants(_axis(motor, p), y)


@njit(error_model="numpy")
def _many(motor, p, y, currents, out):
    motor_forces(_TERMS, motor, p, y, currents, out)


def thrust(kind: str, values: Mapping[str, float], y: float, currents: Sequence[float]) -> float:
    """Force in N at a position in m."""
    model = Model(kind)
    return float(_thrust(model.motor, model.vector(dict(values)), float(y), tuple(map(float, currents))))


def constants(kind: str, values: Mapping[str, float], y: float) -> tuple[float, float, float]:
    """Force per phase current in N/A at a position in m."""
    model = Model(kind)
    return _constants(model.motor, model.vector(dict(values)), float(y))


def thrusts(kind: str, values: Mapping[str, float], y, currents):
    """Forces (n,) in N at positions (n,) in m under currents (3, n) in A, by the loop over all."""
    model, out = Model(kind), np.empty(y.size)
    _many(model.motor, model.vector(dict(values)), y, tuple(np.ascontiguousarray(i) for i in currents), out)
    return out


def harmonics(kind: str, values: Mapping[str, float]) -> int:
    """How many harmonics the table of a motor holds."""
    model = Model(kind)
    return int(_axis(model.motor, model.vector(dict(values))).harmonics)
