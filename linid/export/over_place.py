"""Terms of an effect at many positions at once, at rest and without current."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from linid.arrays import Array


@cache
def _entry(term: Callable[..., float]) -> Callable[..., None]:
    """A term over positions for Python to call, its machine code kept on disk."""
    from linid.simulation.compiled import entry_of

    def over_places(y: Array, parameters: tuple[float, ...], values: Array) -> None:
        for k in range(y.size):
            values[k] = term(0.0, y[k], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, *parameters)

    entry: Callable[..., None] = entry_of(over_places)
    return entry


def term_over(name: str, term: str, values: dict[str, float], y: Array) -> Array:
    """A term of an effect of the library, its usual values where `values` names none.

    name: the effect's; term: `force`, `thrust` or `friction`; values: in SI by parameter; y: (n,) m.
    Returns (n,): N, or a factor.
    """
    from linid.physics.effects.registry import find_effect

    effect = find_effect(name)
    parameters = tuple(float(values.get(p.name, p.default)) for p in effect.parameters)
    found = np.empty(y.size)
    _entry(getattr(effect, term))(np.ascontiguousarray(y, dtype=float), parameters, found)
    return found
