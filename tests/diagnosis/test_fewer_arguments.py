"""A term gives way to one of fewer arguments that the model closes as much with, and to no other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.diagnosis.lead import Lead, with_fewer_arguments
from linid.diagnosis.proposed import propose as rules
from linid.diagnosis.proposed.propose import AS_GOOD, judged_families
from tests.diagnosis.proposed.axis import axis


def lead_of_wave() -> Lead:
    """A wave in position whose fullest family is that of position and motor force."""
    problem = axis(lambda p: 0.8 * np.sin(2.0 * math.pi * p.rows.y / 0.023 + 1.0))
    judged = judged_families(problem)
    full = max((one for one in judged if "motor_force" in one.family.arguments), key=lambda one: one.best[1])
    proposal = rules.tested(problem, full)
    assert proposal is not None and proposal.arguments == ("position", "motor_force")
    return Lead(problem, tuple(judged), proposal, None, None)  # type: ignore[arg-type]


@pytest.mark.parametrize(("of_fewer", "wanted"), [(0.9, ("position",)), (0.8, ("position", "motor_force"))])
def test_what_the_model_closes_decides(monkeypatch: pytest.MonkeyPatch, of_fewer: float, wanted: tuple[str]) -> None:
    lead = lead_of_wave()
    assert 0.8 < 0.95 * AS_GOOD < 0.9
    closes = {("position",): of_fewer, ("position", "motor_force"): 0.95}
    monkeypatch.setattr(Lead, "closes", property(lambda one: closes[one.proposal.arguments]))
    assert with_fewer_arguments(lead).proposal.arguments == wanted
