"""Columns -> channels: which column is the position, a current, ..., and its factor to SI; nothing is guessed."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.errors import DataError, LinidError
from linid.recording.mapping import INPUTS, PHASES, ROLES, VOLTAGES, ChannelMapping, ChannelSpec, Role
from linid.recording.names import axis_of, candidates, looks_like_position, normalised
from linid.recording.recording import Axis
from linid.recording.table import Column, Table
from linid.recording.units import find_unit, unit_of

_SI_LENGTH = {"linear": ("length", "m"), "rotary": ("angle", "rad")}
_SI_SPEED = {"linear": ("velocity", "m/s"), "rotary": ("angular velocity", "rad/s")}


@dataclass(frozen=True)
class Channel:
    """A column with its meaning: SI value = (raw * scale + offset) * factor, in the unit `si`."""

    role: Role
    column: Column
    declared: str
    si: str
    factor: float
    scale: float = 1.0
    offset: float = 0.0

    def to_si(self, raw: Array) -> Array:
        """Values of the file, raw (n,) -> SI, (n,)."""
        return np.asarray((raw * self.scale + self.offset) * self.factor, dtype=np.float64)

    @property
    def text(self) -> str:
        """`declared -> SI` in words."""
        scale = f" x {self.scale:g}" if self.scale != 1.0 else ""
        offset = f" {self.offset:+g}" if self.offset else ""
        return f"{self.column.header}: {self.declared}{scale}{offset} x {self.factor:g} -> {self.si}"


@dataclass(frozen=True)
class Channels:
    """The channels found, and notes on columns that were seen but not used."""

    by_role: dict[Role, Channel]
    notes: tuple[str, ...]

    @property
    def base(self) -> Channel:
        """The channel whose times are the recording's: the position, or the first one of a file without it."""
        return self.by_role.get("position") or next(c for role, c in self.by_role.items() if role != "time")


def resolve(table: Table, mapping: ChannelMapping, axis: Axis, period: float | None) -> Channels:
    """Find every channel by the mapping, else by name; raises DataError when one is missing, ambiguous or without a
    unit.

    period: sampling period in s when given by the caller (then no time column is needed).
    """
    columns = _check_group(table, mapping)
    columns_of, notes = _choose(table, columns, mapping, period is not None or table.period_s is not None)
    if "position" not in columns_of and not (mapping.unmeasured and all(role in columns_of for role in VOLTAGES)):
        others = [column for column in table.columns if looks_like_position(column.name)]
        raise DataError(
            str(table.path),
            "no position column recognised"
            + (f" ({listing(others)}: of something else than the axis, by name)" if others else ""),
            f"Name it in the mapping, `position: {{column: ..., unit: mm}}`. Columns: {listing(table.columns)}.",
        )
    _check_voltages(table, columns_of)
    _refuse_mixed_axes(table, columns_of, mapping)
    found: dict[Role, Channel] = {}
    for role, column in columns_of.items():
        spec = mapping.spec(role)
        if spec is None and role == "velocity" and column.unit is None:
            notes.append(f"velocity column '{column.header}' has no unit and is left out")
            continue
        if spec is None and role == "velocity" and not _fits(column.unit, _dimensions(role, axis)):
            notes.append(f"velocity column '{column.header}' is in {column.unit}, not this axis' speed, and left out")
            continue
        if role == "time" and period is not None:
            notes.append(f"time column '{column.header}' not used: the sampling period is given ({period:g} s)")
            continue
        found[role] = _channel(table, role, column, spec, axis)
    return Channels(found, tuple(notes))


def _refuse_mixed_axes(table: Table, columns_of: dict[Role, Column], mapping: ChannelMapping) -> None:
    """Channels whose names say that they belong to different axes are one recording only if the user says so."""
    tags = {role: tag for role, column in columns_of.items() if role != "time" and (tag := axis_of(column.name))}
    known = {tag for role, tag in tags.items() if mapping.spec(role) is not None}
    known = known or {tag for role, tag in tags.items() if role == "position"}
    odd = next((role for role, tag in tags.items() if tag not in known and mapping.spec(role) is None), None)
    if odd is None or not known:
        return
    other = next(role for role, tag in tags.items() if tag in known)
    raise DataError(
        str(table.path),
        f"channels of two axes by their names: '{columns_of[other].header}' ({other}) and "
        f"'{columns_of[odd].header}' ({odd})",
        f"Name both in the mapping, `{other}: ...` and `{odd}: ...`. Columns: {listing(table.columns)}.",
    )


