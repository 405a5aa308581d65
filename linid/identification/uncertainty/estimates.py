"""From search coordinates and their covariance to parameters with units, intervals and status."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.identification.result import Estimate, Status
from linid.identification.space.search_space import SearchSpace
from linid.identification.uncertainty.covariance import Uncertainty
from linid.identification.uncertainty.identifiability import advice, is_useless
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.physics.wording import scaled_unit
from linid.statistics import NORMAL_97_5

_EDGE = 1e-3  # search coordinates nearer to 0 or 1 than this sit at their bound


def make_estimates(
    space: SearchSpace, point: Array, uncertainty: Uncertainty, axis: str, input_unit: str, per_mass: bool
) -> tuple[tuple[Estimate, ...], tuple[str, ...], Array, Array]:
    """Estimates of all parameters, the names of the fitted ones, their covariance (p, p) (SI) and correlation (p, p).

    point: (p,) search coordinates. Intervals of positive scale parameters are symmetric on the logarithmic scale.
    """
    vector = space.vectors(point)[0]
    jacobian = space.natural_jacobian(np.clip(point, 1e-5, 1.0 - 1e-5))
    covariance = jacobian @ uncertainty.search_covariance @ jacobian.T
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    correlation = covariance / np.maximum(np.outer(deviations, deviations), 1e-300)
    search_std = np.sqrt(np.maximum(np.diag(uncertainty.search_covariance), 0.0))
    names = space.names
    preset = {name for effect in space.model.effects for name in find_effect(effect).held(space.fixed)}
    estimates = []
    for parameter in space.model.parameters:
        value = float(vector[space.model.slot(parameter.name)])
        unit = _unit(parameter.unit_on(axis), axis, input_unit, per_mass)
        if parameter.name not in names:
            note = "per kilogram: no mass is known" if axis != "rotary" else "per kg m^2: no inertia is known"
            note = note if per_mass and parameter.name == "mass" else "given"
            if parameter.name in preset:
                note = "set by the recordings"
            if not space.stribeck and parameter.name in ("static_force", "stribeck_velocity"):
                note = "F_S is tied to F_C: no Stribeck effect is modelled"
            if parameter.name == "stribeck_exponent" and value == parameter.default:
                note = "fixed, as in the paper"
            estimates.append(
                Estimate(parameter.name, parameter.symbol, unit, value, math.nan, math.nan, math.nan, "fixed", note)
            )
            continue
        column = names.index(parameter.name)
        std = float(deviations[column])
        status, note = _status(space, column, float(point[column]), float(search_std[column]), value, std, axis)
        if column in uncertainty.intervals:
            ends = space.parameters[column].value(np.array(uncertainty.intervals[column]))
            low, high = float(ends[0]), float(ends[1])
        elif parameter.log and value > 0.0:
            spread = math.exp(min(NORMAL_97_5 * std / value, 50.0))
            low, high = value / spread, value * spread
        else:
            low, high = value - NORMAL_97_5 * std, value + NORMAL_97_5 * std
        estimates.append(Estimate(parameter.name, parameter.symbol, unit, value, std, low, high, status, note))
    estimates = [_tied(e, *space.ties[e.name], estimates) if e.name in space.ties else e for e in estimates]
    return tuple(estimates), names, covariance, np.clip(correlation, -1.0, 1.0)


def _tied(estimate: Estimate, leader: str, ratio: float, among: Sequence[Estimate]) -> Estimate:
    """An estimate that keeps a ratio to that of its leader."""
    led = next(e for e in among if e.name == leader)
    low, high = sorted((ratio * led.low, ratio * led.high))
    note = f"in proportion to {leader}"
    return replace(estimate, std=abs(ratio) * led.std, low=low, high=high, status=led.status, note=note)


def plain_estimates(model: Model, values: dict[str, float]) -> tuple[Estimate, ...]:
    """Parameters of a model at given SI values, about whose uncertainty nothing is said."""
    return tuple(
        Estimate(p.name, p.symbol, p.unit, values[p.name], math.nan, math.nan, math.nan) for p in model.parameters
    )


def _status(
    space: SearchSpace, column: int, coordinate: float, search_std: float, value: float, std: float, axis: str
) -> tuple[Status, str]:
    name = space.names[column]
    useless = is_useless(space, column, search_std)
    if space.parameters[column].log and value > 0.0:
        useless = useless or is_useless_ratio(std / value)
    if useless:
        return "not_identifiable", f"these recordings do not tell it: {advice(name, axis, space.model.kind)}"
    if coordinate < _EDGE or coordinate > 1.0 - _EDGE:
        if name == "static_force" and coordinate < _EDGE:
            return "at_bound", "equals F_C: no Stribeck effect is visible"
        side = "lower" if coordinate < 0.5 else "upper"
        return "at_bound", f"at the {side} bound of the search; give wider bounds if that is not meant"
    return "fitted", ""


def is_useless_ratio(relative_std: float) -> bool:
    """Whether a standard deviation, relative_std as a ratio, leaves the order of magnitude open."""
    from linid.identification.uncertainty.identifiability import LOG_LIMIT

    return bool(relative_std > LOG_LIMIT)


def _unit(unit: str, axis: str, input_unit: str, per_mass: bool) -> str:
    if input_unit != "A":
        unit = re.sub(r"\bA\b", input_unit, unit)
    return scaled_unit(unit, axis, "kg" if per_mass else "")
