"""What a page of free runs says of each of them: how far it went, and what noise alone would do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.report.figures.ahead import free_run_end
from linid.report.numbers import format_number

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap, Trace

_ALIKE = 2.0  # times what noise alone makes: a run that lost step is as far off as chance has it


def free_run_caption(gap: RecordingGap, trace: Trace) -> str:
    """Where the run lost step, its error, and that of the same model under inputs with other noise, without a full
    stop."""
    end = free_run_end(trace)
    how = "in step to the end" if end is None else f"lost step at {format_number(float(trace.t[end]))} s"
    error, noise = (format_number(100.0 * share, 2) for share in (gap.free_run, gap.free_run_floor))
    said = f"{trace.recording}: {how}, error {error} % of the motion, {noise} % by the sensors' noise alone"
    if end is None or gap.free_run <= _ALIKE * gap.free_run_floor:
        return said
    return f"{said}, so that more than noise is behind it"
