"""The true term of a hidden cause closes the gap, and a false one does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linid import api
from linid.challenge.create import make_challenge
from linid.challenge.files import read_keys_file
from linid.challenge.make import Plan
from linid.challenge.term import plan_body, plan_of, true_term
from linid.diagnosis.oracle import oracle_of_term
from linid.errors import ConfigError
from linid.workflow.commands.challenge import true_term_oracle

PLAN = Plan(31, effects=("soft_rail",), kinds=("unknown",), strength=(0.3, 0.6))


def test_a_plan_comes_back_from_plain_values() -> None:
    plan = Plan(3, effects=("all",), laws=("dahl",), encoders=(1e-7, 1e-6), crowd=(4, 4), kinds=("crowd", "none"))
    assert plan_of(plan_body(plan)) == plan
    with pytest.raises(ConfigError, match="plan"):
        plan_of({"seed": 1, "nonsense": 2})


def test_the_true_term_closes_the_gap_and_a_shifted_one_does_not(tmp_path: Path) -> None:
    make_challenge(PLAN, 1, tmp_path / "made")
    plan = read_keys_file(tmp_path / "made" / "keys.yaml")[1]["plan"]
    path = tmp_path / "made" / "axis_0001" / "campaign.yaml"
    reached = true_term_oracle(path, ("soft_rail",), plan)
    assert reached is not None and 0.97 < reached.closure <= 1.0 and 0.0 < reached.ahead < 0.2
    assert true_term_oracle(path, ("cogging",), plan) is None and true_term_oracle(path, ("soft_rail",), None) is None
    recordings = api.read(path).recordings
    terms = true_term(plan_of(plan), 0)
    late = [np.roll(terms[r.name], r.y.size // 3) for r in recordings]
    wrong = oracle_of_term(recordings, "theta", late, {})
    assert wrong is not None and wrong.closure < 0.3 and wrong.ahead > 0.8
    # Of what acts in held-out recordings alone the fitted ones tell nothing: the base is what it was, about.
    unseen = [np.where(r.split == "held_out", terms[r.name], 0.0) for r in recordings]
    nothing = oracle_of_term(recordings, "theta", unseen, {})
    assert nothing is not None and nothing.closure < 0.3
