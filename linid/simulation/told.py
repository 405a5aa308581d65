"""Which effects do what they do by measured place, inputs and time alone, and their forces, told beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from linid.arrays import Array
from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import active_mask, find_effect
from linid.physics.model import Model
from linid.simulation.compiled import load_told
from linid.simulation.course import Candidates, Scheme
from linid.simulation.inputs import Inputs
from linid.simulation.threads import summed

_TOLD = {"delay", "drive", "field", "thrust", "force"}  # terms that forces at known places and times hold
_SEES_MOTOR = {"thrust", "drive", "field", "load"}  # terms that must know the motor's own force, or decide it
_OF_MOTOR = {"F", "acceleration"}  # variables of own terms that the motor's force is part of
_OF_PLACE = {"y", "t", "T"}  # variables of own terms that are known where place and time are


def effects_told(model: Model) -> int:
    """The bits of a model's effects whose forces are told before a simulation that reads places as measured; none where
    another effect must know the motor's force by itself, or what the motor gets. Own terms are told where all is."""
    effects = [find_effect(name) for name in model.effects]
    if all(_is_told(effect) or _hangs_on_place(effect) for effect in effects):
        return model.mask
    told = [effect for effect in effects if _is_told(effect)]
    if any(_needs_motor(effect) for effect in effects if effect not in told):
        return 0
    return active_mask(tuple(effect.name for effect in told))


def _is_told(effect: Effect) -> bool:
    """Whether place, inputs and time decide all that an effect of the library does."""
    return effect.own is None and not effect.states and effect.terms.keys() <= _TOLD and not effect.pushes_by_speed


def _hangs_on_place(effect: Effect) -> bool:
    """Whether an effect is an own term whose force place and time decide."""
    return effect.own is not None and effect.own.variables <= _OF_PLACE and effect.own.part(friction=True) is None


def _needs_motor(effect: Effect) -> bool:
    """Whether an effect that is not told beforehand hangs on what the motor does or gets."""
    if effect.own is not None:
        return bool(effect.own.variables & _OF_MOTOR)
    return bool(effect.terms.keys() & _SEES_MOTOR) or effect.pushes_by_inputs


def forces_told(
    candidates: Candidates,
    inputs: Inputs,
    segments: Any,
    scheme: Scheme,
    told: int,
    pieces: tuple[Sequence[tuple[int, int]], int],
) -> tuple[Scheme, Array]:
    """The scheme with the forces in N at all points of segments by the first candidate, and how these answer the
    others, which lie a FORCE_STEP away, (others, points) per unit; what lies in no segment is undefined.

    segments: S stretches (`Segments`); scheme: with the points; told: the bits of `effects_told`; pieces: of the
    segments, and among how many threads they are shared out.
    """
    points = scheme.guide.shape[1]
    forces, by = np.empty(points), np.empty((candidates.params.shape[0] - 1, points))
    kernel, bits = load_told(), (candidates.on, told)

    def work(piece: tuple[int, int]) -> int:
        kernel(candidates, inputs, segments, scheme, bits, *piece, (forces, by))
        return 0

    summed(work, *pieces)
    return scheme._replace(forces=forces), by
