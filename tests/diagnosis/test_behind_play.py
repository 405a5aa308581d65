"""Play between motor and encoder, hidden in a campaign, is named, and friction is what it is behind it."""

from __future__ import annotations

from pathlib import Path

import pytest

import linid
from linid.challenge.files import write_hidden_campaign
from linid.challenge.make import Plan, make_campaign


@pytest.mark.parametrize("index", [5, *(pytest.param(k, marks=pytest.mark.exhaustive) for k in range(5))])
def test_play_is_named(index: int, tmp_path: Path) -> None:
    """The plant's contact gives way before it carries the reading along, linid's does not."""
    hidden = make_campaign(Plan(93, effects=("backlash",), kinds=("single",), strength=(0.3, 1.0)), index)
    write_hidden_campaign(hidden, tmp_path, fresh=False)
    found = linid.diagnose(linid.read(tmp_path / hidden.name / "campaign.yaml"), jobs=2)
    assert found.verdict.effects == ("backlash",)
    assert found.found.diagnosis.budget.closed > 0.8
    play = next(e.value for e in found.found.after.estimates if e.name == "backlash_gap")
    assert 0.6 * hidden.effects[0].amplitude < play < 1.1 * hidden.effects[0].amplitude
