"""Scope export layouts as text: generic, TwinCAT Scope, Elmo recorder, ControlDesk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from linid.arrays import Array

Rows = list[list[str]]

PHASES = ("U", "V", "W")


@dataclass(frozen=True)
class Table:
    """What one scope export shows, in its units; period_ms: ms.

    time_ms, position_mm: (n,) in ms and mm; currents_a: (3, n) in A; voltages_v: (3, n) in V and reference_mm: (n,) in
    mm, the set position, where the drive logs them.
    """

    name: str
    period_ms: float
    time_ms: Array
    position_mm: Array
    currents_a: Array
    position_decimals: int
    current_decimals: int
    voltages_v: Array | None = None
    voltage_decimals: int = 0
    reference_mm: Array | None = None


class Column(NamedTuple):
    """One quantity's column after time and position: kind, phase (none: the set position), unit, values as text."""

    kind: str
    phase: str
    unit: str
    values: list[str]

    @property
    def label(self) -> str:
        """Such as `Phase Current U`."""
        return f"Phase {self.kind} {self.phase}" if self.phase else "Set Position"

    @property
    def channel(self) -> str:
        """Such as `PhaseCurrentU`."""
        return f"Phase{self.kind}{self.phase}" if self.phase else "SetPos"


def write_table(table: Table, layout: str, decimal_mark: str) -> str:
    """The text of one export in a layout of LAYOUTS, with '.' or ',' as decimal mark."""
    return LAYOUTS[layout](table, decimal_mark)


def _columns(table: Table, decimal_mark: str) -> tuple[list[str], list[str], list[Column]]:
    """Time and position as text, then the columns of the phases."""

    def text(values: Array, places: int) -> list[str]:
        return [f"{value:.{places}f}".replace(".", decimal_mark) for value in values]

    quantities = [("Current", "A", table.currents_a, table.current_decimals)]
    if table.voltages_v is not None:
        quantities.append(("Voltage", "V", table.voltages_v, table.voltage_decimals))
    columns = [
        Column(kind, phase, unit, text(row, places))
        for kind, unit, rows, places in quantities
        for phase, row in zip(PHASES, rows, strict=True)
    ]
    if table.reference_mm is not None:
        columns.append(Column("Length", "", "mm", text(table.reference_mm, table.position_decimals)))
    return text(table.time_ms, 3), text(table.position_mm, table.position_decimals), columns


def _rows(t: list[str], y: list[str], phases: list[Column]) -> Rows:
    return [list(row) for row in zip(t, y, *(column.values for column in phases), strict=True)]


def _join(rows: Rows, separator: str, end: str = "") -> str:
    return "".join(separator.join(row) + end + "\n" for row in rows)


def _separator(decimal_mark: str) -> str:
    return "," if decimal_mark == "." else ";"


def _generic(table: Table, decimal_mark: str) -> str:
    """One header line with units; a comma separates, or a semicolon where the comma is the decimal mark."""
    t, y, phases = _columns(table, decimal_mark)
    header = ["Time (ms)", "Actual Position (mm)", *(f"{column.label} ({column.unit})" for column in phases)]
    return _join([header, *_rows(t, y, phases)], _separator(decimal_mark))


def _twincat(table: Table, decimal_mark: str) -> str:
    """Tab-separated; a keyed header block with one key/value pair per channel, and a time column per channel."""
    t, y, phases = _columns(table, decimal_mark)
    channels = ("ActPos", *(column.channel for column in phases))
    period = f"{table.period_ms:g}".replace(".", decimal_mark)
    keyed = {
        "Name": channels,
        "SymbolComment": ("Actual Position", *(column.label for column in phases)),
        "Data-Type": ("REAL64",) * len(channels),
        "SampleTime[ms]": (period,) * len(channels),
        "SymbolName": tuple(f"Axis.{channel}" for channel in channels),
        "Offset": ("0",) * len(channels),
        "ScaleFactor": ("1",) * len(channels),
        "Unit": ("mm (Length)", *(f"{column.unit} ({column.kind})" for column in phases)),
    }
    head: Rows = [["Name", table.name], ["File", f"{table.name}.csv"], [], []]
    block = [[cell for value in values for cell in (key, value)] for key, values in keyed.items()]
    body = [[cell for value in values for cell in (instant, value)] for instant, *values in _rows(t, y, phases)]
    return _join([*head, *block, [], *body], "\t")


def _elmo(table: Table, decimal_mark: str) -> str:
    """Bracketed sections; every line of the data section ends with the separator."""
    t, y, phases = _columns(table, decimal_mark)
    separator = _separator(decimal_mark)
    period = f"{table.period_ms / 1e3:g}".replace(".", decimal_mark)
    head: Rows = [
        ["[Recorder]"],
        ["Name", table.name],
        ["Sampling Time (s)", period],
        ["Samples", str(len(t))],
        ["[Data]"],
        ["Time (ms)", "Position (mm)", *(f"{column.label} ({column.unit})" for column in phases)],
    ]
    return _join(head[:-1], separator) + _join([head[-1], *_rows(t, y, phases)], separator, separator)


def _controldesk(table: Table, decimal_mark: str) -> str:
    """Labelled rows of variable paths and units; the row label trace_values starts the numbers."""
    t, y, phases = _columns(table, decimal_mark)
    labelled: Rows = [
        ["path", "Time", "Axis/Actual Position", *(f"Axis/{column.label}" for column in phases)],
        ["unit", "ms", "mm", *(column.unit for column in phases)],
    ]
    body = [["", *row] for row in _rows(t, y, phases)]
    body[0][0] = "trace_values"
    return _join([*labelled, *body], _separator(decimal_mark))


# How the column of the set position is called.
SET_POSITION = {
    "generic": "Set Position",
    "twincat": "SetPos",
    "elmo": "Set Position",
    "controldesk": "Axis/Set Position",
}
LAYOUTS: dict[str, Callable[[Table, str], str]] = {
    "generic": _generic,
    "twincat": _twincat,
    "elmo": _elmo,
    "controldesk": _controldesk,
}
