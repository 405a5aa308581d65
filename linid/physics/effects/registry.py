"""The explicit list of all effects; their order fixes the bit that switches each of them on.

Effects of other packages follow those of linid: an entry point of the group `linid.effects` names an `Effect`.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from importlib.metadata import EntryPoint

from linid.entry_points import loaded, of_group
from linid.errors import ConfigError, UsageError
from linid.physics import electrical, friction
from linid.physics.effects import (
    asymmetric_friction,
    backlash,
    breakaway_change,
    cable_force,
    cogging,
    commutation_change,
    constant_force,
    current_offset,
    drive_train_backlash,
    dwell_stiction,
    eddy_current_drag,
    encoder_periodic_error,
    end_effect,
    external_disturbance,
    flexible_load,
    force_constant_change,
    force_ripple,
    force_saturation,
    friction_drift,
    friction_level_change,
    gravity,
    input_delay,
    load_dependent_friction,
    payload_change,
    phase_gain_imbalance,
    pole_pitch_error,
    position_dependent_friction,
    quadratic_drag,
    thermal_derating,
    viscous_friction_change,
)
from linid.physics.effects.effect import Effect, check_effect
from linid.physics.motors.registry import MOTORS
from linid.physics.own_terms.effect import own_effect
from linid.physics.own_terms.layout import TERMS
from linid.physics.own_terms.own_term import is_own

GROUP = "linid.effects"
_LARGEST_NUMBER = 56  # bits of the integer that switches effects on, below those of own terms

# Drive effects act one after the other in this order: saturation sees the logged currents, before offsets.
BUILT_IN: tuple[Effect, ...] = (
    cogging.EFFECT,
    force_ripple.EFFECT,
    phase_gain_imbalance.EFFECT,
    asymmetric_friction.EFFECT,
    constant_force.EFFECT,
    cable_force.EFFECT,
    position_dependent_friction.EFFECT,
    quadratic_drag.EFFECT,
    input_delay.EFFECT,
    force_saturation.EFFECT,
    thermal_derating.EFFECT,
    current_offset.EFFECT,
    end_effect.EFFECT,
    flexible_load.EFFECT,
    encoder_periodic_error.EFFECT,
    external_disturbance.EFFECT,
    friction_drift.EFFECT,
    payload_change.EFFECT,
    backlash.EFFECT,
    eddy_current_drag.EFFECT,
    dwell_stiction.EFFECT,
    pole_pitch_error.EFFECT,
    gravity.EFFECT,
    friction_level_change.EFFECT,
    drive_train_backlash.EFFECT,
    load_dependent_friction.EFFECT,
    force_constant_change.EFFECT,
    viscous_friction_change.EFFECT,
    breakaway_change.EFFECT,
    commutation_change.EFFECT,
)


def collect(built_in: Iterable[Effect], others: Iterable[EntryPoint]) -> tuple[Effect, ...]:
    """All effects in order; raises ConfigError for a malformed effect or a name that is taken already."""
    effects: list[Effect] = []
    owners = {p.name: "the base model" for p in friction.PARAMETERS}
    owners |= {p.name: "the base model" for motor in MOTORS.values() for p in motor.parameters}

    def add(effect: Effect, place: str) -> None:
        effects.append(check_effect(effect, place))
        for name in (f"effect {effect.name}", *(p.name for p in effect.parameters)):
            if name in owners:
                raise ConfigError(
                    f"{place}, effect {effect.name!r}",
                    f"the name {name.removeprefix('effect ')!r} is taken by {owners[name]}",
                    "Rename it, or uninstall one of the packages",
                )
            owners[name] = place

    for effect in built_in:
        add(effect, "linid")
    for one, place in loaded(others):
        add(one, place)
    if len(effects) > _LARGEST_NUMBER:
        raise ConfigError(GROUP, f"{len(effects)} effects, at most {_LARGEST_NUMBER} are possible", "Uninstall some")
    return tuple(effects)


EFFECTS: tuple[Effect, ...] = collect(BUILT_IN, of_group(GROUP))
_BITS = {effect.name: 1 << k for k, effect in enumerate(EFFECTS)}


@lru_cache(maxsize=256)
def _own(text: str) -> Effect:
    taken = {f"effect {effect.name}" for effect in EFFECTS} | {p.name for e in EFFECTS for p in e.parameters}
    taken |= {p.name for p in friction.PARAMETERS} | {p.name for m in MOTORS.values() for p in m.parameters}
    effect = own_effect(text, taken | {p.name for parts in electrical.PARAMETERS.values() for p in parts})
    return effect if effect.name == text else _own(effect.name)


def find_effect(name: str, place: str = "--effect") -> Effect:
    """The effect called `name`, or that of an own term's text ("my_drag: -c * v * abs(v)"); raises UsageError with the
    nearest names otherwise, ConfigError for a formula that is none. place: where it was named, for that error.
    """
    if is_own(name):
        return _own(name)
    for effect in EFFECTS:
        if effect.name == name:
            return effect
    import difflib

    names = [effect.name for effect in EFFECTS]
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"Did you mean {near[0]!r}? " if near else ""
    raise UsageError(place, f"there is no effect {name!r}", f"{hint}Known effects: {', '.join(names)}")


def canonical(names: Iterable[str]) -> tuple[str, ...]:
    """The names of effects with the texts of own terms in their canonical form; raises UsageError for two own terms
    that share a name, and for too many of them, ConfigError for a formula that is none.
    """
    out = tuple(find_effect(name).name if is_own(name) else name for name in names)
    own = [find_effect(name).own for name in dict.fromkeys(out) if is_own(name)]
    if len(own) > TERMS:
        raise UsageError("effects", f"{len(own)} own terms, at most {TERMS} are possible", "Join some in one formula.")
    parameters: dict[str, str] = {}
    for term in own:
        for name in (f"effect {term.name}", *(f"{term.name}_{p}" for p in term.parameters)):
            if name in parameters:
                raise UsageError(
                    "effects", f"two own terms share the name {name.removeprefix('effect ')!r}", "Rename one of them."
                )
            parameters[name] = term.name
    return out


def active_mask(names: tuple[str, ...]) -> int:
    """The integer whose bits switch on the named effects."""
    mask = 0
    for name in names:
        effect = find_effect(name)
        mask |= _BITS[effect.name] if effect.own is None else effect.own.bits
    return mask
