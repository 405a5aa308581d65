"""The measures of a diagnosis in words: what they say, and what they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linid.diagnosis.report_data import Change, PairShare
from linid.physics.effects.registry import find_effect
from linid.report.diagnosis.content import pairs_left_out, shown_pairs, tried_in_order
from linid.report.diagnosis.measures import AT_FLOOR, WORSE, measure_remarks, state
from linid.report.diagnosis.words import in_axis_words, parameters_in_use
from linid.report.residual_views import pair_slopes

from .diagnosis_parts import entry
from .diagnosis_samples import COGGING, at_floor, explained, partly
from .samples import NAN, estimate

INF = float("inf")


def test_states_by_hand() -> None:
    assert state(Change(5.0, 3.0, 3.0)) == AT_FLOOR
    assert state(Change(5.0, 2.0, 3.0)) == AT_FLOOR
    assert state(Change(5.0, 4.0, 3.0)) == "56 %"  # 9/16
    assert state(Change(5.0, 5.0, 3.0)) == "0 %"
    assert state(Change(5.0, 6.0, 3.0)) == WORSE
    assert state(Change(2.0, 1.9, 3.0)) == AT_FLOOR
    assert state(Change(2.0, INF, 1.0)) == WORSE
    for unclear in (Change(2.0, 1.0, NAN), Change(NAN, 1.0, 0.5), Change(1.0, NAN, 0.5), Change(INF, 1.0, 0.5)):
        assert state(unclear) == "-"
    assert state(Change(2.0, 2.001, 2.0)) == "-"


@given(*[st.floats(1e-6, 10.0)] * 3)
def test_a_percentage_lies_within_0_and_100(before: float, after: float, floor: float) -> None:
    text = state(Change(before, after, floor))
    if text == "-":
        assert before <= floor < after
    elif text not in (AT_FLOOR, WORSE):
        assert 0 <= float(text.strip("<> %")) <= 100


def test_what_cannot_be_said_is_told_with_its_reason() -> None:
    base = replace(explained(), verdict=partly().verdict)
    assert measure_remarks(base, base.measures) == ()
    changes = {"free_run": Change(0.02, INF, 0.001), "ahead": Change(1e-5, 9e-6, 3e-5), "force": Change(1.0, 0.2, NAN)}
    said = measure_remarks(base, changes)
    assert [text.split(",")[0] for text in said] == ["Residual force", "0.1 s ahead", "Free run"]
    assert "no floor is known" in said[0] and "floor is too high" in said[1] and "diverges" in said[2]
    assert measure_remarks(base, {name: Change(0.9, 0.9, 1.0) for name in base.measures}) == ()
    high = {name: Change(0.1, 0.1, 1.0) for name in base.measures}
    (one,) = measure_remarks(base, high)
    assert one.startswith("Free run, NRMSE; 0.1 s ahead, RMS; Residual force, RMS: the floor is too high")
    stuck = {**base.measures, "free_run": Change(0.02, 0.0195, 0.001)}
    (one,) = measure_remarks(base, stuck)
    assert "first state" in one
    assert measure_remarks(replace(base, budget=replace(base.budget, closed=0.3)), stuck) == ()


def test_a_measure_above_its_floor_names_its_recordings_where_the_verdict_sees_no_gap() -> None:
    """The verdict is on the force: a prediction that stays above its own floor is told with what keeps it there."""
    base = at_floor()
    rows = [replace(one, split="held_out") for one in base.recordings]
    quiet = {"ahead": Change(42e-6, 42e-6, 40e-6)}
    rows = [replace(one, changes=quiet) for one in rows]
    assert measure_remarks(replace(base, recordings=tuple(rows)), quiet) == ()  # within what is known of a floor
    rows[2] = replace(rows[2], changes={"ahead": Change(4.7e-3, 4.7e-3, 974e-6)}, jumps=True)
    above = {"ahead": Change(1.9e-3, 1.9e-3, 0.4e-3)}
    made = replace(base, recordings=tuple(rows))
    (one,) = measure_remarks(made, above)
    assert one.startswith("0.1 s ahead, RMS: above its floor; the verdict is on the residual force. ")
    assert "comes from moves_3 (4700 µm, floor 974 µm)." in one and "There the input jumps" in one
    rows[4] = replace(rows[4], changes={"ahead": Change(4.1e-3, 4.1e-3, 40e-6)})
    (one,) = measure_remarks(replace(base, recordings=tuple(rows)), above)
    assert "In moves_3 the input jumps" in one
    rows[2] = replace(rows[2], jumps=False)
    (one,) = measure_remarks(replace(base, recordings=tuple(rows)), above)
    assert "from moves_3 (4700 µm, floor 974 µm), moves_5 (4100 µm, floor 40 µm)." in one and "jumps" not in one
    assert measure_remarks(replace(made, verdict=partly().verdict), above) == ()  # a gap is told of already
    (one,) = measure_remarks(replace(base, recordings=()), {"force": Change(2.0, 2.0, 1.0)})
    assert one == "Residual force, RMS: above its floor."
    unclear = {"ahead": Change(INF, INF, 1.0), "free_run": Change(2.0, 2.0, INF), "force": Change(2.0, NAN, 1.0)}
    assert not [text for text in measure_remarks(base, unclear) if "above its floor;" in text]


def test_only_the_strongest_of_overlapping_pairs_is_shown() -> None:
    diagnosis = partly()
    shown = shown_pairs(diagnosis)
    assert [(p.x_coordinate, p.y_coordinate) for p in shown] == [("position", "velocity"), ("time", "current")]
    assert pairs_left_out(diagnosis).startswith("1 weaker pair that shares")
    assert pairs_left_out(replace(diagnosis, pairs=shown)) == ""


def test_tried_effects_come_by_outcome_then_by_what_they_explain() -> None:
    found = [(t.outcome, t.effect) for t in tried_in_order(partly())]
    assert [name for outcome, name in found if outcome == "named"] == [
        "cogging",
        "cable_force",
        "asymmetric_friction",
        "quadratic_drag",
    ]
    assert [outcome for outcome, _ in found] == ["named"] * 4 + ["rival", "dropped"] + ["screened"] * 4
    assert found[-1][1] == "payload_change"  # its share is not known


def test_slopes_of_a_proportion() -> None:
    x_edges, y_edges = np.linspace(0.0, 3.0, 4), np.linspace(-1.0, 1.0, 6)
    y = 0.5 * (y_edges[1:] + y_edges[:-1])
    mean = np.array([1.0, -2.0, 0.5]) * y[:, None] + np.array([0.0, 3.0, 1.0])
    rows = np.full((5, 3), 20)
    mean[0, 0], rows[0, 0] = np.nan, 0
    mean[1:, 2] = np.nan
    pair = PairShare("t", "i", "t", "i", "s", "A", "proportional", 0.1, 0.01, x_edges, y_edges, mean, rows)
    assert pair_slopes(pair)[:2] == pytest.approx([1.0, -2.0])
    assert np.isnan(pair_slopes(pair)[2])


def test_entries_without_floors_of_their_own_get_those_of_the_diagnosis() -> None:
    base = partly()
    (first, *_), floors = base.budget.entries, {name: c.floor for name, c in base.measures.items()}
    bare = replace(first, measures={name: replace(c, floor=NAN) for name, c in first.measures.items()})
    told = in_axis_words(replace(base, budget=replace(base.budget, entries=(bare, first))))
    assert {name: c.floor for name, c in told.budget.entries[0].measures.items()} == floors
    assert told.budget.entries[1].measures == first.measures


def test_parts_of_an_effect_that_do_not_act_are_left_out() -> None:
    names = [p.name for p in find_effect("external_disturbance").parameters]
    acting = {name for name in names if name.endswith(("_1", "_3")) and name.startswith("disturbance_force")}
    values = [estimate(name, "x", "N", 0.4 if name in acting else 0.0, 0.1) for name in names]
    told = parameters_in_use(entry("external_disturbance", 0.5, parameters=tuple(values)))
    assert {one.name.rsplit("_", 1)[1] for one in told} == {"1", "3"}
    assert len(told) == 2 * sum(name.endswith("_1") for name in names)
    one_part = entry("cogging", 0.5, parameters=COGGING)
    assert parameters_in_use(one_part) == COGGING
