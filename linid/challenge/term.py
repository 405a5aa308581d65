"""What a cause outside the library truly does along a campaign's motion: the term that a diagnosis should find."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.challenge.make import Plan, make_campaign
from linid.challenge.truth import contributions
from linid.errors import ConfigError
from linid.stand.modes import command


def plan_body(plan: Plan) -> dict[str, Any]:
    """A plan as plain values, from which the hidden plants can be made again."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(plan).items()}


def plan_of(body: Mapping[str, Any]) -> Plan:
    """The plan of `plan_body`; raises ConfigError where it is none."""
    try:
        fields: dict[str, Any] = {k: tuple(x) if isinstance(x, list) else x for k, x in body.items()}
        return Plan(**fields)
    except TypeError:
        raise ConfigError("keys, plan", "is not the plan of a challenge", "Take the original keys file.") from None


def true_term(plan: Plan, index: int) -> dict[str, Array]:
    """Acceleration (n,) in m/s^2 (rotary: rad/s^2) that the causes of campaign `index` give at the logged instants.

    By name of the recording; what an encoder reads too much counts by its second derivative.
    """
    made = make_campaign(plan, index)
    axis = made.description
    radius = axis.radius_m if axis.kind == "q_rotary" else 1.0
    period = axis.measurement.sample_period_s
    terms = {}
    for place, mode in enumerate(axis.campaign):
        caused, errors, _ = contributions(axis, mode, made.effects, place, command(mode, axis))
        error = errors.sum(axis=0)
        curve = np.zeros_like(error)
        curve[1:-1] = np.diff(error, 2) / period**2
        terms[mode.name] = (caused[:-1].sum(axis=0) + curve) / radius
    return terms
