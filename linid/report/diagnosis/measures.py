"""The three measures in words: before, after, floor, and what became of their excess over it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from linid.report.diagnosis.content import force_display, force_word, held_out, number, percent, scaled_display
from linid.report.display import Display

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Change, Diagnosis

AT_FLOOR, WORSE = "at the floor", "worse"
_SAME = 1e-3  # relative change of a measure that is none
_TOO_HIGH = 0.7  # of the floor: what the base model misses lies below it by more than a floor is known
_ABOVE = 0.3  # excess in floors from where a measure is above its own, as a force is for the verdict
_MOST_OF_IT = 0.9  # of a measure's excess: by the recordings that are named
_STUCK = 0.2  # of its excess closed, below which a free run has not followed the force


@dataclass(frozen=True)
class MeasureLine:
    """One measure in words: label, unit, rounded numbers ('-' where there is none).

    state: what became of its excess over its floor: 'at the floor', 'worse', '62 %', or '-' where nothing can be said.
    """

    measure: str
    label: str
    unit: str
    before: str
    after: str
    interval: str
    floor: str
    state: str


def measure_labels(axis: str) -> dict[str, str]:
    """The three measures by name."""
    return {"free_run": "Free run, NRMSE", "ahead": "0.1 s ahead, RMS", "force": f"Residual {force_word(axis)}, RMS"}


def measure_meanings(axis: str) -> dict[str, str]:
    """What each measure is."""
    word = force_word(axis)
    return {
        "free_run": "position simulated from the first sample to the last: RMS error over the standard deviation of "
        "the measured position",
        "ahead": "position predicted 0.1 s ahead from the measured state: RMS error",
        "force": f"measured minus modelled {word} along the measured motion: RMS",
    }


def measure_display(diagnosis: Diagnosis, measure: str) -> Display:
    """The unit in which a measure is shown throughout one report."""
    if measure == "free_run":
        return Display(100.0, "%")
    if measure == "ahead":
        return Display(1e6, "µrad" if diagnosis.axis == "rotary" else "µm")
    changes = [r.changes[measure] for r in diagnosis.recordings if measure in r.changes]
    changes += [c for name, c in diagnosis.measures.items() if name == measure]
    sizes = [s for c in changes for s in (c.before, c.after) if math.isfinite(s)]
    return scaled_display(diagnosis, max(sizes)) if sizes else force_display(diagnosis)


def measure_lines(diagnosis: Diagnosis, changes: Mapping[str, Change]) -> tuple[MeasureLine, ...]:
    """The measures with their numbers in words."""
    lines = []
    for measure, words in measure_labels(diagnosis.axis).items():
        if measure in changes:
            change, display = changes[measure], measure_display(diagnosis, measure)
            before, after, floor, low, high = (
                number(end * display.factor)
                for end in (change.before, change.after, change.floor, change.low, change.high)
            )
            interval = f"[{low}, {high}]" if "-" not in (low, high) else ""
            lines.append(MeasureLine(measure, words, display.unit, before, after, interval, floor, state(change)))
    return tuple(lines)


def state(change: Change) -> str:
    """What became of a measure's excess over its own floor: 'at the floor', 'worse', a percentage of its squares that
    is gone (0 to 100 %), '-' where a number is missing or the floor is no lower than what is measured."""
    before, after, floor = change.before, change.after, change.floor
    if math.isnan(before) or math.isnan(after):
        return "-"
    if after > before * (1.0 + _SAME):
        return WORSE
    if math.isnan(floor) or not math.isfinite(before):
        return "-"
    if after <= floor:
        return AT_FLOOR
    if before <= floor:
        return "-"
    return percent(max(0.0, (before**2 - after**2) / (before**2 - floor**2)))


def state_meaning() -> str:
    """What the column beside the measures says, and that shares of the gap are another thing."""
    return (
        "To the floor: part of a measure's own excess over its floor that is gone, in squares. Shares of the gap, and "
        "what of it closes, are those of the budget alone."
    )


def measure_remarks(diagnosis: Diagnosis, changes: Mapping[str, Change]) -> tuple[str, ...]:
    """Sentences on what the measures cannot say, and why."""
    labels = measure_labels(diagnosis.axis)
    known = {name: change for name, change in changes.items() if name in labels}
    reasons = (
        (
            [n for n, c in known.items() if math.isnan(c.floor)],
            "no floor is known, since no recording is repeated and its noise is not told.",
        ),
        (
            [n for n, c in known.items() if c.before < _TOO_HIGH * c.floor],
            "the floor is too high (above what the base model misses), so no improvement can be seen; repeats that "
            "scatter less would lower it.",
        ),
        (
            [n for n, c in known.items() if math.isinf(c.before) or math.isinf(c.after)],
            "the simulation diverges, because small errors add up from the first sample on.",
        ),
    )
    said = [f"{'; '.join(labels[name] for name in names)}: {reason}" for names, reason in reasons if names]
    free, closed = changes.get("free_run"), diagnosis.budget.closed
    above = [name for name, change in known.items() if _excess(change) > _ABOVE * change.floor**2]
    if free is not None and closed > 0.5 and math.isfinite(free.before) and math.isfinite(free.after):
        excess = free.before**2 - free.floor**2
        stuck = excess > 0 and free.before**2 - free.after**2 < _STUCK * excess
        if stuck:
            said.append(
                f"{labels['free_run']}: it hardly follows the {force_word(diagnosis.axis)}, because it adds up every "
                "small error from a first state that is only partly measured (speed, friction's deflection)."
            )
            above = [name for name in above if name != "free_run"]
    if diagnosis.verdict.status in ("none", "explained"):
        said += [f"{labels[name]}: {_above_floor(diagnosis, name)}" for name in above]
    return tuple(said)


def _excess(change: Change) -> float:
    """What is left of a measure above its floor, squared; 0 where that cannot be said."""
    excess = change.after**2 - change.floor**2
    return max(excess, 0.0) if math.isfinite(excess) else 0.0


def _above_floor(diagnosis: Diagnosis, measure: str) -> str:
    """Which recordings keep a measure above its floor, where the verdict, which is on the force, sees no gap."""
    display, named, told = measure_display(diagnosis, measure), [], 0.0
    found = [(_excess(one.changes[measure]), one) for one in held_out(diagnosis) if measure in one.changes]
    whole = sum(excess for excess, _ in found)
    for excess, one in sorted(found, key=lambda pair: -pair[0]):
        if told < _MOST_OF_IT * whole:
            change, told = one.changes[measure], told + excess
            after, floor = number(change.after * display.factor), number(change.floor * display.factor)
            named.append((one, f"{one.recording} ({after} {display.unit}, floor {floor} {display.unit})"))
    text = "above its floor"
    if measure != "force":
        text += f"; the verdict is on the residual {force_word(diagnosis.axis)}"
    text += f". Nearly all of it comes from {', '.join(words for _, words in named)}." if named else "."
    jumping = [one.recording for one, _ in named if one.jumps and measure != "force"]
    if jumping:
        where = "There" if len(jumping) == len(named) else f"In {', '.join(jumping)}"
        text += (
            f" {where} the input jumps between two samples: when, only the motion shows; the floor lacks what it leaves"
        )
        text += " open."
    return text
