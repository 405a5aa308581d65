"""What a proposed term says, literally."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.describe import closed_interval, described, in_the_model
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import judged_families, propose
from linid.diagnosis.proposed.waves import wave_families
from linid.diagnosis.proposed.words import listed, next_experiment, not_on, sentence
from tests.diagnosis.proposed.axis import axis, family_of, formula_of, proposal_of


def derated(problem: Problem) -> Array:
    """Thrust per ampere that falls with speed, in N."""
    return -0.3 * problem.push * np.abs(problem.rows.v)


@pytest.mark.parametrize(
    ("words", "text"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_lists(words: list[str], text: str) -> None:
    assert listed(words) == text


@pytest.mark.parametrize(
    ("form", "without", "text"),
    [
        (
            "speed x motor force",
            ("position", "time"),
            "What is left depends on velocity and motor force, not on position or time in the recording (p ≤ 0.01); "
            "a term of these closes 83 % [75, 88] of it.",
        ),
        (
            "velocity",
            (),
            "What is left depends on velocity (p ≤ 0.01); a term of velocity alone closes 83 % [75, 88] of it.",
        ),
        (
            "pole_phase",
            ("velocity", "motor_force", "acceleration", "time", "travel"),
            "What is left depends on position (period 31.4 mm), not on velocity, motor force or time in the recording "
            "(p ≤ 0.01); a term of position alone closes 83 % [75, 88] of it.",
        ),
        ("constant", (), "What is left is a constant force (p ≤ 0.01); it closes 83 % [75, 88] of it."),
        (
            "force per recording",
            (),
            "What is left is a constant force, another one in each recording (p ≤ 0.01); "
            "it closes 83 % [75, 88] of it.",
        ),
        (
            "inertia per recording",
            (),
            "What is left depends on acceleration, with another size in each recording (p ≤ 0.01); "
            "a term of acceleration alone closes 83 % [75, 88] of it.",
        ),
    ],
)
def test_sentences(form: str, without: tuple[str, ...], text: str) -> None:
    problem = axis(derated)
    assert sentence(problem, proposal_of(problem, form, 0.83), without, 0.75, 0.88) == text


def test_a_rotary_axis_has_torques() -> None:
    problem = axis(derated, rotary=True)
    said = sentence(problem, proposal_of(problem, "motor_force", 0.5), (), 0.4, 0.6)
    assert (
        said
        == "What is left depends on motor torque (p ≤ 0.01); a term of motor torque alone closes 50 % [40, 60] of it."
    )


def test_a_vibration_with_a_phase_of_its_own_in_each_recording() -> None:
    phases = np.random.default_rng(5).uniform(0.0, 6.0, 12)
    problem = axis(lambda p: np.sin(2.0 * np.pi * 13.0 * p.rows.t + phases[p.rows.recording]))
    waves = wave_families(problem, arguments_of(problem), Leftover(problem).of_rows)
    proposal = replace(proposal_of(problem, next(one for one in waves if one.local)), p_value=0.02)
    assert sentence(problem, proposal, (), 0.7, 0.9) == (
        "What is left depends on time in the recording (13 Hz, another phase in each recording) (p = 0.02); "
        "a term of time in the recording alone closes 80 % [70, 90] of it."
    )


@pytest.mark.parametrize(
    ("form", "text"),
    [
        ("position", "a slow move to and fro over the whole stroke of 470 mm, at 20 mm/s and at 0.2 m/s"),
        ("motor_force", "the same move with an added mass of about 1 kg"),
        ("force_size x direction", "the same move with an added mass of about 1 kg"),
        ("campaign_time", "the same recording again after half an hour"),
        ("rest_time x direction", "starts after rests of 0.1, 1, 10 and 30 s"),
        ("travel x direction", "small moves to and fro of growing amplitude, from 0.5 mm to 50 mm"),
        ("one direction", "the same move forth and back at 0.2 m/s"),
        ("force per recording", "the same recording twice in a row, with nothing changed between them"),
    ],
)
def test_the_recording_that_would_test_it(form: str, text: str) -> None:
    problem = axis(derated)
    assert next_experiment(problem, proposal_of(problem, form)) == f"To test it, record {text}."


def test_two_arguments_ask_for_two_recordings() -> None:
    problem = axis(derated)
    said = next_experiment(problem, proposal_of(problem, "speed x motor force"))
    assert said.startswith("To test it, record moves to and fro over ")
    assert said.endswith(" m/s; and the same move with an added mass of about 1 kg.")


def test_what_a_force_is_not_of() -> None:
    problem = axis(derated)
    judged = judged_families(problem)
    proposal = proposal_of(problem, "speed x motor force", 0.95)
    without = not_on(problem, proposal, judged)
    assert {"position", "time", "travel"} <= set(without)
    assert not {"velocity", "motor_force"} & set(without)


def test_a_term_that_closes_little_rules_nothing_out() -> None:
    problem = axis(derated)
    assert not_on(problem, proposal_of(problem, "speed x motor force", 0.3), judged_families(problem)) == ()


def test_a_rival_of_other_arguments_is_not_ruled_out() -> None:
    """Where a force over position would do as well, position is not denied."""
    problem = axis(lambda p: np.sin(10.0 * p.rows.y))
    judged = judged_families(problem)
    assert "position" not in not_on(problem, replace(proposal_of(problem, "velocity"), gain=judged[0].best[1]), judged)


def test_a_proposal_in_full() -> None:
    problem = axis(derated)
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None
    assert set(proposal.arguments) == {"velocity", "motor_force"}
    known = {"input_delay": problem.pushed(derated(problem)[:, None])}
    term = described(problem, proposal, judged_families(problem), known, formula_of(problem, proposal), ("cogging",))
    assert term.refines == ()
    assert term.sentence.startswith("What is left depends on velocity and motor force, not on position,")
    assert term.curve is not None
    assert term.short is not None
    assert term.short.text.endswith(" per (m/s) · |v| · F")
    assert term.effect == proposal.family.formula
    assert (term.kept, term.measures) == (False, {})
    assert 0.0 <= term.low <= term.closed <= term.high <= 1.0
    assert [one.effect for one in term.resembles] == ["input_delay"]
    assert term.resembles[0].difference == "input delay depends on motor force alone; the term also on velocity"
    assert "position" in term.not_on


def test_the_interval_is_about_what_is_closed() -> None:
    problem = axis(derated)
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None
    low, high = closed_interval(proposal)
    assert low <= proposal.closed <= high
    assert low == pytest.approx(proposal.low, abs=0.05)


def test_nothing_is_said_where_nothing_is_missing() -> None:
    problem = axis(None)
    assert propose(problem, judged_families(problem)) is None


def test_the_form_of_a_family_is_found() -> None:
    assert family_of(axis(derated), "position").arguments == ("position",)


def test_what_a_term_closes_in_the_model_is_told_of_the_model() -> None:
    problem = axis(derated)
    proposal = proposal_of(problem, "speed x motor force")
    term = described(problem, proposal, [proposal.regression], {}, None, ())
    # A model that leaves the noise, one that leaves all, and one that leaves half the power above the noise.
    noise = np.random.default_rng(5).standard_normal(problem.residual.size) * np.sqrt(problem.noise)
    beyond = float(np.mean(problem.residual[problem.held] ** 2)) / float(np.mean(problem.noise)) - 1.0
    for left, closed in ((noise, 1.0), (problem.residual, 0.0), (noise * np.sqrt(1.0 + 0.5 * beyond), 0.5)):
        there = in_the_model(term, problem, proposal, [proposal.regression], left)
        assert there.closed == pytest.approx(closed, abs=0.03)
        assert there.low <= max(there.closed, 0.0) <= there.high
        assert f"closes {round(100 * there.closed)} %" in there.sentence
