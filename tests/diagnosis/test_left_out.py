"""Effects that are left out of consideration: the data themselves must ask for what they would explain."""

from __future__ import annotations

import pytest

import linid
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
