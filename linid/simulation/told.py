"""Which effects do what they do by measured place, inputs and time alone, so that their forces are told beforehand."""

from __future__ import annotations

from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import active_mask, find_effect
from linid.physics.model import Model

_TOLD = {"delay", "drive", "field", "thrust", "force"}  # terms that forces at known places and times hold
_SEES_MOTOR = {"thrust", "drive", "field", "load"}  # terms that must know the motor's own force, or decide it
_OF_MOTOR = {"F", "acceleration"}  # variables of own terms that the motor's force is part of


def told_beforehand(model: Model) -> int:
    """The bits of a model's effects whose forces are told before a simulation that reads places as measured; none where
    another effect must know the motor's force by itself, or what the motor gets."""
    effects = [find_effect(name) for name in model.effects]
    told = [effect for effect in effects if _is_told(effect)]
    if any(_needs_motor(effect) for effect in effects if effect not in told):
        return 0
    return active_mask(tuple(effect.name for effect in told))


def _is_told(effect: Effect) -> bool:
    """Whether place, inputs and time decide all that an effect does."""
    return effect.own is None and not effect.states and effect.terms.keys() <= _TOLD and not effect.pushes_by_speed


def _needs_motor(effect: Effect) -> bool:
    """Whether an effect that is not told beforehand hangs on what the motor does or gets."""
    if effect.own is not None:
        return bool(effect.own.variables & _OF_MOTOR)
    return bool(effect.terms.keys() & _SEES_MOTOR) or effect.pushes_by_inputs
