"""The explicit list of all effects; their order fixes the bit that switches each of them on.

Effects of other packages follow those of linid: an entry point of the group `linid.effects` names an `Effect`.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points

from linid.entry_points import loaded
from linid.errors import ConfigError, UsageError
from linid.physics import friction
from linid.physics.effects import (
    asymmetric_friction,
    backlash,
    cable_force,
    cogging,
    constant_force,
    current_offset,
    drive_train_backlash,
    dwell_stiction,
    eddy_current_drag,
    encoder_periodic_error,
    end_effect,
    external_disturbance,
    flexible_load,
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
)
from linid.physics.effects.effect import Effect, check_effect
from linid.physics.motors.registry import MOTORS

GROUP = "linid.effects"
_LARGEST_NUMBER = 60  # bits of the integer that switches effects on

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


EFFECTS: tuple[Effect, ...] = collect(BUILT_IN, entry_points(group=GROUP))


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
