"""The paper's claims, tables and figures on one self-contained page, and the claims as Markdown."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from linid.report.reproduction.tables import Table
from linid.report.symbols import symbol_parts
from linid.reproduction.claim import Claim
from linid.reproduction.claims import Impossible


@dataclass(frozen=True)
class Picture:
    """A counterpart of a figure. png: its content."""

    title: str
    stem: str
    png: bytes


def page_html(
    name: str,
    claims: Sequence[Claim],
    impossible: Sequence[Impossible],
    tables: Sequence[Table],
    pictures: Sequence[Picture],
) -> str:
    """The whole page; it needs neither network nor scripts."""
    import jinja2

    folder = files("linid.report.reproduction")
    source = (folder / "page.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["parts"] = symbol_parts
    images = [(p.title, p.stem, base64.b64encode(p.png).decode("ascii")) for p in pictures]
    return environment.from_string(source).render(
        name=name, claims=claims, impossible=impossible, tables=tables, images=images
    )


def page_markdown(name: str, claims: Sequence[Claim], impossible: Sequence[Impossible]) -> str:
    """Claims and impossible numbers as Markdown tables."""
    lines = [f"# The paper's claims and what was found on {name}", ""]
    lines += _markdown(
        ("Claim", "Where", "Verdict", "Found", "Why"),
        [(c.claim, c.source, f"**{c.verdict}**", c.found, c.reason) for c in claims],
    )
    lines += ["", "# Numbers that cannot be as printed", ""]
    lines += _markdown(
        ("What", "Printed", "What speaks against it", "Meant"),
        [(i.what, i.printed, i.against, i.meant) for i in impossible],
    )
    return "\n".join(lines) + "\n"


def _markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    return [line(header), line(["---"] * len(header)), *(line(row) for row in rows)]
