"""Axes drawn from what a fit does not know of its parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from linid.arrays import Array
from linid.identification.result import FitResult
from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.physics.parameter import Parameter

# Of so many draws the least and the largest hold one more with 95 %: 1 - 2 / (n + 1).
DRAWS = 39
_LARGEST_EXPONENT = 10.0  # of what an unknown positive parameter is multiplied by; its bounds are nearer
Values = dict[str, float]


def draws_of(result: FitResult, model: Model, middle: float, seed: int) -> list[Values]:
    """SI values by name of as many axes as `DRAWS`, drawn from the covariance of a fit, each within its search bounds.

    middle: place in m about which the recordings lie. Parameters that are searched by their logarithm are drawn so.
    Amplitudes of waves are drawn as they are about the middle: an unknown wavelength turns the waves there and back,
    which no line in their sine and cosine about zero follows. Empty where the fit tells no covariance. seed: of the
    draws.
    """
    values = {e.name: e.value for e in result.estimates}
    known = {p.name: p for p in model.parameters}
    covariance = result.covariance
    if not set(result.fitted) & set(known) or covariance.shape != (len(result.fitted),) * 2:
        return []
    if not np.all(np.isfinite(covariance)):
        return []
    out = []
    for row in _shifts(covariance, seed):
        shift = {name: float(x) for name, x in zip(result.fitted, row, strict=True) if name in known}
        one = values | {name: _moved(values[name], x, known[name]) for name, x in shift.items()}
        one |= dict(_waves(model, values, shift, one, middle))
        if "static_force" in one:
            one["static_force"] = max(one["static_force"], one["coulomb_force"])
        out.append(one)
    return out


def _shifts(covariance: Array, seed: int) -> Array:
    """Gaussian draws (DRAWS, p) with a covariance (p, p), which rounding may have made not quite positive."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(deviation > 0.0, deviation, 1.0)
    sizes, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(sizes, 0.0))
    return np.asarray(np.random.default_rng(seed).standard_normal((DRAWS, scale.size)) @ root.T * scale)


def _moved(value: float, shift: float, parameter: Parameter) -> float:
    """A value moved within its bounds, which hold the value itself."""
    moved = value + shift
    if parameter.log and value > 0.0:
        moved = value * math.exp(min(max(shift / value, -_LARGEST_EXPONENT), _LARGEST_EXPONENT))
    return min(max(moved, min(parameter.lower, value)), max(parameter.upper, value))


def _length_of(effect: Effect) -> str:
    """The parameter of an effect that says how long its waves are, or nothing."""
    return next((p.name for p in effect.parameters if p.name.endswith("wavenumber")), effect.period)


def _waves(model: Model, values: Values, shift: Values, drawn: Values, middle: float) -> Iterator[tuple[str, float]]:
    """Drawn amplitudes of all waves whose length is drawn too. values, shift: of the fit, and what was drawn."""
    for effect in map(find_effect, model.effects):
        length = _length_of(effect)
        if length not in shift:
            continue
        pairs = zip(effect.amplitudes[0::2], effect.amplitudes[1::2], strict=True)
        for k, (sine, cosine) in enumerate(pairs):
            if sine not in shift and cosine not in shift:
                continue
            order = values[effect.orders[k]] if effect.orders else float(sine.rpartition("_")[2])
            angle = _angle(effect, order, values[length], middle)
            turned = _angle(effect, order, drawn[length], middle)
            rate = -angle / values[length] if effect.period else angle / values[length]
            wave = complex(values[cosine], values[sine])  # at the middle: this times exp(-i angle)
            moved = complex(shift.get(cosine, 0.0), shift.get(sine, 0.0))
            there = (wave + moved - 1j * wave * rate * shift[length]) * np.exp(-1j * angle)
            back = complex(there * np.exp(1j * turned))
            yield from ((cosine, back.real), (sine, back.imag))


def _angle(effect: Effect, order: float, length: float, y: float) -> float:
    """Angle of a wave at y m, in rad; length: wavenumber in rad/m, or period in m."""
    return order * (2.0 * math.pi * y / length if effect.period else length * y)
