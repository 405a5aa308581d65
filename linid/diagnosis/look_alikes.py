"""Which effects look like others: by what they say of themselves."""

from __future__ import annotations

from linid.physics.effects.registry import EFFECTS, find_effect


def simpler_than(name: str, given: bool) -> tuple[str, ...]:
    """The effects that take the place of another where they do as well: those that it is with some parameters at zero,
    and, beside a given model, other values of the parameters that this has already."""
    effect = find_effect(name)
    changes = tuple(one.name for one in EFFECTS if one.changes) if given and not effect.changes else ()
    return (*effect.includes, *changes)


def look_alike(name: str, other: str) -> bool:
    """Whether one of two effects says that it looks like the other, and the other is no fuller form of the first."""
    one, two = find_effect(name), find_effect(other)
    return (other in one.confused_with or name in two.confused_with) and name not in two.includes
