"""What the function block asks for along a commanded motion: its own statements and tables, for whole motions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from linid.export.simpler import smooth_drag, stribeck_curve, thrust_per_current
from linid.export.targets.twincat.feed_forward import RAMP, constant_push
from linid.export.targets.twincat.form import form
from linid.export.targets.twincat.tables import place_tables

if TYPE_CHECKING:
    from linid.arrays import Array
    from linid.export.target import Exported
    from linid.export.targets.twincat.tables import PlaceTables


def feed_forward_along(exported: Exported, y: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """Force and input that the function block asks for along a motion, call by call.

    y, v, a: (n,) commanded position in m, speed in m/s and acceleration in m/s^2. Returns the force (n,) in N and the
    q-current or other input (n,) in its unit, zeros for a model without motor. Raises UsageError as the export does.
    """
    held = form(exported)
    values, effects = {e.name: e.value for e in held.estimates}, held.effects
    tables = place_tables(exported)
    direction = np.clip(v / (RAMP * values["stribeck_velocity"]), -1.0, 1.0)
    push = values["mass"] * a + values["viscous_friction"] * v - constant_push(values, effects)
    push += np.sign(v) * smooth_drag(values, effects, np.abs(v))
    scale = direction.copy()
    if "asymmetric_friction" in effects:
        push += values["viscous_asymmetry"] * np.abs(v)
        scale *= 1.0 + values["friction_asymmetry"] * direction
    if tables.force:
        push -= _at_places(tables, tables.force, y)
    if "cable_force" in effects:
        bend = _bend(y, float(direction[0]), values["cable_hysteresis_length"])
        push += values["cable_stiffness"] * (y - values["cable_middle"]) + values["cable_hysteresis"] * bend
    if tables.friction:
        scale *= _at_places(tables, tables.friction, y)
    force = push + scale * stribeck_curve(values, v)
    if "load_dependent_friction" in effects:
        force /= 1.0 - np.where(force > 0.0, 1.0, -1.0) * values["load_friction"] * scale
    thrust = thrust_per_current(exported)
    if not thrust:
        return force, np.zeros_like(force)
    factor = _at_places(tables, tables.thrust, y) if tables.thrust else 1.0
    offset = values["current_offset_1"] if "current_offset" in effects else 0.0
    return force, force / (thrust * factor) - offset


def _at_places(tables: PlaceTables, row: tuple[float, ...], y: Array) -> Array:
    """A table at positions (n,) in m: straight lines between its nodes, its ends beyond."""
    return np.interp(y, tables.low + tables.step * np.arange(len(row)), row)


def _bend(y: Array, start: float, length: float) -> Array:
    """Bend of a cable chain (n,), -1 to 1, along positions (n,) in m; length: travel in m that turns it round."""
    out, bend, before = [], start, float(y[0])
    for place in y.tolist():
        end = 1.0 if place > before else -1.0
        bend = end + (bend - end) * math.exp(-abs(place - before) / length)
        before = place
        out.append(bend)
    return np.array(out)
