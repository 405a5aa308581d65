"""What other programs would keep of the closed gap, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from linid.report.diagnosis.content import interval_percent, percent

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, ExportLoss

EXPORTS_TITLE = "In other programs"
EXPORTS_HEADER = ("Target of linid export", "0.1 s ahead", "Free run", "Remarks")
EXPORTS_MEANING = (
    "Shares of the closed gap that a target's form keeps on the held-out recordings, with 95 % intervals over these; "
    "a negative share is further off than the base model. Free runs are those of free wheels."
)


def export_rows(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """A row of `EXPORTS_HEADER` for each form, the whole model first; none where nothing was exported."""
    ranked = sorted(diagnosis.exports, key=lambda one: (not one.whole, bool(one.refused)))
    return tuple(
        (", ".join(one.targets), *(_kept(one, m) for m in ("ahead", "free_run")), _remarks(one)) for one in ranked
    )


def _kept(one: ExportLoss, measure: str) -> str:
    if one.refused:
        return "-"
    share, low, high = one.kept.get(measure, (math.nan, math.nan, math.nan))
    if one.whole:
        return "all"
    interval = interval_percent(low, high)
    return f"{percent(share)} {interval}".strip()


def _remarks(one: ExportLoss) -> str:
    if one.refused:
        return one.refused
    return " ".join(one.lacks) or "The whole model is held."
