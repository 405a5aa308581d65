"""The files of a diagnosis: `diagnosis.json` for programs, `diagnosis.md` and `report.html` for people, figures."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.diagnosis_content import closure, ranked
from linid.report.diagnosis_markdown import diagnosis_markdown
from linid.report.files import write_atomic

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Candidate, Change, Diagnosis
    from linid.identification.result import Estimate
    from linid.report.figures.write import Progress

SCHEMA = 1


def write_diagnosis(
    diagnosis: Diagnosis,
    folder: Path,
    *,
    formats: Sequence[str] = ("png",),
    figures: bool = True,
    processes: int = 1,
    progress: Progress | None = None,
) -> list[Path]:
    """Write `diagnosis.json`, `diagnosis.md`, `report.html` and, if wanted, `figures/` into `folder`.

    formats: of the figures, `png`, `pdf`, `svg`; processes, progress: as in `write_drawings`. Returns the written
    files.
    """
    from linid.report.figures.diagnosis_write import write_diagnosis_figures
    from linid.report.page.build import page_html

    folder = Path(folder)
    drawn: list[Path] = []
    if figures:
        drawn = write_diagnosis_figures(
            diagnosis, folder / "figures", formats=formats, processes=processes, progress=progress
        )
    pictures = [path.relative_to(folder) for path in drawn if path.suffix == ".png"]
    texts = {
        "diagnosis.json": json.dumps(diagnosis_data(diagnosis), indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "diagnosis.md": diagnosis_markdown(diagnosis, pictures),
        "report.html": page_html(diagnosis),
    }
    return [write_atomic(folder / name, text.encode("utf-8")) for name, text in texts.items()] + drawn


def diagnosis_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content of `diagnosis.json`, SI units, shares from 0 to 1; None where a number is not finite."""
    verdict = diagnosis.verdict
    data = {
        "schema": SCHEMA,
        "kind": "linid diagnosis",
        "name": diagnosis.name,
        "axis": diagnosis.axis,
        "model": diagnosis.model,
        "base_effects": diagnosis.base_effects,
        "verdict": {
            "status": verdict.status,
            "effects": verdict.effects,
            "equivalent": verdict.equivalent,
            "sentence": verdict.sentence,
        },
        "ranking": [_candidate(candidate) for candidate in ranked(diagnosis)],
        "where": [
            {
                "coordinate": share.coordinate,
                "share": share.share,
                "p_value": share.p_value,
                "label": share.label,
                "unit": share.unit,
                "x": share.x.tolist(),
                "mean": share.mean.tolist(),
                "spread": share.spread.tolist(),
            }
            for share in diagnosis.where
        ],
        "next_experiment": verdict.next_experiment,
        "recordings": [
            {
                "recording": one.recording,
                "kind": one.kind,
                "split": one.split,
                "measures": {name: _change(change) for name, change in one.changes.items()},
            }
            for one in diagnosis.recordings
        ],
        "ceiling": {"share": diagnosis.ceiling, "coordinates": diagnosis.ceiling_coordinates},
        "excess": {"before": diagnosis.excess_before, "after": diagnosis.excess_after, "floor": diagnosis.floor},
        "assumptions": diagnosis.assumptions,
        "warnings": diagnosis.warnings,
        "field_wavenumber": diagnosis.field_wavenumber,
        "seed": diagnosis.seed,
    }
    cleaned = finite(data)
    assert isinstance(cleaned, dict)
    return cleaned


def finite(value: Any) -> Any:
    """The same value with None for every number that JSON cannot hold, and lists for tuples."""
    if isinstance(value, Mapping):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(one) for one in value]
    if isinstance(value, float):  # also numpy's double
        return float(value) if math.isfinite(value) else None
    return value


def _candidate(candidate: Candidate) -> dict[str, Any]:
    interval = [candidate.low, candidate.high]
    return {
        "effect": candidate.name,
        "effects": candidate.effects,
        "held_out": {name: _change(change) for name, change in candidate.held_out.items()},
        "closure": candidate.closure,
        "interval": interval if all(map(math.isfinite, interval)) else None,
        "screened": candidate.explained,
        "parameters": [_estimate(one) for one in candidate.parameters],
        "note": candidate.note,
    }


def _change(change: Change) -> dict[str, Any]:
    interval = [change.low, change.high]
    return {
        "before": change.before,
        "after": change.after,
        "floor": change.floor,
        "closure": closure(change),
        "interval": interval if all(map(math.isfinite, interval)) else None,
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
