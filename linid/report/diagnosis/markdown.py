"""A diagnosis as Markdown, for a terminal or a pull request."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from linid.report.diagnosis.budget import (
    BudgetLine,
    budget_lines,
    closed_words,
    gap_words,
    rest_words,
    where_words,
    which_words,
)
from linid.report.diagnosis.changes import change_words
from linid.report.diagnosis.compensation import (
    COMPENSATION_TITLE,
    compensation_setting,
    compensation_tables,
    compensation_words,
)
from linid.report.diagnosis.content import (
    TRIED_MEANING,
    by_share,
    changed,
    effect_meanings,
    findings,
    force_word,
    held_out,
    p_words,
    pairs_left_out,
    scale_words,
    share_words,
    shown_pairs,
    tried_rows,
)
from linid.report.diagnosis.exports import EXPORTS_HEADER, EXPORTS_MEANING, EXPORTS_TITLE, export_rows
from linid.report.diagnosis.law import LAW_HEADER, LAW_MEANING, LAW_TITLE, law_lines, law_rows, law_told, law_words
from linid.report.diagnosis.measures import measure_lines, measure_meanings, measure_remarks, state_meaning
from linid.report.diagnosis.proposal import TERM_TITLE, TermLine, headline, term_lines, term_measures
from linid.report.diagnosis.words import in_print

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis


def diagnosis_markdown(diagnosis: Diagnosis, pictures: Sequence[Path] = ()) -> str:
    """The diagnosis as Markdown; pictures: paths of figures relative to the file."""
    diagnosis = in_print(diagnosis)
    verdict = diagnosis.verdict
    parts = [
        f"# Diagnosis of {_safe(diagnosis.name)}",
        f"**{headline(diagnosis)}.** {_safe(verdict.sentence)}",
        f"- **Where:** {_safe(where_words(diagnosis))}.\n- **Which:** {_safe(which_words(diagnosis))}.\n"
        f"- **How far:** {_safe(closed_words(diagnosis))}",
    ]
    if diagnosis.given:
        parts.append(_safe(change_words(diagnosis)))
    parts += [f"> **Warning:** {_safe(warning)}" for warning in diagnosis.warnings]
    if verdict.next_experiment:
        parts += ["## What to record next", _safe(verdict.next_experiment)]
    parts += _budget(diagnosis) + _law(diagnosis) + _term(diagnosis) + _how_far(diagnosis)
    parts += _compensation(diagnosis) + _exports(diagnosis) + _checks(diagnosis)
    parts += _where(diagnosis) + _which(diagnosis) + _per_recording(diagnosis) + _setting(diagnosis)
    if pictures:
        parts += [
            "## Figures",
            "\n\n".join(f"![{path.stem.replace('_', ' ')}]({path.as_posix()})" for path in pictures),
        ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _budget(diagnosis: Diagnosis) -> list[str]:
    lines = budget_lines(diagnosis)
    if not lines:
        return [rest_words(diagnosis)]
    header = ("Effect", "Share of the gap", "95 %", "Certainty", "Alone closes", "Missed without it", "Remarks")
    rows = [
        (
            line.label,
            line.share,
            line.interval or "-",
            line.certainty or "-",
            line.alone,
            line.missed,
            " ".join(filter(None, (line.worsens, line.note))),
        )
        for line in lines
    ]
    parts = ["## Budget of the gap", _table(header, rows), gap_words(diagnosis), rest_words(diagnosis)]
    for line in lines:
        parts += _entry(line)
    return [*parts, scale_words(diagnosis)]


def _entry(line: BudgetLine) -> list[str]:
    parts = [f"### {_safe(line.label)}"]
    if line.measures:
        parts.append(
            _table(
                ("Held-out recordings", "Without it", "With it", "Floor", "To the floor"),
                ((f"{m.label} ({m.unit})", m.before, m.after, m.floor, m.state) for m in line.measures),
            )
        )
    if line.parameters:
        rows = ((p.name, p.value, p.interval or "-", p.unit or "-", p.note) for p in line.parameters)
        parts.append(_table(("Parameter", "Value ± std", "95 % interval", "Unit", "Note"), rows))
    return [*parts, *(f"- {_safe(one)}" for one in line.combinations)]


def _law(diagnosis: Diagnosis) -> list[str]:
    if not law_told(diagnosis):
        return []
    parts = [f"## {LAW_TITLE}", _safe(law_words(diagnosis)), _facts(law_lines(diagnosis))]
    return [*parts, _table(LAW_HEADER, law_rows(diagnosis)), LAW_MEANING]


def _facts(lines: Iterable[TermLine]) -> str:
    return "\n".join(
        " ".join(part for part in (f"- **{one.title}:**", _safe(one.lead), _code(one.code), _safe(one.text)) if part)
        for one in lines
    )


def _term(diagnosis: Diagnosis) -> list[str]:
    if diagnosis.proposal is None:
        return []
    parts = [f"## {TERM_TITLE}", _safe(diagnosis.proposal.sentence), _facts(term_lines(diagnosis))]
    rows = [
        (f"{m.label} ({m.unit})", m.before, m.after, m.interval or "-", m.floor, m.state)
        for m in term_measures(diagnosis)
    ]
    header = ("Held-out recordings", "Without the term", "With it", "95 % for a new recording", "Floor", "To the floor")
    return [*parts, _table(header, rows)] if rows else parts


def _how_far(diagnosis: Diagnosis) -> list[str]:
    lines = measure_lines(diagnosis, diagnosis.measures)
    if not lines:
        return []
    if not changed(diagnosis):
        rows = ((f"{m.label} ({m.unit})", m.before, m.floor) for m in lines)
        table = _table(("Held-out recordings", "Base model", "Floor"), rows)
    else:
        table = _table(
            ("Held-out recordings", "Before", "After", "95 % for a new recording", "Floor", "To the floor"),
            ((f"{m.label} ({m.unit})", m.before, m.after, m.interval or "-", m.floor, m.state) for m in lines),
        )
    remarks = [f"- {one}" for one in measure_remarks(diagnosis, diagnosis.measures)]
    return ["## The three measures", table, state_meaning() if changed(diagnosis) else "", "\n".join(remarks)]


def _compensation(diagnosis: Diagnosis) -> list[str]:
    if not compensation_words(diagnosis):
        return []
    parts = [f"## {COMPENSATION_TITLE}", _safe(compensation_words(diagnosis))]
    parts += [_table(header, rows) for header, rows in compensation_tables(diagnosis)]
    return [*parts, _safe(compensation_setting(diagnosis))]


def _exports(diagnosis: Diagnosis) -> list[str]:
    rows = export_rows(diagnosis)
    return [f"## {EXPORTS_TITLE}", _table(EXPORTS_HEADER, rows), EXPORTS_MEANING] if rows else []


def _checks(diagnosis: Diagnosis) -> list[str]:
    from linid.recording.checks import CHECKS_LEGEND, checks_table

    if not diagnosis.checks:
        return []
    found = [f"- {level.capitalize()}, {_safe(who)}: {_safe(text)}." for level, who, text in findings(diagnosis)]
    return [
        "## Data checks",
        "\n".join(found) or "Nothing to object to.",
        _table(*checks_table(diagnosis.checks)),
        _safe(CHECKS_LEGEND),
    ]


def _where(diagnosis: Diagnosis) -> list[str]:
    if not diagnosis.where:
        return []
    rows = ((s.label, share_words(s), p_words(s.p_value) or "-") for s in by_share(diagnosis))
    parts = [
        "## Where",
        _table((f"Residual {force_word(diagnosis.axis)} depends on", "Share of variance", "Chance"), rows),
    ]
    pairs = [
        (f"{p.x_label} and {p.y_label}", share_words(p), p_words(p.p_value) or "-") for p in shown_pairs(diagnosis)
    ]
    if pairs:
        parts += [_table(("Only both together", "Share of variance", "Chance"), pairs), pairs_left_out(diagnosis)]
    return parts


def _which(diagnosis: Diagnosis) -> list[str]:
    parts = ["## Which effects"]
    parts += [f"- `{name}`: {_safe(physics)}" for name, physics in effect_meanings(diagnosis)]
    if not diagnosis.tried:
        return [*parts, "No effect was tried."]
    return [*parts, _table(*tried_rows(diagnosis)), TRIED_MEANING]


def _per_recording(diagnosis: Diagnosis) -> list[str]:
    after = changed(diagnosis)
    rows = [
        (
            one.recording,
            f"{m.label} ({m.unit})",
            *((m.before, m.after, m.floor, m.state) if after else (m.before, m.floor)),
        )
        for one in held_out(diagnosis)
        for m in measure_lines(diagnosis, one.changes)
    ]
    numbers = ("Before", "After", "Floor", "To the floor") if after else ("Base model", "Floor")
    return ["## Held-out recordings", _table(("Recording", "Measure", *numbers), rows)] if rows else []


def _setting(diagnosis: Diagnosis) -> list[str]:
    base = ", ".join(f"`{name}`" for name in diagnosis.base_effects) or "none"
    facts = [f"- Base model: {diagnosis.model}, {diagnosis.axis} axis; effects in it: {base}; seed {diagnosis.seed}."]
    facts += [f"- {_safe(one)}" for one in (*diagnosis.assumptions, *diagnosis.combinations)]
    meanings, labels = measure_meanings(diagnosis.axis), measure_lines(diagnosis, diagnosis.measures)
    facts += [f"- {m.label}: {meanings[m.measure]}." for m in labels]
    return ["## Assumptions and terms", "\n".join(facts)]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_safe(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def _code(text: str) -> str:
    return f"`{' '.join(text.split())}`" if text else ""


def _safe(text: str) -> str:
    """One line, without what Markdown would take for HTML."""
    return re.sub(r"<(?=[A-Za-z/!?])", "&lt;", re.sub(r"\s+", " ", text).strip())
