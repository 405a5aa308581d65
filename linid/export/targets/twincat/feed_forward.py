"""The feed-forward as a function block in Structured Text (IEC 61131-3) of TwinCAT 3."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from linid.export.simpler import number, thrust_per_current
from linid.export.targets.twincat.tables import PlaceTables, place_tables

if TYPE_CHECKING:
    from linid.export.target import Exported
    from linid.identification.result import FitResult

NAME = "FB_AxisFeedForward"
RAMP = 0.1  # Stribeck velocities within which the direction turns round
_PER_LINE = 8


@dataclass(frozen=True)
class Units:
    """The units of one kind of axis, for comments."""

    place: str
    force: str
    mass: str

    @property
    def per_speed(self) -> str:
        """Of viscous friction."""
        return f"{self.force} s/{self.place}"


def units_of(result: FitResult) -> Units:
    """Units of a model; per kilogram where nothing tells the mass."""
    if result.axis == "rotary":
        return Units("rad", "N m per kg m^2", "1") if result.per_mass else Units("rad", "N m", "kg m^2")
    return Units("m", "N/kg", "1") if result.per_mass else Units("m", "N", "kg")


@dataclass(frozen=True)
class _Block:
    """What is written: values in SI by name, effects, tables, units, force per input."""

    values: dict[str, float]
    effects: tuple[str, ...]
    tables: PlaceTables
    units: Units
    thrust: float
    input_unit: str

    def has(self, *names: str) -> bool:
        return any(name in self.effects for name in names)


def _declared(name: str, x: float, comment: str) -> str:
    return f"    {name} : LREAL := {number(x)}; // {comment}"


def _parameters(block: _Block) -> Iterator[str]:
    """Declarations of the parameters that this model needs."""
    values, unit = block.values, block.units
    yield _declared("Mass", values["mass"], f"{unit.mass}, whole moving part")
    yield _declared("Coulomb", values["coulomb_force"], f"{unit.force}, friction at speed")
    yield _declared("Breakaway", values["static_force"], f"{unit.force}, friction near standstill")
    yield _declared("StribeckSpeed", values["stribeck_velocity"], f"{unit.place}/s")
    yield _declared("StribeckExponent", values["stribeck_exponent"], "1")
    yield _declared("Viscous", values["viscous_friction"], unit.per_speed)
    yield _declared("RampSpeed", RAMP * values["stribeck_velocity"], f"{unit.place}/s, full friction from here on")
    yield _declared(
        "ConstantForce", constant_push(block.values, block.effects), f"{unit.force}, that pushes forwards everywhere"
    )
    if block.thrust:
        yield _declared("ForcePerInput", block.thrust, f"{unit.force} per {block.input_unit}")
    if block.has("quadratic_drag"):
        yield _declared("Drag", values["drag_coefficient"], f"{unit.force} s^2/{unit.place}^2, at DragSpeed")
        yield _declared("DragPower", values["drag_power"], "1")
        yield _declared("DragSpeed", values["drag_speed"], f"{unit.place}/s")
    if block.has("eddy_current_drag"):
        yield _declared("Eddy", values["eddy_damping"], unit.per_speed)
        yield _declared("EddySpeed", values["eddy_speed"], f"{unit.place}/s, of the largest drag")
    if block.has("asymmetric_friction"):
        yield _declared("Asymmetry", values["friction_asymmetry"], "1, friction more forwards, less back")
        yield _declared("ViscousAsymmetry", values["viscous_asymmetry"], unit.per_speed)
    if block.has("load_dependent_friction"):
        yield _declared("LoadFriction", values["load_friction"], "1, friction per force of the motor")
    if block.has("cable_force"):
        yield _declared("CableStiffness", values["cable_stiffness"], f"{unit.force}/{unit.place}")
        yield _declared("CableMiddle", values["cable_middle"], unit.place)
        yield _declared("CableHysteresis", values["cable_hysteresis"], f"{unit.force}, half its width")
        yield _declared("CableLength", values["cable_hysteresis_length"], f"{unit.place}, travel to turn it round")
    if block.has("current_offset"):
        yield _declared("InputOffset", values["current_offset_1"], f"{block.input_unit}, that the motor gets besides")


def constant_push(values: dict[str, float], effects: tuple[str, ...]) -> float:
    """The force in N that pushes forwards everywhere. values: SI by name, of a model with these effects."""
    push = values["constant_force"] if "constant_force" in effects else 0.0
    return push + (values["cable_preload"] if "cable_force" in effects else 0.0)


def _table(name: str, row: tuple[float, ...], comment: str) -> Iterator[str]:
    yield f"    {name} : ARRAY[0..{len(row) - 1}] OF LREAL := [ // {comment}"
    texts = [number(float(f"{x:.9g}")) for x in row]
    lines = [", ".join(texts[k : k + _PER_LINE]) for k in range(0, len(texts), _PER_LINE)]
    for line in lines[:-1]:
        yield f"        {line},"
    yield f"        {lines[-1]}];"


def _tables(block: _Block) -> Iterator[str]:
    tables, unit = block.tables, block.units
    if not tables.nodes:
        return
    yield _declared("TableLow", tables.low, f"{unit.place}, position of the tables' first entries")
    yield _declared("TableStep", tables.step, f"{unit.place}, from one entry to the next")
    yield f"    TableLast : DINT := {tables.nodes - 1};"
    if tables.force:
        yield from _table("PlaceForces", tables.force, f"{unit.force}, that push forwards")
    if tables.thrust:
        yield from _table("ThrustFactors", tables.thrust, "1, of the thrust")
    if tables.friction:
        yield from _table("FrictionFactors", tables.friction, "1, of the friction")


_STATES = (
    "    Direction : LREAL; // 1, -1 to 1",
    "    Level : LREAL; // sliding friction",
    "    Scale : LREAL; // 1, of the friction, with its sign",
    "    Push : LREAL; // what is to be overcome besides sliding friction",
    "    Factor : LREAL := 1.0; // 1",
)
_OF_TABLES = ("    Place : LREAL; // in entries", "    Entry : DINT;", "    Part : LREAL; // 1, of the way to the next")
_OF_CABLE = ("    Bend : LREAL; // 1, of the cable chain, -1 to 1", "    LastPosition : LREAL;", "    Started : BOOL;")
_LOOK_UP = (
    "Place := (Position - TableLow) / TableStep;",
    "OutsideTables := Place < 0.0 OR Place > DINT_TO_LREAL(TableLast);",
    "Place := LIMIT(0.0, Place, DINT_TO_LREAL(TableLast));",
    "Entry := MIN(TRUNC(Place), TableLast - 1);",
    "Part := Place - DINT_TO_LREAL(Entry);",
)
_CABLE = (
    "IF NOT Started THEN",
    "    Bend := Direction;",
    "    LastPosition := Position;",
    "    Started := TRUE;",
    "END_IF",
    "IF Position > LastPosition THEN",
    "    Bend := 1.0 + (Bend - 1.0) * EXP((LastPosition - Position) / CableLength);",
    "ELSE",
    "    Bend := -1.0 + (Bend + 1.0) * EXP((Position - LastPosition) / CableLength);",
    "END_IF",
    "LastPosition := Position;",
    "Push := Push + CableStiffness * (Position - CableMiddle) + CableHysteresis * Bend;",
)


def _at_place(name: str) -> str:
    return f"{name}[Entry] + Part * ({name}[Entry + 1] - {name}[Entry])"


def _statements(block: _Block) -> Iterator[str]:
    """The body, in the order in which the forces follow from each other."""
    if block.tables.nodes:
        yield from _LOOK_UP
    yield "Direction := LIMIT(-1.0, Velocity / RampSpeed, 1.0);"
    yield "Push := Mass * Acceleration + Viscous * Velocity - ConstantForce;"
    if block.has("quadratic_drag"):
        yield "Push := Push + Drag * Velocity * DragSpeed * EXPT(ABS(Velocity) / DragSpeed, DragPower - 1.0);"
    if block.has("eddy_current_drag"):
        yield "Push := Push + Eddy * Velocity / (1.0 + Velocity * Velocity / (EddySpeed * EddySpeed));"
    if block.has("asymmetric_friction"):
        yield "Push := Push + ViscousAsymmetry * ABS(Velocity);"
    if block.tables.force:
        yield f"Push := Push - ({_at_place('PlaceForces')});"
    if block.has("cable_force"):
        yield from _CABLE
    curve = "EXP(-EXPT(ABS(Velocity) / StribeckSpeed, StribeckExponent))"
    yield f"Level := Coulomb + (Breakaway - Coulomb) * {curve};"
    yield "Scale := Direction" + (" * (1.0 + Asymmetry * Direction)" if block.has("asymmetric_friction") else "") + ";"
    if block.tables.friction:
        yield f"Scale := Scale * ({_at_place('FrictionFactors')});"
    yield "Force := Push + Scale * Level;"
    if block.has("load_dependent_friction"):
        yield "IF Force > 0.0 THEN"
        yield "    Force := Force / (1.0 - LoadFriction * Scale);"
        yield "ELSE"
        yield "    Force := Force / (1.0 + LoadFriction * Scale);"
        yield "END_IF"
    if block.thrust:
        if block.tables.thrust:
            yield f"Factor := {_at_place('ThrustFactors')};"
        offset = " - InputOffset" if block.has("current_offset") else ""
        yield f"Input := Force / (ForcePerInput * Factor){offset};"


def declaration(exported: Exported, form: FitResult, lacking: tuple[str, ...]) -> tuple[str, str]:
    """Declaration and body of the function block.

    form: the model whose inverse it is; lacking: sentences for the comment at the top.
    """
    values = {e.name: e.value for e in form.estimates}
    unit = units_of(form)
    thrust = thrust_per_current(exported)
    block = _Block(values, form.effects, place_tables(exported), unit, thrust, form.input_unit)
    comment = [f"{exported.name}: what the motor must give along a commanded motion."]
    comment += [f"Not held whole: {line}" for line in lacking]
    comment.append("What that costs on held-out recordings: README.txt and loss.json beside this file.")
    lines = [
        *(f"// {line}" for line in comment),
        f"FUNCTION_BLOCK {NAME}",
        "VAR_INPUT",
        f"    Position : LREAL; // {unit.place}, commanded",
        f"    Velocity : LREAL; // {unit.place}/s, commanded",
        f"    Acceleration : LREAL; // {unit.place}/s^2, commanded",
        "END_VAR",
        "VAR_OUTPUT",
        f"    Force : LREAL; // {unit.force}, that the motor must give",
    ]
    if thrust:
        lines.append(f"    Input : LREAL; // {form.input_unit}, q-current (amplitude) or the drive's one command")
    if block.tables.nodes:
        lines.append("    OutsideTables : BOOL; // the position is beyond the tables, whose ends then hold")
    lines += ["END_VAR", "VAR", *_parameters(block), *_tables(block), *_STATES]
    lines += (_OF_TABLES if block.tables.nodes else ()) + (_OF_CABLE if block.has("cable_force") else ())
    lines += ["END_VAR"]
    return "\n".join(lines) + "\n", "\n".join(_statements(block)) + "\n"
