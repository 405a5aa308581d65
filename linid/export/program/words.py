"""What an exported program says of itself in words."""

from __future__ import annotations

from linid.export.target import Exported


def title_of(exported: Exported) -> str:
    """The model in one sentence."""
    from linid.physics.laws.registry import find_law

    result = exported.result
    law = find_law(result.law).title
    effects = [name.split(":")[0].replace("_", " ") for name in result.effects]
    more = f", with {', '.join(effects)}" if effects else ""
    return f"{exported.name}: a {result.axis} axis, {result.model} model, {law} friction{more}; identified by linid."


def unit_of_inputs(exported: Exported) -> str:
    """The unit of what drives the axis."""
    return "A" if exported.model.phases else exported.result.input_unit


def inputs_in_words(exported: Exported) -> str:
    """What drives the axis."""
    if exported.model.phases:
        return "phase currents in A, phases u, v and w, drive it"
    if exported.model.driven_by.inputs:
        return f"one input in {unit_of_inputs(exported)}, such as a q-current or a force command, drives it"
    return "nothing but friction acts on it"


def units_of(exported: Exported) -> str:
    """The units of everything."""
    if exported.result.per_mass:
        return "All in SI units; no mass is known, so that forces are per kilogram of what moves."
    if exported.result.axis == "rotary":
        return "All in SI units of a rotary axis: rad, rad/s, N m, kg m^2 where names speak of m, m/s, N, kg."
    return "All in SI units."