def used_columns(table: Table, mapping: ChannelMapping, axis: Axis, period: float | None) -> set[int] | None:
    """Numbers (from 0) of the columns that channels and clocks take, which need no values to be told; None: all, where
    `resolve` will refuse the table. period: as in `resolve`.
    """
    try:
        channels = resolve(table, mapping, axis, period)
    except LinidError:
        return None
    taken = {id(channel.column) for channel in channels.by_role.values()}
    return {k for k, column in enumerate(table.columns) if column.time or id(column) in taken}


def _check_voltages(table: Table, columns_of: dict[Role, Column]) -> None:
    missing = [role for role in VOLTAGES if role not in columns_of]
    if len(missing) in (1, 2):
        raise DataError(
            str(table.path),
            f"found {3 - len(missing)} of the three phase voltages ({' and '.join(missing)} missing)",
            "Log and map all three, for they need not sum to zero, or map the currents alone.",
        )


def listing(columns: Iterable[Column]) -> str:
    """The columns' names for a message."""
    names = [f"'{column.header}'" for column in columns if column.header]
    return ", ".join(names[:25]) + (f" and {len(names) - 25} more" if len(names) > 25 else "")


def _check_group(table: Table, mapping: ChannelMapping) -> list[Column]:
    if mapping.time_group is not None and mapping.time_group > table.groups:
        raise DataError(
            str(table.path),
            f"time_group {mapping.time_group} asked for, the file has {table.groups}",
            f"Give a number from 1 to {table.groups}.",
        )
    return list(table.columns)


def _choose(
    table: Table, columns: list[Column], mapping: ChannelMapping, has_period: bool
) -> tuple[dict[Role, Column], list[str]]:
    """One column per channel."""
    chosen: dict[Role, Column] = {}
    notes: list[str] = []
    for role in ROLES:
        spec = mapping.spec(role)
        if spec is not None:
            chosen[role] = _by_mapping(table, role, spec)
    # Mapped currents or a mapped command are all that the user wants to drive with; voltages come beside currents.
    known: set[Role] = {"time"}
    if any(role in chosen for role in INPUTS if role not in VOLTAGES):
        known |= set(INPUTS)
    elif any(role in chosen for role in VOLTAGES):
        known |= set(VOLTAGES)
    taken = {id(column) for column in chosen.values()}
    free = [column for column in columns if column.numeric and id(column) not in taken]
    by_name = candidates([column.name for column in free])
    for role in ROLES:
        fitting = [free[i] for i in by_name.get(role, ())]
        if role == "position" and mapping.time_group is not None:
            fitting = [column for column in fitting if column.group == mapping.time_group - 1]
        if role in chosen or role in known or not fitting:
            continue
        if len(fitting) == 1:
            chosen[role] = fitting[0]
        elif role == "velocity" or (role == "command" and any(r in chosen for r in INPUTS)):
            notes.append(f"several columns could be the {role}, none is read: {listing(fitting)}")
        else:
            raise _ambiguous(table, role, fitting)
    if "command" in chosen and "current_q" in chosen and mapping.command is None:
        notes.append(f"column '{chosen.pop('command').header}' not used: the measured current is")
    elif "command" in chosen and any(r in chosen for r in PHASES) and mapping.command is None:
        notes.append(f"column '{chosen.pop('command').header}' not used: the phase currents are")
    timed = chosen.get("position") or chosen.get(VOLTAGES[0])
    if "time" not in chosen and timed is not None:
        clock = _clock(table, timed, has_period)
        if clock is not None:
            chosen["time"] = clock
    return chosen, notes


def _clock(table: Table, position: Column, has_period: bool) -> Column | None:
    clocks = [c for c in table.columns if c.time and c.group == position.group and c.numeric]
    if len(clocks) > 1:
        raise _ambiguous(table, "time", clocks)
    if not clocks and not has_period:
        texts = listing(c for c in table.columns if c.time and not c.numeric)
        raise DataError(
            str(table.path),
            "no time column recognised and no sampling period given"
            + (f" (clock times and text are not read: {texts})" if texts else ""),
            "Give `time: {column: ..., unit: ms}` or `period: 1 ms` in the mapping. "
            f"Columns: {listing(table.columns)}.",
        )
    return clocks[0] if clocks else None


def _ambiguous(table: Table, role: Role, fitting: list[Column]) -> DataError:
    numbers = [f"'{c.header}' (#{1 + next(i for i, x in enumerate(table.columns) if x is c)})" for c in fitting]
    return DataError(
        f"{table.path}, line {table.header_line}" if table.header_line else str(table.path),
        f"ambiguous: {len(fitting)} columns could be the channel {role}: {', '.join(numbers)}",
        f"Name one in the mapping, such as `{role}: '#{numbers[0].rsplit('#', 1)[1].rstrip(')')}'`.",
    )


