"""What the page, the Markdown file, the console and the figures of a diagnosis say alike: order, units, words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from linid.diagnosis.report_data import MEASURES, Candidate, Change, Diagnosis
from linid.report.display import Display, display_unit
from linid.report.numbers import format_number

if TYPE_CHECKING:
    from linid.diagnosis.report_data import RecordingChange, Share

STATUS_WORDS = {
    "none": "No gap above the floor",
    "identified": "Cause identified",
    "ambiguous": "Cause narrowed down, not unique",
    "unknown": "Gap without a known cause",
}
MEASURE_WORDS = {"free_run": "Free run, NRMSE", "ahead": "0.1 s ahead, RMS", "force": "Residual force, RMS"}
MEASURE_MEANING = {
    "free_run": "position simulated from the first sample to the last: RMS error over the standard deviation of the "
    "measured position",
    "ahead": "position predicted 0.1 s ahead from the measured state: RMS error",
    "force": "measured minus modelled force along the measured motion: RMS",
}
SIGNIFICANT = 0.05
CLOSURE_MEANING = (
    "Closed: share of the excess over the floor that the effect takes away on held-out recordings, "
    "(before² − after²) / (before² − floor²)."
)


@dataclass(frozen=True)
class MeasureLine:
    """One measure in words: label, unit, and rounded numbers ('-' where there is none)."""

    measure: str
    label: str
    unit: str
    before: str
    after: str
    interval: str
    floor: str
    closed: str


@dataclass(frozen=True)
class RankLine:
    """One candidate in words; role: 'cause', 'equivalent' or ''."""

    name: str
    role: str
    screened: str
    closed: str
    interval: str
    note: str


def ranked(diagnosis: Diagnosis) -> tuple[Candidate, ...]:
    """Candidates, the verdict's first, then the confirmed by closure, then the only screened by explained share."""

    def key(candidate: Candidate) -> tuple[bool, bool, float, float]:
        confirmed = math.isfinite(candidate.closure)
        explained = candidate.explained if math.isfinite(candidate.explained) else -math.inf
        return (
            role(diagnosis, candidate) != "cause",
            not confirmed,
            -candidate.closure if confirmed else 0.0,
            -explained,
        )

    return tuple(sorted(diagnosis.candidates, key=key))


def role(diagnosis: Diagnosis, candidate: Candidate) -> str:
    """What the verdict makes of a candidate: 'cause', 'equivalent' (explains as much) or ''."""
    verdict = diagnosis.verdict
    if verdict.effects and set(candidate.effects) == set(verdict.effects):
        return "cause"
    return "equivalent" if candidate.name in verdict.equivalent else ""


def chosen(diagnosis: Diagnosis) -> Candidate | None:
    """The candidate that the verdict names; None if it names none."""
    return next((c for c in diagnosis.candidates if role(diagnosis, c) == "cause"), None)


def totals(diagnosis: Diagnosis) -> dict[str, Change]:
    """The measures over all held-out recordings: the verdict's candidate's, else their root mean square."""
    candidate = chosen(diagnosis)
    if candidate is not None and candidate.held_out:
        return candidate.held_out
    found = {}
    for measure in MEASURES:
        changes = [r.changes[measure] for r in held_out(diagnosis) if measure in r.changes]
        if changes:
            before, after, floor = (
                float(np.sqrt(np.mean([getattr(c, end) ** 2 for c in changes]))) for end in ("before", "after", "floor")
            )
            found[measure] = Change(before, after, floor)
    return found


def held_out(diagnosis: Diagnosis) -> tuple[RecordingChange, ...]:
    """The recordings by which the verdict is reached."""
    return tuple(r for r in diagnosis.recordings if r.split == "held_out")


def significant(diagnosis: Diagnosis) -> tuple[Share, ...]:
    """Coordinates on which the residual depends beyond chance, the strongest first."""
    return tuple(s for s in by_share(diagnosis) if s.p_value < SIGNIFICANT and s.share > 0)


def by_share(diagnosis: Diagnosis) -> tuple[Share, ...]:
    """Coordinates, the one that explains most first."""
    return tuple(sorted(diagnosis.where, key=lambda s: -s.share if math.isfinite(s.share) else math.inf))


def changed(diagnosis: Diagnosis) -> bool:
    """Whether there is an `after` besides the `before`: the verdict may add nothing to the model."""
    return any(not np.array_equal(trace.before, trace.after, equal_nan=True) for trace in diagnosis.traces) or any(
        change.after != change.before for change in totals(diagnosis).values()
    )


def before_words(diagnosis: Diagnosis) -> str:
    """How the base model is called in legends."""
    return "before" if changed(diagnosis) else "base model"


def after_words(diagnosis: Diagnosis) -> str:
    """How the extended model is called in legends: `with cogging`."""
    effects = diagnosis.verdict.effects
    return "with " + " + ".join(effects) if effects else "after"


