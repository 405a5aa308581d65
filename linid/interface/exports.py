"""What the targets of `linid export` would keep of the gap that a diagnosis closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from linid.interface.measuring import residual_recordings

if TYPE_CHECKING:
    from linid.diagnosis.diagnose import Found
    from linid.export.loss import Measured
    from linid.recording import Recording


def surveyed(found: Found, recordings: Sequence[Recording], jobs: int = 1) -> Found:
    """What was found, with what each target keeps of it on the held-out recordings; as it is where nothing was named.

    jobs: threads, never change a result.
    """
    from linid.diagnosis.report_data import ExportLoss
    from linid.export.loss import held_out
    from linid.export.registry import all_targets
    from linid.export.survey import survey_targets
    from linid.export.target import Exported, step_of

    judges = residual_recordings(held_out(recordings), found.after)
    if not judges or found.after.effects == found.before.effects:
        return found
    exported = Exported(found.after, "axis", step_of(found.after, recordings), tuple(recordings))
    alike: dict[tuple[object, ...], ExportLoss] = {}
    measured = _measured(found, judges)
    for one in survey_targets(tuple(all_targets().values()), exported, measured, judges, jobs):
        kept = () if one.loss is None else one.loss.kept
        row = ExportLoss(
            (one.target,), one.whole, {k.measure: (k.share, k.low, k.high) for k in kept}, one.lacks, one.refused
        )
        key = (row.whole, repr(row.kept), row.lacks, row.refused)
        other = alike.get(key)
        alike[key] = row if other is None else replace(other, targets=(*other.targets, one.target))
    return replace(found, diagnosis=replace(found.diagnosis, exports=tuple(alike.values())))


def _measured(found: Found, judges: Sequence[Recording]) -> Measured:
    """The gap without and with what was named, as the diagnosis has measured it."""
    from linid.export.loss import Errors, Measured

    change_of = {one.recording: one.changes for one in found.diagnosis.recordings}
    rows = [
        [
            Errors(r.name, r.kind, *(getattr(change_of[r.name][name], when) for name in ("free_run", "ahead", "force")))
            for r in judges
        ]
        for when in ("before", "after")
    ]
    return Measured(tuple(rows[0]), tuple(rows[1]))
