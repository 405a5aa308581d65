"""The explicit list of all effects; their order fixes the bit that switches each of them on."""

from __future__ import annotations

from linid.errors import UsageError
from linid.physics.effects import constant_force
from linid.physics.effects.effect import Effect

EFFECTS: tuple[Effect, ...] = (constant_force.EFFECT,)


def find_effect(name: str) -> Effect:
    """The effect called `name`; raises UsageError with the nearest names otherwise."""
    for effect in EFFECTS:
        if effect.name == name:
            return effect
    import difflib

    names = [effect.name for effect in EFFECTS]
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"Did you mean {near[0]!r}? " if near else ""
    raise UsageError("--effect", f"there is no effect {name!r}", f"{hint}Known effects: {', '.join(names)}")


def active_mask(names: tuple[str, ...]) -> int:
    """The integer whose bits switch on the named effects."""
    mask = 0
    for name in names:
        mask |= 1 << EFFECTS.index(find_effect(name))
    return mask
