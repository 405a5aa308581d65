"""What the page, the Markdown file, the console and the figures of a diagnosis say alike: order, units, words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from linid.physics.wording import fitting_words
from linid.report.display import Display, display_unit
from linid.report.numbers import format_number
from linid.report.symbols import typeset

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, PairShare, RecordingChange, Share, Tried

STATUS_WORDS = {
    "none": "No gap above the floor",
    "explained": "Gap explained",
    "partly explained": "Gap partly explained",
    "unknown": "Gap without a known cause",
}
OUTCOME_WORDS = {
    "named": "in the budget",
    "rival": "explains as much as a named one",
    "dropped": "joined the model, failed on held-out recordings",
    "screened": "screened only",
}
TRIED_MEANING = (
    "Screened: share of the fitted recordings' log power over the floor that a regression on the effect alone takes "
    "away. Closed and certainty: of the gap on held-out recordings, where the effect was tested in the model."
)
SIGNIFICANT = 0.05
FEWEST_OF_CURVE = 5  # places: fewer (directions, recordings) are points, not a curve
_LEAST_P = 0.001  # set by hand: below, digits say nothing more
_ONE_BY_ONE = 2  # effects that a legend names


def force_word(axis: str) -> str:
    """How what pushes an axis is called: force, on rotary axes torque."""
    return "torque" if axis == "rotary" else "force"


def held_out(diagnosis: Diagnosis) -> tuple[RecordingChange, ...]:
    """The recordings by which the verdict is reached."""
    return tuple(r for r in diagnosis.recordings if r.split == "held_out")


def by_share(diagnosis: Diagnosis) -> tuple[Share, ...]:
    """Coordinates, the one that explains most first."""
    return tuple(sorted(diagnosis.where, key=lambda s: -s.share if math.isfinite(s.share) else math.inf))


def significant(diagnosis: Diagnosis) -> tuple[Share, ...]:
    """Coordinates on which the residual depends beyond chance, the strongest first."""
    return tuple(s for s in by_share(diagnosis) if s.p_value < SIGNIFICANT and s.share > 0)


def shown_pairs(diagnosis: Diagnosis) -> tuple[PairShare, ...]:
    """Pairs beyond chance, the strongest first, without those that share a coordinate with a stronger one."""
    shown: list[PairShare] = []
    seen: set[str] = set()
    for pair in sorted(diagnosis.pairs, key=lambda p: -p.share if math.isfinite(p.share) else math.inf):
        both = {pair.x_coordinate, pair.y_coordinate}
        if pair.p_value < SIGNIFICANT and pair.share > 0 and not both & seen:
            shown.append(pair)
            seen |= both
    return tuple(shown)


def pairs_left_out(diagnosis: Diagnosis) -> str:
    """One sentence on pairs beyond chance that are not shown; empty if there are none."""
    count = sum(p.p_value < SIGNIFICANT and p.share > 0 for p in diagnosis.pairs) - len(shown_pairs(diagnosis))
    if not count:
        return ""
    what = "1 weaker pair that shares" if count == 1 else f"{count} weaker pairs that share"
    return f"{what} a coordinate with a stronger one {'is' if count == 1 else 'are'} left to diagnosis.json."


def tried_in_order(diagnosis: Diagnosis) -> tuple[Tried, ...]:
    """The tried effects: named, rivals, dropped, screened, each by explained share."""
    places = list(OUTCOME_WORDS)
    return tuple(
        sorted(
            diagnosis.tried,
            key=lambda t: (places.index(t.outcome), -t.explained if math.isfinite(t.explained) else math.inf),
        )
    )


def tried_rows(diagnosis: Diagnosis) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Header and rows on the tried effects: name, screened share, closed share, certainty, outcome."""
    header = ("Effect", "Screened", "Closed", "Certainty", "Outcome")
    rows = tuple(
        (t.effect, percent(t.explained), percent(t.closed), sigma_words(t.certainty) or "-", OUTCOME_WORDS[t.outcome])
        for t in tried_in_order(diagnosis)
    )
    return header, rows


def changed(diagnosis: Diagnosis) -> bool:
    """Whether there is an `after` besides the `before`: the verdict may add nothing to the model."""
    return bool(diagnosis.budget.entries) or term_kept(diagnosis)


def term_kept(diagnosis: Diagnosis) -> bool:
    """Whether the model after has a proposed term."""
    return diagnosis.proposal is not None and diagnosis.proposal.kept


def before_words(diagnosis: Diagnosis) -> str:
    """How the base model is called in legends."""
    return "before" if changed(diagnosis) else "base model"


