"""What a static feed-forward holds of a model: forces of commanded position, speed and acceleration."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from linid.export.simpler import fundamental_phases, own_over_position
from linid.export.target import reshaped

if TYPE_CHECKING:
    from linid.export.target import Exported
    from linid.identification.result import FitResult

# Effects that hang on position, speed and acceleration alone, or on the path of the command.
OVER_POSITION = ("cogging", "gravity")
FACTORS_OF_THRUST = ("force_ripple", "end_effect")
HELD = (
    *OVER_POSITION,
    *FACTORS_OF_THRUST,
    "constant_force",
    "cable_force",
    "quadratic_drag",
    "eddy_current_drag",
    "asymmetric_friction",
    "load_dependent_friction",
    "position_dependent_friction",
)


def kept(exported: Exported) -> tuple[str, ...]:
    """Effects of the model that the feed-forward has too."""
    model = exported.model
    single = ("current_offset",) if model.single else ()
    return tuple(name for name in model.effects if name in (*HELD, *single) or own_over_position(name))


def form(exported: Exported) -> FitResult:
    """The model whose inverse the feed-forward is: steady friction without presliding, the field's first harmonic.

    Raises UsageError where the motor is no constant times its current.
    """
    from linid.export.simpler import held_values

    result, values = exported.result, held_values(exported)
    if exported.model.phases:
        result = replace(result, model="sine")
        values |= fundamental_phases(exported)
    return reshaped(result, effects=kept(exported), law="coulomb", values=values)


def lacks(exported: Exported) -> tuple[str, ...]:
    """What the feed-forward cannot hold of a model, a sentence each."""
    from linid.export.simpler import stroke_of
    from linid.physics.effects.registry import find_effect

    model, held = exported.model, kept(exported)
    found = []
    if model.law != "coulomb":
        found.append("Friction is the steady curve of the speed, without presliding.")
    if model.phases and len(model.driven_by.spectrum(exported.values)) > 1:
        found.append("Of the motor's field the first harmonic is held.")
    for name in model.effects:
        if name not in held:
            effect = find_effect(name)
            found.append(f"{effect.short} is left out: {effect.physics}")
    if stroke_of(exported) is None and any(map(needs_place, held)):
        found.append("No recording tells the stroke: tables reach half a metre (rotary: half a turn) either way.")
    return tuple(found)


def needs_place(name: str) -> bool:
    """Whether an effect needs a table over position."""
    return name in (*OVER_POSITION, *FACTORS_OF_THRUST, "position_dependent_friction") or own_over_position(name)
