"""The files of a diagnosis: `diagnosis.json` for programs, `diagnosis.md` and `report.html` for people, figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.config import json_text
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.diagnosis.words import in_axis_words
from linid.report.files import finite, write_atomic

if TYPE_CHECKING:
    from linid.diagnosis.compensation_data import Compensation
    from linid.diagnosis.report_data import (
        Budget,
        Change,
        Diagnosis,
        Entry,
        LawFinding,
        PairShare,
        ProposedTerm,
        Share,
        TermCurve,
    )
    from linid.identification.result import Estimate
    from linid.report.figures.write import Progress

SCHEMA = 2
_COURSE = ("recording", "t", "reference", "without", "base", "full")


def write_diagnosis(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    formats: Sequence[str] = ("png",),
    figures: str = "all",
    written: Callable[[], None] | None = None,
    processes: int = 1,
    progress: Progress | None = None,
) -> list[Path]:
    """Write `diagnosis.json`, `diagnosis.md`, `report.html` and then `figures/` into `folder`.

    formats: of the figures, `png`, `pdf`, `svg`; figures: `few`, `all` or `none`; written: called when all but the
    figures is written; processes, progress: as in `write_drawings`. Returns the written files.
    """
    from linid.report.figures.diagnosis_write import diagnosis_drawings
    from linid.report.figures.drawing_process import Order, Ordered
    from linid.report.figures.write import wanted
    from linid.report.page.build import page_html

    folder, diagnosis = Path(folder), in_axis_words(diagnosis)
    make = partial(diagnosis_drawings, diagnosis, formats)
    drawn = Ordered(Order(make, figures, folder / "figures", formats, processes))
    stems = dict.fromkeys(d.stem for d in wanted(make(), figures) if "png" in (d.formats or formats))
    pictures = [Path("figures") / f"{stem}.png" for stem in stems]
    texts = {
        "diagnosis.json": json_text(diagnosis_data(diagnosis)),
        "diagnosis.md": diagnosis_markdown(diagnosis, pictures),
        "report.html": page_html(diagnosis),
    }
    paths = [write_atomic(folder / name, text.encode("utf-8")) for name, text in texts.items()]
    if written is not None:
        written()
    return paths + drawn.files(progress)


def diagnosis_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content of `diagnosis.json`, SI units, shares from 0 to 1; None where a number is not finite."""
    from linid.recording.checks import checks_data

    diagnosis = in_axis_words(diagnosis)
    data = {
        "schema": SCHEMA,
        "kind": "linid diagnosis",
        "name": diagnosis.name,
        "axis": diagnosis.axis,
        "model": diagnosis.model,
        "base_effects": diagnosis.base_effects,
        "force_scale": diagnosis.force_scale,
        "verdict": asdict(diagnosis.verdict),
        "given": diagnosis.given,
        "changes": [{**asdict(one), "share": one.share} for one in diagnosis.changes],
        "budget": _budget(diagnosis.budget),
        "friction_law": None if diagnosis.friction_law is None else _law(diagnosis.friction_law),
        "proposal": None if diagnosis.proposal is None else _proposal(diagnosis.proposal),
        "tried": [
            {
                "effect": one.effect,
                "explained": one.explained,
                "outcome": one.outcome,
                "certainty": one.certainty,
                "closed": one.closed,
            }
            for one in diagnosis.tried
        ],
        # What readers of schema 1 look for.
        "ranking": [
            {
                "effect": entry.effect,
                "held_out": _changes(entry.measures),
                "closure": entry.share,
                "interval": _interval(entry.low, entry.high),
            }
            for entry in diagnosis.budget.entries
        ],
        "where": [_share(share) for share in diagnosis.where],
        "pairs": [_pair(pair) for pair in diagnosis.pairs],
        "measures": _changes(diagnosis.measures),
        "recordings": [
            {"recording": one.recording, "kind": one.kind, "split": one.split, "measures": _changes(one.changes)}
            for one in diagnosis.recordings
        ],
        "compensation": None if diagnosis.compensation is None else _compensation(diagnosis.compensation),
        "exports": [asdict(one) for one in diagnosis.exports],
        "checks": checks_data(diagnosis.checks),
        "assumptions": diagnosis.assumptions,
        "warnings": diagnosis.warnings,
        "combinations": diagnosis.combinations,
        "field_wavenumber": diagnosis.field_wavenumber,
        "seed": diagnosis.seed,
    }
    cleaned = finite(data)
    assert isinstance(cleaned, dict)
    return cleaned