def after_words(diagnosis: Diagnosis) -> str:
    """How the extended model is called in legends: `with cogging + proposed term`."""
    effects = [entry.effect for entry in diagnosis.budget.entries]
    if len(effects) > _ONE_BY_ONE:
        effects = [f"the {len(effects)} effects"]
    effects += ["proposed term"] if term_kept(diagnosis) else []
    return "with " + " + ".join(effects) if effects else "after"


def force_display(diagnosis: Diagnosis) -> Display:
    """The unit for forces throughout one report: N (rotary: N m), per mass where no recording tells it."""
    sizes = [float(np.nanmax(np.abs(t.before))) for t in diagnosis.traces if np.isfinite(t.before).any()]
    sizes = sizes or [x for x in (diagnosis.budget.before,) if math.isfinite(x)]
    return scaled_display(diagnosis, max(sizes, default=0.0))


def scaled_display(diagnosis: Diagnosis, size: float) -> Display:
    """The unit in which forces up to `size` read well."""
    display = display_unit("force", diagnosis.axis, size)
    if not diagnosis.force_scale:
        return display
    if diagnosis.axis == "rotary":
        return Display(display.factor, "rad/s²" if display.factor == 1.0 else "mrad/s²")
    return Display(display.factor, f"{display.unit}/kg")


def scale_words(diagnosis: Diagnosis) -> str:
    """One sentence on why forces are not in N; empty where they are."""
    if not diagnosis.force_scale:
        return ""
    if diagnosis.axis == "rotary":
        return (
            "Torques are divided by the inertia (N m per kg m² is rad/s²), which no recording tells; with "
            "--mass (kg m²), or free wheels with and without a known added inertia, they come in N m."
        )
    return (
        "Forces are divided by the mass (N/kg), which no recording tells; with --mass (kg), or free wheels with and "
        "without a known added mass, they come in N."
    )


def coordinate_display(values: np.ndarray, unit: str) -> Display:
    """The unit for a coordinate's values (n,): lengths, angles and speeds, in SI, in what reads well; all else as it
    comes. A linear axis has angles too: where in the field it is.
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(np.max(finite)) if finite.size else 0.0
    kind = "rotary" if unit.startswith("rad") else "linear"
    if unit in ("m", "rad"):
        return display_unit("position", kind, largest)
    if unit in ("m/s", "rad/s"):
        return display_unit("velocity", kind, largest)
    return Display(1.0, "" if unit == "1" else unit)


def number(value: float, digits: int = 3) -> str:
    """A number for people, '-' if there is none, 'inf' if the simulation diverged."""
    return "-" if math.isnan(value) else format_number(value, digits)


def percent(value: float) -> str:
    """A share as `84 %`, below one per cent as `0.4 %`; '-' if there is none."""
    if not math.isfinite(value):
        return "-"
    if 0.995 <= value < 1:  # would be rounded to 100
        return "> 99 %"  # not all
    if 0 < abs(value) < 0.0005:
        return "< 0.1 %" if value > 0 else "> -0.1 %"  # not nothing
    return f"{100 * value:.0f} %" if abs(value) >= 0.0095 or value == 0 else f"{100 * value:.1f} %"


def interval_percent(low: float, high: float) -> str:
    """`[80, 88] %`, empty if there is none."""
    return f"[{100 * low:.0f}, {100 * high:.0f}] %" if math.isfinite(low) and math.isfinite(high) else ""


def sigma_words(certainty: float) -> str:
    """`8.1 σ`, empty if there is none."""
    return f"{certainty:.1f} σ" if math.isfinite(certainty) else ""


def share_words(share: Share | PairShare) -> str:
    """The share of a coordinate or pair; a cross-validated one below zero explains nothing."""
    return percent(max(share.share, 0.0)) if math.isfinite(share.share) else "-"


def p_words(p_value: float) -> str:
    """`p = 0.02`, `p < 0.001`; empty if there is none."""
    if not math.isfinite(p_value):
        return ""
    return f"p < {_LEAST_P:g}" if p_value < _LEAST_P else f"p = {p_value:.2g}"


def effect_meanings(diagnosis: Diagnosis) -> tuple[tuple[str, str], ...]:
    """(name, one sentence of physics) of the effects in the verdict, as far as the library knows them."""
    from linid.physics.effects.registry import EFFECTS

    known = {effect.name: typeset(effect.physics) for effect in EFFECTS}
    names = dict.fromkeys((*diagnosis.verdict.effects, *diagnosis.verdict.equivalent))
    return tuple((name, fitting_words(known[name], diagnosis.axis, diagnosis.model)) for name in names if name in known)


def findings(diagnosis: Diagnosis) -> tuple[tuple[str, str, str], ...]:
    """What the data themselves show: `note` or `warning`, the recordings, what is found."""
    from linid.recording.checks import joined_findings

    return tuple((level, who, typeset(text)) for level, who, text in joined_findings(diagnosis.checks))