def _by_mapping(table: Table, role: Role, spec: ChannelSpec) -> Column:
    """The column that the mapping names: #number, header, name or alias, else without regard to case and blanks."""
    wanted = spec.column.strip()
    if wanted.startswith("#") and wanted[1:].isdigit() and 1 <= int(wanted[1:]) <= len(table.columns):
        return table.columns[int(wanted[1:]) - 1]
    for same in (lambda a: a == wanted, lambda a: normalised(a) == normalised(wanted) != ""):
        hits = [c for c in table.columns if any(same(text) for text in (c.header, c.name, *c.aliases))]
        if len(hits) == 1:
            return hits[0]
        if hits:
            raise _ambiguous(table, role, hits)
    names = [text for c in table.columns for text in {c.header, c.name, *c.aliases}]
    near = difflib.get_close_matches(wanted, names, n=2, cutoff=0.5)
    hint = f"Did you mean {' or '.join(repr(n) for n in near)}? " if near else ""
    raise DataError(
        f"{table.path}, line {table.header_line}" if table.header_line else str(table.path),
        f"column '{wanted}' (channel {role}) is not in the file",
        f"{hint}Columns: {listing(table.columns)}.",
    )


def _channel(table: Table, role: Role, column: Column, spec: ChannelSpec | None, axis: Axis) -> Channel:
    place = f"{table.path}, column '{column.header}'"
    declared = (spec.unit if spec else None) or column.unit
    if not declared:
        example = {"time": "ms", "position": "mm" if axis == "linear" else "rad", "velocity": "mm/s", "command": "V"}
        example["reference"] = example["simulated"] = example["position"]
        usual = example.get(role, "V" if role in VOLTAGES else "A")
        raise DataError(
            place,
            f"no unit declared for the channel {role}, neither in the header nor in the mapping",
            f"Write '{column.name} ({usual})' in the header, or "
            f"`{role}: {{column: {column.name}, unit: {usual}}}` in the mapping, with the true unit.",
        )
    dimensions = _dimensions(role, axis)
    unit = unit_of(declared, place, dimensions)
    scale = _number(table, spec.scale if spec else 1.0, place)
    offset = _number(table, spec.offset if spec else 0.0, place)
    if unit.dimension == "count":
        si = _si(role, axis)
        if spec is None or "scale" not in spec.model_fields_set:
            raise DataError(
                place,
                f"channel {role} is in {declared}, without a scale",
                f"Give `{role}: {{column: {column.name}, unit: counts, scale: ...}}` with the scale in {si} per count.",
            )
        return Channel(role, column, declared, si, 1.0, scale, offset)
    return Channel(role, column, declared, unit.si, unit.factor, scale, offset)


def _fits(text: str | None, dimensions: tuple[str, ...]) -> bool:
    """Whether a declared unit is of one of the dimensions, or unknown, which is refused later."""
    unit = find_unit(text or "")
    return unit is None or unit.dimension in (*dimensions, "count")


def _dimensions(role: Role, axis: Axis) -> tuple[str, ...]:
    fixed: dict[str, tuple[str, ...]] = {
        "time": ("time",),
        "position": (_SI_LENGTH[axis][0],),
        "reference": (_SI_LENGTH[axis][0],),
        "simulated": (_SI_LENGTH[axis][0],),
        "velocity": (_SI_SPEED[axis][0],),
        "command": ("voltage", "current", "force", "torque", "ratio"),
    }
    return fixed.get(role, ("voltage",) if role in VOLTAGES else ("current",))


def _si(role: Role, axis: Axis) -> str:
    length = _SI_LENGTH[axis][1]
    fixed = dict.fromkeys(("position", "reference", "simulated"), length)
    fixed |= {"time": "s", "velocity": _SI_SPEED[axis][1], "command": "1"}
    return fixed.get(role, "V" if role in VOLTAGES else "A")


def _number(table: Table, value: float | str, place: str) -> float:
    """A number, or a scalar variable of the .mat file by name."""
    if not isinstance(value, str):
        return float(value)
    try:
        number = float(value)
    except ValueError:
        number = table.scalars.get(value, math.nan)
    if math.isfinite(number):
        return number
    known = ", ".join(table.scalars) or "none"
    raise DataError(
        place, f"scale or offset '{value}' is neither a number nor a scalar in the file", f"Scalars: {known}."
    )
