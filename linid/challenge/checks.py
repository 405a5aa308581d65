"""What the scoring needs beside the verdicts: how far the true effects close the gap, and fresh recordings' gaps."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap

MEASURES = ("free_run", "ahead", "force")


@dataclass(frozen=True)
class FreshGap:
    """A gap measured on a fresh recording beside the interval that the diagnosis stated for its kind."""

    recording: str
    measure: str
    value: float
    low: float
    high: float


def fresh_gaps(stated: Mapping[str, Any], gaps: Sequence[RecordingGap]) -> tuple[FreshGap, ...]:
    """Every gap of fresh recordings for which the diagnosis (content of diagnosis.json) stated an interval."""
    intervals = {
        (one["kind"], name): measure["interval"]
        for one in stated["recordings"]
        for name, measure in one["measures"].items()
        if measure["interval"]
    }
    return tuple(
        FreshGap(gap.recording, measure, float(getattr(gap, measure)), *intervals[gap.kind, measure])
        for gap in gaps
        for measure in MEASURES
        if (gap.kind, measure) in intervals
    )


def fresh_text(gaps: Sequence[FreshGap]) -> str:
    """Content of fresh.json, as the scoring reads it."""
    return json.dumps({"gaps": [asdict(gap) for gap in gaps]}, indent=1) + "\n"
