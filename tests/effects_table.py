"""The table in docs/reference/effects.md, made from the registry: `python -m tests.effects_table` writes it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import BUILT_IN

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "effects.md"
BEGIN, END = "<!-- effects: begin -->\n", "<!-- effects: end -->\n"


def effects_table(effects: Iterable[Effect]) -> str:
    """Markdown table of name, slot, physics and what shows it."""
    rows = ["| effect | slot | physics | shown by |", "|---|---|---|---|"]
    for effect in effects:
        cells = (f"`{effect.name}`", effect.slot, effect.physics.replace("|", "\\|"), effect.exposed_by)
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def between_markers(text: str) -> str:
    """The table as it stands in the page's text."""
    return text.split(BEGIN)[1].split(END)[0]


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(text.replace(between_markers(text), effects_table(BUILT_IN)), encoding="utf-8")


if __name__ == "__main__":
    main()
