"""Scope export layouts as text: generic, TwinCAT Scope, Elmo recorder, ControlDesk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = list[list[str]]

PHASES = ("U", "V", "W")


@dataclass(frozen=True)
class Table:
    """What one scope export shows, in its units: time and period in ms, position in mm, currents (3, n) in A."""

    name: str
    period_ms: float
    time_ms: Array
    position_mm: Array
    currents_a: Array
    position_decimals: int
    current_decimals: int


def write_table(table: Table, layout: str, decimal_mark: str) -> str:
    """The text of one export in a layout of LAYOUTS, with '.' or ',' as decimal mark."""
    return LAYOUTS[layout](table, decimal_mark)


def _columns(table: Table, decimal_mark: str) -> tuple[list[str], list[str], list[list[str]]]:
    """Time, position and the three currents as text."""

    def text(values: Array, places: int) -> list[str]:
        return [f"{value:.{places}f}".replace(".", decimal_mark) for value in values]

    return (
        text(table.time_ms, 3),
        text(table.position_mm, table.position_decimals),
        [text(current, table.current_decimals) for current in table.currents_a],
    )


def _join(rows: Rows, separator: str, end: str = "") -> str:
    return "".join(separator.join(row) + end + "\n" for row in rows)


def _separator(decimal_mark: str) -> str:
    return "," if decimal_mark == "." else ";"


def _generic(table: Table, decimal_mark: str) -> str:
    """One header line with units; a comma separates, or a semicolon where the comma is the decimal mark."""
    t, y, currents = _columns(table, decimal_mark)
    header = ["Time (ms)", "Actual Position (mm)", *(f"Phase Current {phase} (A)" for phase in PHASES)]
    return _join([header, *map(list, zip(t, y, *currents, strict=True))], _separator(decimal_mark))


def _twincat(table: Table, decimal_mark: str) -> str:
    """Tab-separated; a keyed header block with one key/value pair per channel, and a time column per channel."""
    t, y, currents = _columns(table, decimal_mark)
    channels = ("ActPos", *(f"PhaseCurrent{phase}" for phase in PHASES))
    period = f"{table.period_ms:g}".replace(".", decimal_mark)
    keyed = {
        "Name": channels,
        "SymbolComment": ("Actual Position", *(f"Phase Current {phase}" for phase in PHASES)),
        "Data-Type": ("REAL64",) * 4,
        "SampleTime[ms]": (period,) * 4,
        "SymbolName": tuple(f"Axis.{channel}" for channel in channels),
        "Offset": ("0",) * 4,
        "ScaleFactor": ("1",) * 4,
        "Unit": ("mm (Length)", "A (Current)", "A (Current)", "A (Current)"),
    }
    head: Rows = [["Name", table.name], ["File", f"{table.name}.csv"], [], []]
    block = [[cell for value in values for cell in (key, value)] for key, values in keyed.items()]
    body = [
        [instant, p, instant, u, instant, v, instant, w] for instant, p, u, v, w in zip(t, y, *currents, strict=True)
    ]
    return _join([*head, *block, [], *body], "\t")


def _elmo(table: Table, decimal_mark: str) -> str:
    """Bracketed sections; every line of the data section ends with the separator."""
    t, y, currents = _columns(table, decimal_mark)
    separator = _separator(decimal_mark)
    period = f"{table.period_ms / 1e3:g}".replace(".", decimal_mark)
    head: Rows = [
        ["[Recorder]"],
        ["Name", table.name],
        ["Sampling Time (s)", period],
        ["Samples", str(len(t))],
        ["[Data]"],
        ["Time (ms)", "Position (mm)", *(f"Phase Current {phase} (A)" for phase in PHASES)],
    ]
    body = list(map(list, zip(t, y, *currents, strict=True)))
    return _join(head[:-1], separator) + _join([head[-1], *body], separator, separator)


def _controldesk(table: Table, decimal_mark: str) -> str:
    """Labelled rows of variable paths and units; the row label trace_values starts the numbers."""
    t, y, currents = _columns(table, decimal_mark)
    labelled: Rows = [
        ["path", "Time", "Axis/Actual Position", *(f"Axis/Phase Current {phase}" for phase in PHASES)],
        ["unit", "ms", "mm", "A", "A", "A"],
    ]
    body = [["", *row] for row in zip(t, y, *currents, strict=True)]
    body[0][0] = "trace_values"
    return _join([*labelled, *body], _separator(decimal_mark))


LAYOUTS: dict[str, Callable[[Table, str], str]] = {
    "generic": _generic,
    "twincat": _twincat,
    "elmo": _elmo,
    "controldesk": _controldesk,
}
