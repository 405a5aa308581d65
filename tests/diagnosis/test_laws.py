"""The friction law that recordings prefer: the true one where it shows itself, and none where it does not."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid.challenge.files import write_hidden_campaign
from linid.challenge.hidden_axis import Law
from linid.challenge.make import HiddenCampaign, Plan, make_campaign
from linid.diagnosis.base import Base, fit_base_model, numbered
from linid.diagnosis.judge import Evidence
from linid.diagnosis.law_of_base import PRESLIDING, base_with_law, law_finding, sentence, untold
from linid.diagnosis.laws import (
    LEAST_CLOSED,
    PROMISING,
    LawChoice,
    LawTrial,
    as_good,
    clearly_better,
    promised,
    under_law,
)
from linid.diagnosis.means import Means
from linid.diagnosis.proposed.problem import problem_of
from linid.interface.campaign import Campaign
from linid.interface.friction_law import preferred_law
from linid.interface.settings import make_settings
from linid.recording.campaign import read_campaign
from tests.diagnosis.law_axes import NAMES, recorded, sliding

NOTHING: Any = None  # the tests read figures, not models


@cache
def decided(law: Law) -> tuple[Base, Base, LawChoice]:
    """The base under LuGre, under the law that is preferred, and what is preferred."""
    plain = fit_base_model(recorded(law), "force", {}, Means(), [])
    base, choice = base_with_law(plain, {})
    assert choice is not None
    return plain, base, choice


def hidden_axis(seed: int, law: Law, index: int, folder: Path) -> tuple[HiddenCampaign, Base]:
    """An axis of that friction law and nothing else hidden, and its base under LuGre's."""
    hidden = make_campaign(Plan(seed, kinds=("none",), laws=(law,)), index)
    write_hidden_campaign(hidden, folder, fresh=False)
    recordings = numbered(read_campaign(folder / hidden.name / "campaign.yaml").recordings)
    return hidden, fit_base_model(recordings, "sine", {}, Means(), [])


@pytest.mark.parametrize("law", NAMES)
def test_the_true_law_is_told_where_presliding_was_recorded(law: Law) -> None:
    plain, base, choice = decided(law)
    assert choice.law == NAMES[law]
    finding = law_finding(plain.judge, choice)
    assert finding is not None and finding.law == choice.law and finding.gains.keys() == set(NAMES.values())
    # Where there is no presliding, the models keep LuGre, whose bristle follows what smoothing makes of a stop.
    assert base.fitted.model.law == choice.base == ("lugre" if law == "coulomb" else NAMES[law])


@pytest.mark.parametrize("law", [law for law in NAMES if law not in ("lugre", "coulomb")])
def test_a_term_can_be_sought_beside_any_law(law: Law) -> None:
    """What bristles forget and follow is known under each law, whichever of LuGre's parameters it lacks."""
    _, base, _ = decided(law)
    problem = problem_of(base.judge, base.fitted, 1)
    fast = np.abs(problem.rows.v) > 10.0 * base.fitted.values.get("stribeck_velocity", 0.0) + 0.05
    assert problem.relaxed > 0.0 and np.all(problem.follows > 0.0)
    assert np.all(np.isfinite(problem.resisted(np.ones((problem.rows.t.size, 1)))))
    assert np.median(np.abs(problem.friction[fast])) == pytest.approx(1.0, abs=0.01)


def test_maxwells_axis_leaves_a_gap_under_lugre_and_little_of_it_under_its_own_law() -> None:
    plain, base, choice = decided("maxwell")
    under_lugre, under_its_own = (plain.judge.excess(one.fitted.residual) for one in (plain, base))
    # The damping of the plant's elements fades as they strain, linid's is constant: it ends at about half the plant's.
    assert under_lugre > 8.0 and under_its_own < 0.1 * under_lugre
    assert choice.chosen.on_held_out.power_closed > 0.9


def test_what_is_asked_for_by_auto_is_the_preferred_law() -> None:
    for law in ("maxwell", "lugre"):
        name, words = preferred_law(Campaign.of(recorded(law)), make_settings({}), "force")
        assert name == NAMES[law] and len(words) == 1 and ("Maxwell slip" in words[0]) is (law == "maxwell")


@pytest.mark.parametrize("law", ["lugre", "maxwell", "coulomb"])
def test_free_wheels_that_do_not_stop_tell_no_law(law: Law) -> None:
    name, words = preferred_law(Campaign.of(sliding(law)), make_settings({}), "friction")
    assert name == "lugre" and "not told by these recordings" in words[0] and PRESLIDING in words[0]
    assert all(title in words[0] for title in ("Dahl", "Maxwell slip", "elasto-plastic", "Coulomb"))


def test_too_few_recordings_tell_no_law() -> None:
    name, words = preferred_law(Campaign.of(recorded("maxwell")[:1]), make_settings({}), "friction")
    assert name == "lugre" and "not told" in words[0]


