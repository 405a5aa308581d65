"""What the reader understood of a file, and a starter mapping for what it did not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linid.errors import LinidError
from linid.recording.assemble import assemble
from linid.recording.mapping import INPUTS, ROLES, ChannelMapping, Role
from linid.recording.names import candidates
from linid.recording.readers.registry import read_table
from linid.recording.recording import Axis
from linid.recording.resolve import Channel, resolve
from linid.recording.table import Column, Table
from linid.recording.timebase import jitter
from linid.recording.units import find_unit


@dataclass(frozen=True)
class InspectedColumn:
    """One column: channel (None: unused), declared unit, factor to SI, SI unit. minimum, maximum: SI (raw where
    unmapped).
    """

    number: int
    header: str
    name: str
    group: int
    channel: str | None
    declared: str | None
    si: str | None
    factor: float | None
    minimum: float
    maximum: float
    unreadable: int
    text: str


@dataclass(frozen=True)
class Inspection:
    """What was understood of a file; `problem` says why it cannot be read yet (None: it can).

    header_line, first_data_line: from 1 (0: none); t_start, t_end, period: s; rate in Hz; jitter as a share of the
    period; groups: time groups.
    """

    path: Path
    layout: str
    encoding: str
    dialect: str
    header_line: int
    first_data_line: int
    rows: int
    groups: int
    group_columns: tuple[tuple[str, ...], ...]
    period: float | None
    rate: float | None
    jitter: float | None
    t_start: float | None
    t_end: float | None
    columns: tuple[InspectedColumn, ...]
    notes: tuple[str, ...]
    problem: str | None
    sha256: str


def inspect_file(path: str | Path, channels: ChannelMapping | None = None, axis: Axis | None = None) -> Inspection:
    """Read a file as far as it can be understood; a missing or ambiguous channel is reported, not raised.

    axis: None takes rotary when the position is declared as an angle. Raises DataError only when no table of numbers
    can be read at all.
    """
    path = Path(path)
    mapping = channels or ChannelMapping()
    table = read_table(path, mapping)
    axis = axis or _axis(table, mapping)
    found: dict[Role, Channel] = {}
    notes = list(table.notes)
    problem: str | None = None
    t = None
    try:
        resolved = resolve(table, mapping, axis, mapping.period_s)
        found = dict(resolved.by_role)
        signals = assemble(table, resolved, mapping.period_s)
        t = signals.values["time"]
        notes += [*resolved.notes, *signals.notes]
    except LinidError as error:
        problem = str(error)
    roles = {id(channel.column): channel for channel in found.values()}
    uneven = jitter(t) if t is not None and len(t) > 2 else None
    period = float(np.median(np.diff(t))) if t is not None and len(t) > 1 else None
    return Inspection(
        path=path,
        layout=table.layout,
        encoding=table.encoding,
        dialect=table.dialect,
        header_line=table.header_line,
        first_data_line=table.first_line,
        rows=max((len(c.values) for c in table.columns), default=0),
        groups=table.groups,
        group_columns=tuple(tuple(c.header for c in table.columns if c.group == g) for g in range(table.groups)),
        period=period,
        rate=1.0 / period if period else None,
        jitter=uneven,
        t_start=float(t[0]) if t is not None else None,
        t_end=float(t[-1]) if t is not None else None,
        columns=tuple(_inspected(k, c, roles.get(id(c))) for k, c in enumerate(table.columns)),
        notes=tuple(notes),
        problem=problem,
        sha256=table.sha256,
    )


def _axis(table: Table, mapping: ChannelMapping) -> Axis:
    units = [mapping.position.unit] if mapping.position and mapping.position.unit else []
    names = candidates([c.name for c in table.columns])
    units += [unit for i in names["position"] if (unit := table.columns[i].unit)]
    dimensions = [found.dimension for unit in units[:1] if (found := find_unit(unit))]
    return "rotary" if dimensions == ["angle"] else "linear"


def _inspected(number: int, column: Column, channel: Channel | None) -> InspectedColumn:
    finite = column.values[np.isfinite(column.values)] if column.numeric else np.array([])
    values = channel.to_si(finite) if channel is not None else finite
    low, high = (float(values.min()), float(values.max())) if len(values) else (float("nan"), float("nan"))
    return InspectedColumn(
        number=number + 1,
        header=column.header,
        name=column.name,
        group=column.group + 1,
        channel=channel.role if channel else None,
        declared=channel.declared if channel else column.unit,
        si=channel.si if channel else None,
        factor=channel.factor * channel.scale if channel else None,
        minimum=low,
        maximum=high,
        unreadable=int((~np.isfinite(column.values)).sum()) if column.numeric else 0,
        text=channel.text if channel else f"{column.header}: not used",
    )


def starter_mapping(inspection: Inspection) -> str:
    """A `channels:` section in YAML: what was recognised filled in, the rest as TODO lines with candidates."""
    lines = [f"# Starter mapping for {inspection.path.name}; check every line, then use it in a campaign.", "channels:"]
    if inspection.problem:
        lines.insert(1, f"# Not readable yet: {_one_line(inspection.problem)}")
    mapped = {column.channel: column for column in inspection.columns if column.channel}
    guesses = candidates([column.name for column in inspection.columns])
    inputs = [role for role in INPUTS if role in mapped]
    for role in ROLES:
        column = mapped.get(role)
        if column is not None:
            lines.append(
                _entry(
                    role, column, column.declared or "TODO", f"{column.minimum:.4g} to {column.maximum:.4g} {column.si}"
                )
            )
            continue
        fitting = [inspection.columns[i] for i in guesses.get(role, ())]
        if fitting:
            others = ", ".join(f"#{c.number}" for c in fitting[1:])
            comment = "TODO: check" + (f"; also possible: {others}" if others else "")
            if fitting[0].declared is None:
                comment += "; fill in the unit"
            optional = "# " if role == "velocity" or (inputs and role in INPUTS) else ""
            lines.append(_entry(role, fitting[0], fitting[0].declared or "TODO", comment, optional))
        elif role in ("time", "position"):
            lines.append(f"  {role}: {{column: TODO, unit: TODO}}  # TODO: one of the columns below")
    if not inputs and not any(guesses[role] for role in INPUTS):
        lines.append("  # current_u: {column: TODO, unit: A}  # TODO: phase currents (two suffice), or instead")
        lines.append("  # voltage_u: {column: TODO, unit: V}  # TODO: phase voltages (all three), or")
        lines.append("  # current_q: {column: TODO, unit: A}  # TODO: the q-current, or")
        lines.append(
            "  # command: {column: TODO, unit: V}    # TODO: the command (none of them: a free-wheel recording)"
        )
    if "time" not in mapped and not guesses["time"]:
        lines.append("  # period: 1 ms  # TODO: instead of `time`, if the file has no time column")
    unused = [c for c in inspection.columns if c.channel is None]
    if unused:
        lines.append("# Columns not used:")
        lines += [
            f"#   #{c.number} {_quoted(c.header)}: {c.declared or 'no unit'}, {c.minimum:.6g} to {c.maximum:.6g}"
            for c in unused
        ]
    return "\n".join(lines) + "\n"


def _entry(role: str, column: InspectedColumn, unit: str, comment: str, prefix: str = "") -> str:
    return f"  {prefix}{role}: {{column: {_quoted(column.header)}, unit: {_quoted(unit)}}}  # {_one_line(comment)}"


def _quoted(text: str) -> str:
    """A YAML double-quoted scalar."""
    import json

    return json.dumps(text, ensure_ascii=False)


def _one_line(text: str) -> str:
    return " ".join(text.split())
