"""What depends on what is told: each hidden force on a synthetic axis gets its own arguments, and noise alone none."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from linid.diagnosis.proposed.history import memory_of
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import AS_GOOD, candidates, judged_families, propose
from tests.diagnosis.proposed.axis import CREEPING, MASS, RECORDINGS, Force, axis, rows_of


def wave(period: float) -> Force:
    return lambda p: 0.8 * np.sin(2.0 * math.pi * p.rows.y / period + 1.0)


def vibration(p: Problem) -> np.ndarray:
    """13 Hz, which each recording meets at a phase of its own."""
    phase = np.random.default_rng(5).uniform(0.0, 2.0 * math.pi, RECORDINGS)[p.rows.recording]
    return np.asarray(np.sin(2.0 * math.pi * 13.0 * p.rows.t + phase))


def walk(p: Problem) -> np.ndarray:
    """A force that wanders, with a memory of 0.3 s."""
    steps = np.random.default_rng(4).standard_normal(p.rows.t.size)
    return np.asarray(0.8 * lfilter([math.sqrt(1.0 - 0.99**2)], [1.0, -0.99], steps))


def running_time(p: Problem) -> np.ndarray:
    return p.elapsed[p.rows.recording] + p.rows.t


def after_rest(p: Problem) -> np.ndarray:
    memory = memory_of(p.rows)
    return np.asarray(3.0 * memory.rest * np.exp(-memory.slid / 0.02) * p.friction)


def late(p: Problem) -> np.ndarray:
    """What a motor's force is short of that acts 4 ms late, told by what accelerates: friction hardly changes."""
    return np.asarray(-4e-3 * p.rates(MASS * p.rows.a[:, None])[:, 0])


HIDDEN: dict[str, tuple[Force, tuple[str, ...], str]] = {
    "wave": (wave(0.023), ("position",), r"waves of 43\.\d+ per m, force"),
    "friction wave": (
        lambda p: wave(0.017)(p) * p.friction,
        ("position", "direction"),
        r"waves of 58\.8\d* per m, fri.*",
    ),
    "place": (lambda p: 1.5 * np.exp(-(((p.rows.y - 0.35) / 0.02) ** 2)), ("position",), "position"),
    "velocity": (lambda p: -1.5 * p.rows.v**3, ("velocity",), "velocity"),
    "load": (lambda p: 0.6 * np.abs(p.push) * p.friction, ("motor_force", "direction"), "force_size x direction"),
    "reversal": (
        lambda p: 2.0 * np.exp(-memory_of(p.rows).travel / 0.01) * p.friction,
        ("travel", "direction"),
        "travel x direction",
    ),
    "rest": (after_rest, ("rest_time", "direction"), "rest_time and slid x direction"),
    "cooler": (
        lambda p: 0.8 * np.sin(2.0 * math.pi * running_time(p) / 14.0) * p.friction,
        ("campaign_time", "direction"),
        r"waves of 0\.071\d* per s, friction",
    ),
    "vibration": (vibration, ("time",), r"waves of 13\.0\d* per s, phase by recording"),
    "late": (late, ("motor_force",), "force_rate"),
    "walk": (walk, ("time",), "wandering force"),
}


@pytest.mark.parametrize("name", HIDDEN)
def test_a_hidden_force_gets_its_own_arguments(name: str) -> None:
    force, arguments, form = HIDDEN[name]
    problem = axis(force, rests=name == "rest")
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None
    assert proposal.arguments == arguments
    assert re.fullmatch(form, proposal.family.form), proposal.family.form
    assert proposal.low <= proposal.closed and proposal.closed > (0.6 if name == "walk" else 0.95)
    assert proposal.p_value == pytest.approx(0.01)


@pytest.mark.parametrize("scaled", [True, False])
@pytest.mark.parametrize(
    ("level", "form"),
    [
        (lambda p: wave(0.017)(p), r"waves of 58\.8\d* per m, friction"),
        (lambda p: 0.8 * np.sin(2.0 * math.pi * running_time(p) / 14.0), r"waves of 0\.071\d* per s, friction"),
    ],
    ids=["wave", "cooler"],
)
def test_rows_tell_what_scales_friction_from_what_adds_to_it(level: Force, form: str, scaled: bool) -> None:
    """Where the axis creeps, what presses harder has more to rub than a seal that rubs besides."""
    problem = axis(lambda p: level(p) * p.friction * (p.stribeck if scaled else 1.0), creeping=CREEPING)
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None and re.fullmatch(form, proposal.family.form), proposal
    assert proposal.family.scaled == scaled == ("stribeck" in proposal.family.formula)
    assert proposal.closed > 0.95


def test_waves_of_a_turn_have_whole_orders() -> None:
    """What a shaft meets once or so often per turn, on an axis that turns for long."""
    problem = axis(lambda p: 0.5 * np.sin(7.0 * p.rows.y) + 0.3 * np.cos(3.0 * p.rows.y), rotary=True, stroke=20.0)
    proposal = propose(problem, judged_families(problem))
    assert proposal is not None and proposal.arguments == ("position",) and proposal.closed > 0.95
    assert proposal.family.form == "waves of 1.114, 0.4775 per rad, force"  # 7 and 3 over 2 pi


def test_what_a_fast_recording_hides_is_found_in_a_slow_one() -> None:
    """Two fitted recordings: in one the axis is so fast that the rows see nothing of the wave, in the other it has a
    vibration that no other recording repeats."""
    problem = axis(wave(0.023))
    held = problem.rows.recording % 4 == 1
    kept = np.isin(problem.rows.recording, (0, 2)) | held
    few = rows_of(problem, kept)
    fast = few.rows.recording == 0
    blur = np.where(fast, 0.1, 0.0)  # s
    residual = np.where(fast, few.residual - wave(0.023)(few) / few.mass, few.residual)
    own = np.where(few.rows.recording == 2, np.sin(2.0 * math.pi * 31.0 * few.rows.t), 0.0)
    few = replace(few, blur=blur, residual=residual + own)
    judged = judged_families(few)
    assert "time" in judged[0].family.arguments and judged[0].closed() < 0.05
    proposal = propose(few, judged)
    assert proposal is not None and proposal.arguments == ("position",) and proposal.closed > 0.6
    assert re.match(r"waves of 43\.", proposal.family.form), proposal.family.form


def test_nothing_is_proposed_on_noise_alone() -> None:
    for seed in range(20):
        problem = axis(None, seed, memory=0.3 * (seed % 3))
        assert propose(problem, judged_families(problem)) is None, seed


def test_of_equals_the_one_of_fewest_arguments_comes_first() -> None:
    problem = axis(wave(0.023))
    judged = judged_families(problem)
    first, *rest = candidates(judged)
    assert first.best[1] >= AS_GOOD * judged[0].best[1]
    assert all(len(one.family.arguments) >= 1 for one in rest) and len(first.family.arguments) == 1
