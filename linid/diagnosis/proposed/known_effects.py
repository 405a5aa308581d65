"""Columns of the library's effects along the measured motion: what a proposed term is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from linid.arrays import Array
from linid.diagnosis.screen import Screened, Screening
from linid.identification.guess.effect_values import amplitude_sizes
from linid.physics.effects.registry import find_effect


def known_columns(screening: Screening, screened: Sequence[Screened]) -> dict[str, Array]:
    """Accelerations (n, k) in m/s^2 per unit of each amplitude of effects that act in all recordings, by name, at the
    values with which each explains most.

    screened: effects that make sense for these recordings.
    """
    every = screening.effects_everywhere
    out = {}
    for one in screened:
        effect = find_effect(one.name)
        if effect.acts != "all":
            continue
        # It asks of a regression only what columns know too: model, values and recordings.
        sizes = amplitude_sizes(cast(Any, every), effect, screening.outlook)
        out[one.name] = np.asarray(every.of(effect, [dict(one.trial.values)], sizes), dtype=np.float64)
    return out