@pytest.mark.parametrize(
    ("gain", "certainty", "closed", "better"),
    [
        (1.0, 9.0, 0.9, True),
        (1.0, 9.0, 0.25, False),  # as much as an effect could close
        (1.0, 1.2, 0.7, True),  # sure enough, as little is left
        (1.0, 1.2, 0.4, False),
        (0.005, 9.0, 0.9, False),  # a trifle
    ],
)
def test_another_law_must_be_clearly_better(gain: float, certainty: float, closed: float, better: bool) -> None:
    assert clearly_better(Evidence(gain, certainty, closed, 1.0, closed)) is better


@pytest.mark.parametrize(
    ("fitted", "held", "certainty", "good"),
    [
        (0.0, 0.0, 0.0, True),
        (-0.04, -0.04, -1.0, True),
        (-0.04, -0.04, -3.0, False),  # surely worse
        (-0.04, -0.005, -3.0, True),  # by a trifle
        (-0.2, 0.0, 0.0, False),
        (0.0, -0.2, 0.0, False),
    ],
)
def test_the_simpler_law_does_as_well(fitted: float, held: float, certainty: float, good: bool) -> None:
    trial = LawTrial("dahl", NOTHING, Evidence(fitted, 0.0, 0.0, 0.0, 0.0), Evidence(held, certainty, 0.0, 0.0, 0.0))
    assert as_good(trial) is good


def test_what_is_not_told_is_said_with_the_recording_that_would_tell() -> None:
    choice = LawChoice("lugre", False, ("dahl", "coulomb"), (), NOTHING, "lugre")
    assert untold(choice).endswith(PRESLIDING) and "LuGre or Dahl, Coulomb-Stribeck" in untold(choice)
    assert not sentence(choice, 0.0)
    told = LawChoice("maxwell_slip", False, ("elasto_plastic",), (), NOTHING, "maxwell_slip")
    assert not untold(told)
    assert "closes 93 % of the gap (elasto-plastic would do as well)" in sentence(told, 0.93)


def test_a_known_friction_parameter_settles_the_law() -> None:
    base, choice = base_with_law(NOTHING, {"coulomb_force": 1.0})
    assert base is NOTHING and choice is None and law_finding(NOTHING, choice) is None


def test_a_model_file_keeps_its_law(tmp_path: Path) -> None:
    from linid import api
    from linid.identification.model_file import load_model

    wheels = Campaign.of([one for one in recorded("maxwell") if one.kind == "free_wheel"][:3])
    small = {"population": 10, "generations": 2, "least_squares_steps": 2}
    found = api.fit(wheels, model="friction", law="maxwell_slip", **small)
    found.save(tmp_path / "model.json")
    again = load_model(tmp_path / "model.json")
    assert again.law == found.result.law == "maxwell_slip"
    assert {e.name: e.value for e in again.estimates} == {e.name: e.value for e in found.result.estimates}
    assert {"slip_stiffness_ratio", "slip_force_tilt"} <= {e.name for e in again.estimates}


def test_the_shape_of_maxwells_elements_is_found_where_lugres_stribeck_curve_goes_astray(tmp_path: Path) -> None:
    """LuGre's one bristle ends without a breakaway force on this axis: from there the elements end 40 floors away."""
    hidden, base = hidden_axis(2207, "maxwell", 71, tmp_path)
    assert base.fitted.values["static_force"] < 1.05 * base.fitted.values["coulomb_force"]
    found = under_law(base.judge.fits, base.fitted, "maxwell_slip")
    assert base.judge.excess(found.residual) < 1.0
    stiffnesses, friction = hidden.description.stiffnesses, hidden.description.friction
    assert found.values["slip_stiffness_ratio"] == pytest.approx(stiffnesses[1] / stiffnesses[0], rel=0.05)
    breakaway = found.values["static_force"] / found.values["coulomb_force"]
    assert breakaway == pytest.approx(friction.static_force_n / friction.coulomb_force_n, rel=0.05)


def test_an_elasto_plastic_breakaway_is_found_where_lugres_ends_at_the_bound(tmp_path: Path) -> None:
    """LuGre's bristle, which drifts, needs eight times the Coulomb force: from there the fit ends 15 floors away."""
    hidden, base = hidden_axis(4409, "elasto_plastic", 18, tmp_path)
    assert base.fitted.values["static_force"] > 5.0 * base.fitted.values["coulomb_force"]
    found = under_law(base.judge.fits, base.fitted, "elasto_plastic")
    assert base.judge.excess(found.residual) < 0.2
    friction = hidden.description.friction
    breakaway = found.values["static_force"] / found.values["coulomb_force"]
    assert breakaway == pytest.approx(friction.static_force_n / friction.coulomb_force_n, rel=0.05)
    assert found.values["bristle_stiffness"] == pytest.approx(friction.bristle_stiffness_n_per_m, rel=0.05)


@pytest.mark.parametrize(
    ("law", "index", "promises"), [("maxwell", 71, True), ("elasto_plastic", 18, True), ("lugre", 0, False)]
)
def test_a_race_promises_another_law_where_there_is_one(law: str, index: int, promises: bool, tmp_path: Path) -> None:
    seed = {"maxwell": 2207, "elasto_plastic": 4409, "lugre": 31}[law]
    _, base = hidden_axis(seed, law, index, tmp_path)
    found = promised(base.judge, base.fitted)
    assert (found >= PROMISING * LEAST_CLOSED) is promises, found
