"""Coefficients of one own term that keep their ratios: its shape is known, its size is searched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from linid.physics.effects.registry import find_effect
from linid.physics.model import Model

_RESIZED = 4.0  # how many times larger or smaller than given a term may turn out


@dataclass(frozen=True)
class Proportions:
    """leaders: SI value by name of the coefficient that is searched for each term, its largest; ties: the leader of
    each other coefficient and the ratio to it; values: SI of all others; bounds: SI of the leaders."""

    leaders: dict[str, float]
    ties: dict[str, tuple[str, float]]
    values: dict[str, float]
    bounds: dict[str, tuple[float, float]]


UNSHAPED = Proportions({}, {}, {}, {})


def proportions_of(model: Model, given: Mapping[str, float], known: Mapping[str, float]) -> Proportions:
    """What keeps its ratios in a model. given: SI values of coefficients; known: SI values that are not searched; a
    term of which some coefficient is known has none."""
    out = Proportions({}, {}, {}, {})
    for effect in map(find_effect, model.effects):
        own = {name: given[name] for name in effect.amplitudes if name in given}
        if effect.own is None or not any(own.values()) or own.keys() & known.keys():
            continue
        leader = max(own, key=lambda name: abs(own[name]))
        size = own.pop(leader)
        low, high = sorted((size / _RESIZED, size * _RESIZED))
        out.leaders[leader], out.bounds[leader] = size, (low, high)
        out.values.update(own)
        out.ties.update({name: (leader, value / size) for name, value in own.items()})
    return out
