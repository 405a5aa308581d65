"""Rows of the page as it stands: a peer that a run left out keeps those of an earlier run, with date and machine."""

from __future__ import annotations

import re
from pathlib import Path

_RUN = re.compile(r"^(\d{4}-\d\d-\d\d), ([^,]+), one core")
_MARKED = re.compile(r"^(.*) \((\d{4}-\d\d-\d\d, [^)]+)\)$")
Rows = dict[tuple[str, str], list[str]]


def earlier_rows(page: Path) -> Rows:
    """(bold beginning of a table's paragraph, first cell) -> cells of every row, the first one marked with the run."""
    rows: Rows = {}
    if not page.exists():
        return rows
    run, title = "", ""
    for line in page.read_text(encoding="utf-8").splitlines():
        if found := _RUN.match(line):
            run = f"{found[1]}, {found[2]}"
        elif line.startswith("**"):
            title = line.split("**")[1]
        elif line.startswith("| ") and title and run:
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            marked = _MARKED.match(cells[0])
            name = marked[1] if marked else cells[0]
            rows[title, name] = [f"{name} ({marked[2] if marked else run})", *cells[1:]]
    return rows
