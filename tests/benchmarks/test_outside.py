"""The measuring ground of proposed terms says what its score says."""

from __future__ import annotations

import pytest

from linid.challenge.answers import Answer, Proposal
from linid.physics.effects.registry import find_effect
from tests.benchmarks.outside import best_grade, line, summary
from tests.challenge.test_score import key


def test_rates_are_printed_by_cause_and_in_all() -> None:
    keys = {
        "axis_0001": key("unknown", "soft_rail"),
        "axis_0002": key("unknown", "soft_rail"),
        "axis_0003": key("none"),
    }
    answers = {
        "axis_0001": Answer("unknown", oracle=0.9, proposal=Proposal(("motor_force", "position"), 0.81)),
        "axis_0002": Answer("unknown", oracle=0.9, proposal=Proposal(("velocity",), 0.1)),
        "axis_0003": Answer("none"),
    }
    text = summary(keys, answers)
    assert text[0].split() == ["soft_rail", "exact", "1,", "main", "1", "of", "2;", "closure", "0.51"]
    assert "proposed_where_none: 0 of 1, 0% (0% to 79%)" in text
    assert "exact" in line("axis_0001", keys["axis_0001"], answers["axis_0001"], 3.0)
    assert "wrong" in line("axis_0002", keys["axis_0002"], answers["axis_0002"], 3.0)
    assert "nothing proposed" in line("axis_0003", keys["axis_0003"], answers["axis_0003"], 3.0)


@pytest.mark.parametrize(
    ("said", "effect", "wanted"),
    [
        (("position",), "cogging", "exact"),
        (("position", "velocity"), "cogging", "related"),
        (("velocity",), "cogging", "wrong"),
        (("velocity",), "asymmetric_friction", "exact"),
        (("direction",), "asymmetric_friction", "exact"),
        (("motor_force", "position"), "current_offset", "exact"),
        ((), "constant_force", "exact"),
        (("position",), "constant_force", "wrong"),
    ],
)
def test_the_best_of_several_answers_counts(said: tuple[str, ...], effect: str, wanted: str) -> None:
    assert best_grade(said, find_effect(effect).depends_on) == wanted
