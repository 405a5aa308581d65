"""The measures of a diagnosis in words: what they say, and what they cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linid.diagnosis.report_data import Change, PairShare
from linid.report.diagnosis_content import pairs_left_out, shown_pairs, tried_in_order
from linid.report.diagnosis_measures import AT_FLOOR, WORSE, measure_remarks, state
from linid.report.residual_views import pair_slopes

from .diagnosis_samples import explained, partly
from .samples import NAN

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


@given(*[st.floats(1e-6, 10.0)] * 3)
def test_a_percentage_lies_within_0_and_100(before: float, after: float, floor: float) -> None:
    text = state(Change(before, after, floor))
    if text not in (AT_FLOOR, WORSE):
        assert 0 <= float(text.strip("<> %")) <= 100


def test_what_cannot_be_said_is_told_with_its_reason() -> None:
    base = explained()
    assert measure_remarks(base, base.measures) == ()
    changes = {"free_run": Change(0.02, INF, 0.001), "ahead": Change(1e-5, 9e-6, 3e-5), "force": Change(1.0, 0.2, NAN)}
    said = measure_remarks(base, changes)
    assert [text.split(",")[0] for text in said] == ["Free run", "0.1 s ahead", "Residual force"]
    assert "diverges" in said[0] and "floor is too high" in said[1] and "no floor is known" in said[2]
    stuck = {**base.measures, "free_run": Change(0.02, 0.0195, 0.001)}
    (one,) = measure_remarks(base, stuck)
    assert "first state" in one
    assert measure_remarks(replace(base, budget=replace(base.budget, closed=0.3)), stuck) == ()


def test_only_the_strongest_of_overlapping_pairs_is_shown() -> None:
    diagnosis = partly()
    shown = shown_pairs(diagnosis)
    assert [(p.x_coordinate, p.y_coordinate) for p in shown] == [("position", "velocity"), ("time", "current")]
    assert pairs_left_out(diagnosis).startswith("1 weaker pair that shares")
    assert pairs_left_out(replace(diagnosis, pairs=shown)) == ""


def test_tried_effects_come_by_outcome_then_by_what_they_explain() -> None:
    found = [(t.outcome, t.effect) for t in tried_in_order(partly())]
    assert [name for outcome, name in found if outcome == "named"] == [
        "cogging", "cable_force", "asymmetric_friction", "quadratic_drag",
    ]  # fmt: skip
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
