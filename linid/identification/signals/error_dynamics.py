"""How an axis answers a small disturbing force: by the mass, the bristle and the slope of the friction curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from linid.arrays import Array

# Second difference of the position after one sample of an acceleration that a cubic spline joins: its exact gains at
# zero, a quarter and a half of the sampling rate.
_SPLINE = np.array([-0.0244, 0.149, 0.7508, 0.149, -0.0244])
_REACH = 2  # samples to either side


class Bristle(NamedTuple):
    """Friction along W windows of a measured motion.

    rate: (W, n) 1/s, at which a deflection is forgotten; share: (W, n) of the speed's error that it takes up;
    stiffness: (W,) 1/s^2, damping, viscous: (W,) 1/s, all over the mass.
    """

    rate: Array
    share: Array
    stiffness: Array
    damping: Array
    viscous: Array


def bristle_along(vector: Array, v: Array, w: Array, mass: Array) -> Bristle:
    """LuGre friction linearised along a motion.

    vector: (VECTOR_SIZE,) parameters, SI; v: (W, n) speeds in m/s; w: (W, n) deflections in m; mass: (W,) in kg with
    the added one.
    """
    coulomb, static, stribeck_velocity, exponent, stiffness, damping, viscous = vector[:7]
    ratio = np.abs(v) / stribeck_velocity
    excess = (static - coulomb) * np.exp(-np.minimum(ratio**exponent, 700.0))
    level = coulomb + excess
    slope = -exponent * ratio ** (exponent - 1.0) * excess / stribeck_velocity  # of the level, by |v|
    rate = stiffness * np.abs(v) / level
    forgetting = stiffness * w * np.sign(v) / level
    share = 1.0 - forgetting * (1.0 - np.abs(v) * slope / level)
    return Bristle(rate, share, stiffness / mass, damping / mass, viscous / mass)


def position_answers(bristle: Bristle, dt: float) -> Array:
    """Positions (W, n, n) in s^2 at each sample after an acceleration of 1 m/s^2 at one sample (last axis), from rest.

    A spline joins the samples of the acceleration; bristle: along W windows of n samples; dt: s.
    Backward Euler for the bristle, which is stiff where the axis slides.
    """
    windows, n = bristle.rate.shape
    out = np.zeros((windows, n, n))
    y, v, w = np.zeros((3, windows, n))  # speed in the middle between samples
    stiffness, damping, viscous = (x[:, None] for x in bristle[2:])
    spline = np.zeros(2 * (n + _REACH))
    spline[n - 1 : n + 2 * _REACH] = _SPLINE
    for k in range(n - 1):
        push = spline[_REACH + n - 1 - k : _REACH + 2 * n - 1 - k]
        kept = (1.0 / (1.0 + dt * bristle.rate[:, k + 1]))[:, None]
        taken = dt * bristle.share[:, k + 1, None] * kept
        force = push - stiffness * kept * w - damping * (kept - 1.0) / dt * w
        v = (v / dt + force) / (1.0 / dt + viscous + (stiffness + damping / dt) * taken)
        w = kept * w + taken * v
        y = y + dt * v
        out[:, k + 1] = y
    return out
