"""A diagnosis as Markdown, for a terminal or a pull request."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from linid.report.diagnosis_content import (
    CLOSURE_MEANING,
    MEASURE_MEANING,
    STATUS_WORDS,
    MeasureLine,
    by_share,
    ceiling_words,
    changed,
    chosen,
    effect_meanings,
    held_out,
    measure_lines,
    p_words,
    rank_lines,
    share_words,
    totals,
)
from linid.report.numbers import estimate_text, interval_text
from linid.report.symbols import unit_label
from linid.report.tables import rounded

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis

ROLE_WORDS = {"cause": "named", "equivalent": "explains as much", "": ""}


def diagnosis_markdown(diagnosis: Diagnosis, pictures: Sequence[Path] = ()) -> str:
    """The diagnosis as Markdown; pictures: paths of figures relative to the file."""
    verdict = diagnosis.verdict
    parts = [
        f"# Diagnosis of {_safe(diagnosis.name)}",
        f"**{STATUS_WORDS[verdict.status]}.** {_safe(verdict.sentence)}",
    ]
    parts += [f"> **Warning:** {_safe(warning)}" for warning in diagnosis.warnings]
    parts += ["## How far", _measures(diagnosis), CLOSURE_MEANING if changed(diagnosis) else ""]
    if verdict.next_experiment:
        parts += ["## What to record next", _safe(verdict.next_experiment)]
    parts += _which(diagnosis) + _where(diagnosis) + _per_recording(diagnosis) + _setting(diagnosis)
    if pictures:
        parts += [
            "## Figures",
            "\n\n".join(f"![{path.stem.replace('_', ' ')}]({path.as_posix()})" for path in pictures),
        ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _measures(diagnosis: Diagnosis) -> str:
    lines = measure_lines(diagnosis, totals(diagnosis))
    if not changed(diagnosis):
        rows = ((f"{m.label} ({m.unit})", m.before, m.floor) for m in lines)
        return _table(("Held-out recordings", "Base model", "Floor"), rows)
    return _table(
        ("Held-out recordings", "Before", "After", "95 % for a new recording", "Floor", "Closed"),
        ((f"{m.label} ({m.unit})", m.before, m.after, m.interval or "-", m.floor, m.closed) for m in lines),
    )


def _which(diagnosis: Diagnosis) -> list[str]:
    lines = rank_lines(diagnosis)
    parts = ["## Which effect"]
    parts += [f"- `{name}`: {_safe(physics)}" for name, physics in effect_meanings(diagnosis)]
    if not lines:
        return [*parts, "No candidate was tried."]
    parts.append(
        _table(
            ("Candidate", "Screened", "Closed", "95 % interval", "Verdict", "Note"),
            ((f"`{r.name}`", r.screened, r.closed, r.interval or "-", ROLE_WORDS[r.role], r.note) for r in lines),
        )
    )
    candidate = chosen(diagnosis)
    if candidate is not None and candidate.parameters:
        rows = []
        for one in candidate.parameters:
            value = rounded(one)
            unit = "-" if one.unit == "1" else unit_label(one.unit)
            rows.append((f"`{one.name}`", estimate_text(value), interval_text(value) or "-", unit, one.note))
        parts.append(_table(("Parameter", "Value ± std", "95 % interval", "Unit", "Note"), rows))
    return parts


def _where(diagnosis: Diagnosis) -> list[str]:
    if not diagnosis.where:
        return []
    rows = ((s.label, share_words(s), p_words(s.p_value) or "-") for s in by_share(diagnosis))
    return [
        "## Where",
        _table(("Residual force depends on", "Share of variance", "Chance"), rows),
        ceiling_words(diagnosis),
    ]


def _per_recording(diagnosis: Diagnosis) -> list[str]:
    after = changed(diagnosis)
    rows = [
        (
            one.recording,
            f"{m.label} ({m.unit})",
            *((m.before, m.after, m.floor, m.closed) if after else (m.before, m.floor)),
        )
        for one in held_out(diagnosis)
        for m in measure_lines(diagnosis, one.changes)
    ]
    numbers = ("Before", "After", "Floor", "Closed") if after else ("Base model", "Floor")
    return ["## Held-out recordings", _table(("Recording", "Measure", *numbers), rows)] if rows else []


def _setting(diagnosis: Diagnosis) -> list[str]:
    base = ", ".join(f"`{name}`" for name in diagnosis.base_effects) or "none"
    facts = [f"- Base model: {diagnosis.model}, {diagnosis.axis} axis; effects in it: {base}; seed {diagnosis.seed}."]
    facts += [f"- {_safe(assumption)}" for assumption in diagnosis.assumptions]
    measures: tuple[MeasureLine, ...] = measure_lines(diagnosis, totals(diagnosis))
    facts += [f"- {m.label}: {MEASURE_MEANING[m.measure]}." for m in measures]
    return ["## Assumptions and terms", "\n".join(facts)]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_safe(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def _safe(text: str) -> str:
    """One line, without what Markdown would take for HTML."""
    return re.sub(r"<(?=[A-Za-z/!?])", "&lt;", re.sub(r"\s+", " ", text).strip())