def closure(change: Change) -> float:
    """Share of the excess over the floor that is gone, (before^2 - after^2) / (before^2 - floor^2); nan at it."""
    excess = change.before**2 - change.floor**2
    return (change.before**2 - change.after**2) / excess if excess > 0 else math.nan


def measure_display(diagnosis: Diagnosis, measure: str) -> Display:
    """The unit in which a measure is shown throughout one report."""
    if measure == "free_run":
        return Display(100.0, "%")
    if measure == "ahead":
        return Display(1e6, "µrad" if diagnosis.axis == "rotary" else "µm")
    changes = [c for r in diagnosis.recordings for name, c in r.changes.items() if name == measure]
    sizes = [s for c in (*changes, *totals(diagnosis).values()) for s in (c.before, c.after) if math.isfinite(s)]
    return display_unit("force", diagnosis.axis, max(sizes, default=0.0)) if changes else force_display(diagnosis)


def force_display(diagnosis: Diagnosis) -> Display:
    """The unit for the residual force of all recordings."""
    sizes = [float(np.nanmax(np.abs(t.before))) for t in diagnosis.traces if np.isfinite(t.before).any()]
    return display_unit("force", diagnosis.axis, max(sizes, default=0.0))


def coordinate_display(share: Share, axis: str) -> Display:
    """The unit for a coordinate: SI lengths and speeds in what reads well, all else as it comes."""
    largest = float(np.max(np.abs(share.x))) if share.x.size else 0.0
    if share.unit in ("m", "rad"):
        return display_unit("position", axis, largest)
    if share.unit in ("m/s", "rad/s"):
        return display_unit("velocity", axis, largest)
    return Display(1.0, "" if share.unit == "1" else share.unit)


def measure_lines(diagnosis: Diagnosis, changes: dict[str, Change]) -> tuple[MeasureLine, ...]:
    """The measures with their numbers in words."""
    lines = []
    for measure in MEASURES:
        if measure in changes:
            change, display = changes[measure], measure_display(diagnosis, measure)
            before, after, floor, low, high = (
                number(end * display.factor)
                for end in (change.before, change.after, change.floor, change.low, change.high)
            )
            interval = f"[{low}, {high}]" if "-" not in (low, high) else ""
            label, closed = MEASURE_WORDS[measure], percent(closure(change))
            lines.append(MeasureLine(measure, label, display.unit, before, after, interval, floor, closed))
    return tuple(lines)


def rank_lines(diagnosis: Diagnosis) -> tuple[RankLine, ...]:
    """The candidates in words, in the order of `ranked`."""
    return tuple(
        RankLine(
            c.name,
            role(diagnosis, c),
            percent(c.explained),
            percent(c.closure),
            interval_percent(c.low, c.high),
            c.note,
        )
        for c in ranked(diagnosis)
    )


def number(value: float, digits: int = 3) -> str:
    """A number for people, '-' if there is none, 'inf' if the simulation diverged."""
    return "-" if math.isnan(value) else format_number(value, digits)


def percent(value: float) -> str:
    """A share as `84 %`, below one per cent as `0.4 %`; '-' if there is none."""
    if not math.isfinite(value):
        return "-"
    if 0.995 <= value < 1:
        return "> 99 %"  # not all
    if 0 < abs(value) < 0.0005:
        return "< 0.1 %" if value > 0 else "> -0.1 %"  # not nothing
    return f"{100 * value:.0f} %" if abs(value) >= 0.0095 or value == 0 else f"{100 * value:.1f} %"


def interval_percent(low: float, high: float) -> str:
    """`[80, 88] %`, empty if there is none."""
    return f"[{100 * low:.0f}, {100 * high:.0f}] %" if math.isfinite(low) and math.isfinite(high) else ""


def share_words(share: Share) -> str:
    """The share of a coordinate; a cross-validated one below zero explains nothing."""
    return percent(max(share.share, 0.0)) if math.isfinite(share.share) else "-"


def p_words(p_value: float) -> str:
    """`p = 0.02`, `p < 0.001`; empty if there is none."""
    if not math.isfinite(p_value):
        return ""
    return "p < 0.001" if p_value < 0.001 else f"p = {p_value:.2g}"


def ceiling_words(diagnosis: Diagnosis) -> str:
    """One sentence on how much any effect of these coordinates could explain; empty if it is not known."""
    if not math.isfinite(diagnosis.ceiling):
        return ""
    what = f" of {diagnosis.ceiling_coordinates}" if diagnosis.ceiling_coordinates else ""
    return f"Any smooth function{what} could explain at most {percent(diagnosis.ceiling)} of the held-out excess."


def effect_meanings(diagnosis: Diagnosis) -> tuple[tuple[str, str], ...]:
    """(name, one sentence of physics) of the effects in the verdict, as far as the library knows them."""
    from linid.physics.effects.registry import EFFECTS

    known = {effect.name: effect.physics for effect in EFFECTS}
    names = dict.fromkeys((*diagnosis.verdict.effects, *diagnosis.verdict.equivalent))
    return tuple((name, known[name]) for name in names if name in known)
