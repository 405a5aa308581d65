"""TwinCAT Scope exports whose separator is a blank: names and units hold blanks too, and empty cells are blanks.

What cannot be told from a row itself is told by the rows of the header whose cells never hold blanks.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from linid.errors import DataError

_PLAIN_KEYS = ("Data-Type", "SampleTime[ms]", "VariableSize", "IndexOffset", "Port", "ScaleFactor", "Offset")
_UNIT = re.compile(r"(?:[^\s()]+ )?\([^()]*\)")
_MOST_LINES = 60


def with_tabs(lines: Sequence[str], keys: frozenset[str], place: str) -> tuple[list[str], list[str]]:
    """The same export with tabs between its cells, and notes; keys: of the header's rows. Raises DataError where the
    header has no row of names or a row does not fit it.
    """
    head = lines[:_MOST_LINES]
    found = {i: key for i, line in enumerate(head) if (key := _key(line, keys))}
    layout = next((split_blanks(head[i], key) for i, key in found.items() if key in _PLAIN_KEYS), None)
    if layout is None:
        named = next((head[i] for i, key in found.items() if key == "Name"), None)
        if named is None:
            raise DataError(
                place, "no row of channel names (`Name`) in the header", "Export with the header's Name row."
            )
        layout = split_blanks(named, "Name")
    starts = [k for k, cell in enumerate(layout) if k == 0 or cell == layout[0]]
    widths = [b - a - 1 for a, b in zip(starts, [*starts[1:], len(layout)], strict=True)]
    symbols = next((split_blanks(head[i], key) for i, key in found.items() if key == "SymbolName"), None)
    notes: list[str] = []
    out: list[str] = []
    for i, line in enumerate(lines):
        key = found.get(i)
        if key is None:
            out.append(_row(line, starts, len(layout), f"{place}, line {i + 1}") if line.strip() else "")
        elif key == "Name" and line.count(" Name ") + 1 == len(widths) and (i > 3 or len(layout) > 2):
            out.append("\t".join(_names(line, widths, symbols, notes)))
        elif key == "Unit":
            out.append("\t".join(_units(line, len(layout), starts)))
        else:
            out.append("\t".join(split_blanks(line, key)))
    return out, notes


def _key(line: str, keys: frozenset[str]) -> str | None:
    text = line.lstrip("\ufeff").replace('"', "")
    return next((key for key in sorted(keys, key=len, reverse=True) if text == key or text.startswith(key + " ")), None)


def split_blanks(line: str, key: str) -> list[str]:
    """Cells of a header row, every blank a separator; its key, which may hold blanks, is one cell."""
    text = line.lstrip("\ufeff").replace('"', "")
    joined = key.replace(" ", "\x01")
    return [cell.replace("\x01", " ") for cell in text.replace(key, joined).split(" ")]


def _names(line: str, widths: Sequence[int], symbols: Sequence[str] | None, notes: list[str]) -> list[str]:
    """Key and names of each group; several names that hold blanks cannot be told apart and give way to symbols."""
    groups = [part.strip() for part in re.split(r"(?:^|(?<= ))Name(?= |$)", line.strip())][1:]
    out: list[str] = []
    for text, width in zip(groups, widths, strict=True):
        tokens = text.split(" ")
        if width == 1:
            tokens = [text]
        elif len(tokens) != width:
            at = len(out) + 1
            own = list(symbols[at : at + width]) if symbols is not None and len(symbols) >= at + width else []
            tokens = [own[k] if k < len(own) else f"channel {k + 1}" for k in range(width)]
            notes.append(
                f"names of {width} channels hold blanks, which separate cells too: these channels go by their symbols "
                "(export with tab or semicolon to keep the names)"
            )
        out += ["Name", *tokens]
    return out


def _units(line: str, fields: int, starts: Sequence[int]) -> list[str]:
    units = iter(_UNIT.findall(re.sub(r"(?:^| )Unit(?= )", "", line)))
    return ["Unit" if k in starts else next(units, "") for k in range(fields)]


def _row(line: str, starts: Sequence[int], fields: int, place: str) -> str:
    """A row of samples; where cells are missing, their places are told by the blanks that stand for them: groups that
    have ended lack all their cells."""
    cells = line.split()
    if len(cells) >= fields or (line[0] != " " and "  " not in line.rstrip()):
        return "\t".join(cells)  # whole, or cut short at its end
    leading = line[0] == " "
    runs = [len(run) for run in re.findall(r" +", line.rstrip())]
    for width in (1, 2):  # an empty cell is nothing between two separators, or a blank between them
        blanks = [divmod(run if leading and k == 0 else run - 1, width) for k, run in enumerate(runs)]
        if any(rest for _, rest in blanks):
            continue
        counts = [count for count, _ in blanks]
        row = [""] * counts.pop(0) if leading else []
        for cell, count in zip(cells, [*counts, 0], strict=True):
            row += [cell, *[""] * count]
        row += [""] * (fields - len(row))
        groups = [row[a:b] for a, b in zip(starts, [*starts[1:], fields], strict=True)]
        if len(row) == fields and all(all(group) or not any(group) for group in groups):
            return "\t".join(row)
    raise DataError(
        place,
        f"{len(cells)} of {fields} cells, and the blanks do not tell which",
        "Export with tab or semicolon as separator.",
    )
