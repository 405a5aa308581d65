"""What a feed-forward would save in words and rows: following errors, what each effect costs, what cannot be met."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from linid.report.diagnosis.content import number, percent
from linid.report.display import display_unit
from linid.report.symbols import typeset

if TYPE_CHECKING:
    from linid.diagnosis.compensation_data import Compensation, Ranged
    from linid.diagnosis.report_data import Diagnosis
    from linid.report.display import Display

COMPENSATION_TITLE = "What a feed-forward would save"
FOLLOWING_HEADER = ("Following error", "RMS", "95 %", "Largest", "95 %", "Saved")
COST_HEADER = ("Effect", "Costs", "95 %", "Its part saves", "95 %", "Remarks")
CASES = (
    ("without", "Without feed-forward"),
    ("base", "With that of the base model"),
    ("full", "With that of the model after"),
)


def compensation_display(diagnosis: Diagnosis) -> Display:
    """The unit in which the following errors read well."""
    told = diagnosis.compensation
    return display_unit("position", diagnosis.axis, 0.0 if told is None else told.without.rms.value)


def compensation_words(diagnosis: Diagnosis) -> str:
    """What was simulated and what came out, in two or three sentences; empty where it was not asked for."""
    told = diagnosis.compensation
    if told is None:
        return ""
    if told.refused:
        return f"No figure for the following error: {told.refused}."
    display = compensation_display(diagnosis)
    without, base, full = (_with_range(getattr(told, case).rms, display) for case, _ in CASES)
    words = f"Following error (RMS) in the drive's loops: {without} {display.unit} without feed-forward"
    if not told.effects:
        return f"{words}, {full} with the one of `linid export --to twincat` ({_less(told)})."
    words += f", {base} with that of the base model, {full} with that of the model after ({_less(told)})."
    dearest = max(told.effects, key=lambda one: one.cost.value)
    if dearest.cost.value > 0.0:
        saved = f", its part of the feed-forward saves {_with_range(dearest.saved, display)}" if dearest.held else ""
        words += f" {_label(dearest.effect)} costs most: {_with_range(dearest.cost, display)} {display.unit}{saved}."
    return words


def _less(told: Compensation) -> str:
    return f"{percent(told.saved)} less" if told.saved >= 0.0 else f"{percent(-told.saved)} more"


def following_rows(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """A row of `FOLLOWING_HEADER` for each feed-forward; none where there is no figure."""
    told = diagnosis.compensation
    if told is None or told.refused:
        return ()
    display, whole = compensation_display(diagnosis), told.without.rms.value
    rows = []
    for case, title in CASES:
        if case == "base" and not told.effects:
            continue
        found = getattr(told, case)
        saved = "-" if case == "without" or not whole > 0.0 else percent(1.0 - found.rms.value / whole)
        rms, largest = ((_one(x, display), _range(x, display)) for x in (found.rms, found.largest))
        rows.append((f"{title} ({display.unit})", *rms, *largest, saved))
    return tuple(rows)


def cost_rows(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """A row of `COST_HEADER` for each named effect, the one that costs most first."""
    told = diagnosis.compensation
    if told is None:
        return ()
    display = compensation_display(diagnosis)
    ranked = sorted(told.effects, key=lambda one: -one.cost.value)
    return tuple(
        (
            f"{_label(one.effect)} ({display.unit})",
            _one(one.cost, display),
            _range(one.cost, display),
            _one(one.saved, display) if one.held else "nothing",
            _range(one.saved, display),
            one.reason,
        )
        for one in ranked
    )


def compensation_tables(diagnosis: Diagnosis) -> list[tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]]:
    """Headers and rows of the tables that have rows."""
    tables = [(FOLLOWING_HEADER, following_rows(diagnosis)), (COST_HEADER, cost_rows(diagnosis))]
    return [(header, rows) for header, rows in tables if rows]


def compensation_setting(diagnosis: Diagnosis) -> str:
    """Which drive, which motion, what the figures and intervals hold; empty where there is no figure."""
    told = diagnosis.compensation
    if told is None or told.refused:
        return ""
    words = f"Simulated: {told.drive}, along {told.reference}. "
    words += "The feed-forward is the one that linid export --to twincat writes: its own tables, at the command. "
    if told.effects:
        words += (
            "Costs: RMS following error of the axis with the effect, less that without it, no feed-forward. Its part "
            "saves: what is left without that part of the feed-forward, less what is left with it. Errors add as "
            "squares: beside a larger one a small one costs little. "
        )
    if told.draws:
        words += (
            f"Figures are medians and 95 % intervals of {told.draws} axes drawn from the covariance of the parameters "
            f"(seed {told.seed}), while the feed-forward stays as identified. "
        )
    else:
        words += "The fit tells no covariance: no intervals. "
    if diagnosis.force_scale:
        words += "That no recording tells the mass does not matter here: loops see forces per mass only. "
    return typeset(f"{words}What the budget leaves unexplained, and what the encoder does not see, is in none of them.")


def _label(effect: str) -> str:
    from linid.physics.effects.registry import find_effect  # compiles: not for those who name no effect

    name = find_effect(effect).short
    return "Proposed term" if name == "learned" else name.replace("_", " ").capitalize()


def _one(ranged: Ranged, display: Display) -> str:
    return number(ranged.value * display.factor)


def _range(ranged: Ranged, display: Display) -> str:
    if not math.isfinite(ranged.low):
        return "-"
    return f"[{number(ranged.low * display.factor)}, {number(ranged.high * display.factor)}]"


def _with_range(ranged: Ranged, display: Display) -> str:
    told = _range(ranged, display)
    return _one(ranged, display) + ("" if told == "-" else f" {told}")
