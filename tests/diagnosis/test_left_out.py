"""Effects that are left out of consideration: the data themselves must ask for what they would explain."""

from __future__ import annotations

from pathlib import Path

import pytest

import linid
from linid.challenge.files import write_hidden_campaign
from linid.challenge.make import Plan, make_campaign
from linid.interface.stages import base_kind
from tests.diagnosis.test_controls import coast_downs


def test_a_left_out_effect_is_not_named_and_its_force_is_proposed() -> None:
    campaign = linid.Campaign.of(coast_downs("quadratic_drag", {"drag_coefficient": 6.0}, 1.5))
    left_out = ("quadratic_drag", "eddy_current_drag")
    found = linid.diagnose(campaign, "friction", without=left_out)
    seen = {*found.verdict.effects, *found.verdict.equivalent, *(t.effect for t in found.found.diagnosis.tried)}
    assert not seen & set(left_out)
    assert "left out of consideration: quadratic drag" in found.found.diagnosis.assumptions
    assert found.proposal is not None and "velocity" in found.proposal.arguments
    assert not {one.effect for one in found.proposal.resembles} & set(left_out)


@pytest.mark.exhaustive
def test_friction_that_knows_the_direction_is_no_constant_force_with_a_rest(tmp_path: Path) -> None:
    """Wherever the axis slides it is a constant force, which the library has; what that leaves at reversals is of the
    same cause, and no term of the travel."""
    hidden = make_campaign(Plan(10003, kinds=("single",), strength=(0.1, 1.0)), 2)
    assert [effect.name for effect in hidden.effects] == ["asymmetric_friction"]
    write_hidden_campaign(hidden, tmp_path, fresh=False)
    campaign = linid.read(tmp_path / hidden.name / "campaign.yaml")
    found = linid.diagnose(campaign, base_kind(campaign.recordings), without=("asymmetric_friction",))
    assert found.verdict.effects == () and found.proposal is not None
    assert found.proposal.arguments == ("direction",) and found.proposal.closed > 0.95


@pytest.mark.parametrize(
    ("settings", "fact"),
    [
        (
            {"without": ["quadratic_drug"]},
            "--without: there is no effect 'quadratic_drug'. Did you mean 'quadratic_drag'",
        ),
        ({"without": ["cogging"], "effects": ["cogging"]}, "--without: cogging is in the base"),
        ({"without": ["d: -c*v"]}, "--without: d is a term of your own"),
    ],
)
def test_wrong_names_are_refused(settings: dict[str, list[str]], fact: str) -> None:
    campaign = linid.Campaign.of(coast_downs("constant_force", {"constant_force": 0.0}, 0.6))
    with pytest.raises(linid.UsageError) as caught:
        linid.diagnose(campaign, "friction", **settings)
    assert fact in str(caught.value)