def _compensation(told: Compensation) -> dict[str, Any]:
    data = asdict(replace(told, courses=()))
    data["courses"] = [
        {key: getattr(course, key) if key == "recording" else getattr(course, key).tolist() for key in _COURSE}
        for course in told.courses
    ]
    return {**data, "saved": told.saved}


def _law(law: LawFinding) -> dict[str, Any]:
    gains = {name: {"gain": gain, "certainty": certainty} for name, (gain, certainty) in law.gains.items()}
    return {**asdict(law), "gains": gains}


def _proposal(term: ProposedTerm) -> dict[str, Any]:
    return {
        "arguments": term.arguments,
        "not_on": term.not_on,
        "closed": term.closed,
        "low": term.low,
        "high": term.high,
        "p_value": term.p_value,
        "curve": None if term.curve is None else _curve(term.curve),
        "short": None if term.short is None else asdict(term.short),
        "resembles": [asdict(one) for one in term.resembles],
        "refines": list(term.refines),
        "effect": term.effect,
        "kept": term.kept,
        "measures": _changes(term.measures),
        "sentence": term.sentence,
        "next_experiment": term.next_experiment,
    }


def _curve(curve: TermCurve) -> dict[str, Any]:
    return {
        "axes": [
            {"argument": one.argument, "label": one.label, "unit": one.unit, "x": one.x.tolist()} for one in curve.axes
        ],
        "factor": curve.factor,
        "unit": curve.unit,
        "value": curve.value.tolist(),
        "low": curve.low.tolist(),
        "high": curve.high.tolist(),
    }


def _budget(budget: Budget) -> dict[str, Any]:
    return {
        "gap": budget.excess_before,
        "before": budget.before,
        "after": budget.after,
        "floor": budget.floor,
        "excess_before": budget.excess_before,
        "excess_after": budget.excess_after,
        "closed": budget.closed,
        "closed_interval": _interval(budget.closed_low, budget.closed_high),
        "unexplained": {
            "share": budget.unexplained,
            "low": budget.unexplained_low,
            "high": budget.unexplained_high,
            "ceiling": budget.ceiling,
            "depends_on": budget.depends_on,
        },
        "entries": [_entry(entry) for entry in budget.entries],
    }


def _entry(entry: Entry) -> dict[str, Any]:
    return {
        "effect": entry.effect,
        "rivals": entry.rivals,
        "share": entry.share,
        "low": entry.low,
        "high": entry.high,
        "first_in": entry.first_in,
        "last_in": entry.last_in,
        "certainty": entry.certainty,
        "parameters": [_estimate(one) for one in entry.parameters],
        "combinations": entry.combinations,
        "measures": {
            name: {"before": change.before, "after": change.after, "floor": change.floor}
            for name, change in entry.measures.items()
        },
        "worsens": entry.worsens,
        "note": entry.note,
    }


def _changes(changes: Mapping[str, Change]) -> dict[str, Any]:
    return {
        name: {
            "before": change.before,
            "after": change.after,
            "floor": change.floor,
            "interval": _interval(change.low, change.high),
        }
        for name, change in changes.items()
    }


def _interval(low: float, high: float) -> list[float] | None:
    return [low, high] if math.isfinite(low) and math.isfinite(high) else None


def _share(share: Share) -> dict[str, Any]:
    return {
        "coordinate": share.coordinate,
        "share": share.share,
        "p_value": share.p_value,
        "label": share.label,
        "unit": share.unit,
        "x": share.x.tolist(),
        "mean": share.mean.tolist(),
        "spread": share.spread.tolist(),
    }


def _pair(pair: PairShare) -> dict[str, Any]:
    return {
        "coordinates": [pair.x_coordinate, pair.y_coordinate],
        "labels": [pair.x_label, pair.y_label],
        "units": [pair.x_unit, pair.y_unit],
        "form": pair.form,
        "share": pair.share,
        "p_value": pair.p_value,
        "x_edges": pair.x_edges.tolist(),
        "y_edges": pair.y_edges.tolist(),
        "mean": pair.mean.tolist(),
        "rows": pair.rows.tolist(),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        "name": estimate.name,
        "symbol": estimate.symbol,
        "unit": estimate.unit,
        "value": estimate.value,
        "std": estimate.std,
        "interval": [estimate.low, estimate.high],
        "status": estimate.status,
        "note": estimate.note,
    }
