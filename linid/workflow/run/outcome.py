"""What a finished command hands back to whoever called it: the command line or a batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap

DONE, NOT_CONVERGED, CHANGED = 0, 5, 6


@dataclass(frozen=True)
class Outcome:
    """exit_code: 0 done, 5 results written but not converged, 6 something has changed; tables: for the console (rich);
    summary: for --json; shown: whether that is done already."""

    command: str
    folder: Path | None
    exit_code: int = DONE
    key_figure: str = ""
    tables: tuple[Any, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)
    shown: bool = False

    @property
    def status(self) -> str:
        """`done` or `not_converged`."""
        return "done" if self.exit_code in (DONE, CHANGED) else "not_converged"


def gap_figure_text(gaps: Sequence[RecordingGap], axis: str = "linear") -> str:
    """The gap in one line: medians over the held-out recordings, or the fitted ones.

    Driven recordings, where there are any, speak by their error 0.1 s ahead: their free runs lose step.
    """
    from statistics import median

    held_out = [g for g in gaps if g.split == "held_out"]
    chosen = held_out or list(gaps)
    if not chosen:
        return ""
    driven = [g for g in chosen if g.kind != "free_wheel"]
    which = "held out" if held_out else "fitted"
    if driven:
        chosen = driven
        unit = "µrad" if axis == "rotary" else "µm"
        text = f"0.1 s ahead {1e6 * median(g.ahead for g in chosen):.3g} {unit}"
    else:
        text = f"free run {100 * median(g.free_run for g in chosen):.2g} %"
    return f"{which}, median of {len(chosen)}: {text}, force {100 * median(g.force_share for g in chosen):.2g} %"
