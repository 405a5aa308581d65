"""The README's table of effects, made from the registry: `python -m tests.readme_effects` writes it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import BUILT_IN

README = Path(__file__).parents[1] / "README.md"
BEGIN, END = "<!-- effects: begin -->\n", "<!-- effects: end -->\n"


def effects_table(effects: Iterable[Effect]) -> str:
    """Markdown table of name, slot, physics and amplitudes."""
    rows = ["| effect | slot | physics | shown by |", "|---|---|---|---|"]
    for effect in effects:
        cells = (f"`{effect.name}`", effect.slot, effect.physics.replace("|", "\\|"), effect.exposed_by)
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def between_markers(text: str) -> str:
    """The table as it stands in the README's text."""
    return text.split(BEGIN)[1].split(END)[0]


def main() -> None:
    text = README.read_text(encoding="utf-8")
    README.write_text(text.replace(between_markers(text), effects_table(BUILT_IN)), encoding="utf-8")


if __name__ == "__main__":
    main()
