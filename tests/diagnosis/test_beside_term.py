"""A second cause that is smaller than what the library's form of the first one leaves."""

from __future__ import annotations

from pathlib import Path

import pytest

import linid
from linid.challenge.files import write_hidden_campaign
from linid.challenge.make import Plan, make_campaign


@pytest.mark.exhaustive
def test_a_small_drag_shows_beside_cogging_once_a_term_takes_what_its_form_leaves(tmp_path: Path) -> None:
    """Cogging that swells along the track has 99.6 % of the gap, drag .35 %: the form of waves that the library has
    leaves several times that."""
    hidden = make_campaign(Plan(9995, kinds=("pair", "crowd")), 5)
    assert {effect.name for effect in hidden.effects} == {"cogging", "quadratic_drag"}
    write_hidden_campaign(hidden, tmp_path, fresh=False)
    found = linid.diagnose(linid.read(tmp_path / hidden.name / "campaign.yaml"), "sine")
    assert set(found.verdict.effects) == {"cogging", "quadratic_drag"}
    assert found.proposal is not None and found.proposal.arguments == ("position",)
