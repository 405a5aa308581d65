"""Axes that are recorded twice: what changes, what their keys say, and how answers are scored."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml

from linid.challenge.answers import Answer, BudgetEntry
from linid.challenge.changed import FACTORS, SCENARIOS, TURN, changed, make_changed
from linid.challenge.create import make_challenge
from linid.challenge.files import Key, read_keys
from linid.challenge.make import Plan, assignment
from linid.challenge.score import score
from linid.challenge.strength import run_all
from linid.physics.effects.registry import EFFECTS
from linid.stand.description import AxisDescription
from linid.workflow.commands import diagnose
from linid.workflow.commands.challenge import diagnose_with_linid
from tests.challenge.test_score import KEYS
from tests.workflow.small import linid, summary

PLAN = Plan(71, kinds=("changed",), axes=("q_linear",))


@pytest.fixture(scope="module")
def proof(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Key]]:
    folder = tmp_path_factory.mktemp("changed") / "proof"
    return folder, make_challenge(PLAN, 2, folder)


def test_what_may_change_has_the_names_of_a_diagnosis() -> None:
    assert {*FACTORS, TURN} == {effect.name for effect in EFFECTS if effect.changes}


def test_an_axis_is_recorded_twice_and_the_key_says_what_has_changed(proof: tuple[Path, dict[str, Key]]) -> None:
    folder, keys = proof
    assert read_keys(folder / "keys.yaml") == keys
    for index, (name, key) in enumerate(keys.items()):
        made = make_changed(PLAN, index)
        assert (key.kind == "unchanged") == (not key.effects) and key.gap is None and key.shares == {}
        assert {
            one: key.parameters[one]["turn_rad" if one == TURN else "factor"] for one in made.factors
        } == made.factors
        later, before = (
            yaml.safe_load((folder / place / name / "campaign.yaml").read_text()) for place in ("", "commissioned")
        )
        assert [one["file"] for one in later["recordings"]] == [one["file"] for one in before["recordings"]]
        first = later["recordings"][0]["file"]
        assert (folder / name / first).read_bytes() != (folder / "commissioned" / name / first).read_bytes()


def test_only_the_keys_tell_what_has_changed(proof: tuple[Path, dict[str, Key]]) -> None:
    folder, keys = proof
    words = [cause for key in keys.values() for cause in key.effects] + ["factor", "changed"]
    for path in folder.rglob("*.yaml"):
        assert path.name == "keys.yaml" or not any(word in path.read_text(encoding="utf-8") for word in words)


def test_of_ten_axes_each_scenario_has_its_share() -> None:
    """Drawn without recording anything: the kinds of the plan, and the block of scenarios."""
    plan = Plan(3, kinds=("single", "changed"))
    assert Counter(assignment(plan, index)[0] for index in range(80)) == {"single": 60, "changed": 20}
    assert all(assignment(plan, index)[1] == () for index in range(80) if assignment(plan, index)[0] == "changed")
    assert Counter(SCENARIOS)["nothing"] >= 2


def test_a_factor_changes_its_parameter_alone(calm: AxisDescription) -> None:
    heavier = changed(calm, {"payload_change": 1.5})
    assert heavier.mass_kg == 1.5 * calm.mass_kg and heavier.friction == calm.friction and heavier.motor == calm.motor
    stickier = changed(calm, {"friction_level_change": 2.0}).friction
    assert stickier.coulomb_force_n == 2.0 * calm.friction.coulomb_force_n
    assert stickier.static_force_n == 2.0 * calm.friction.static_force_n
    assert stickier.viscous_friction_n_s_per_m == calm.friction.viscous_friction_n_s_per_m
    stuck = changed(calm, {"breakaway_change": 2.0}).friction
    assert stuck == calm.friction.model_copy(update={"static_force_n": 2.0 * calm.friction.static_force_n})
    weak = changed(calm, {"force_constant_change": 0.5})
    one, other = run_all(calm, [], only=[2])[0], run_all(weak, [], only=[2])[0]
    assert other.thrust[0] == pytest.approx(0.5 * one.thrust[0], rel=1e-6)


def test_a_turned_field_takes_the_currents_with_it(calm: AxisDescription) -> None:
    """As where an encoder was remounted and the drive commutates anew: the thrust is the same, the currents are not."""
    (loop,) = (k for k, mode in enumerate(calm.campaign) if mode.name == "sine_position_2")
    one, other = (run_all(axis, [], only=[loop])[0] for axis in (calm, changed(calm, {TURN: 0.5})))
    assert other.y == pytest.approx(one.y, abs=1e-4)
    flowing = np.max(np.abs(one.currents), axis=0) > 0.1 * np.max(np.abs(one.currents))
    vectors = [np.exp(2j * np.pi * np.arange(3) / 3) @ run.currents[:, flowing] for run in (one, other)]
    assert np.median(np.abs(np.angle(vectors[1] / vectors[0]))) == pytest.approx(0.5, abs=0.02)


def test_the_diagnosis_is_given_the_commissioned_model(
    proof: tuple[Path, dict[str, Key]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Path | None] = []

    def note(path: Path, out: Path, jobs: int, without: object = (), since: Path | None = None) -> None:
        given.append(since)
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnose, "diagnose_campaign", note)
    with pytest.raises(KeyboardInterrupt):
        diagnose_with_linid(proof[0] / "axis_0001" / "campaign.yaml", tmp_path, 1)
    assert given == [proof[0] / "commissioned" / "axis_0001" / "campaign.yaml"]


def answer(*names: str, status: str = "explained") -> Answer:
    return Answer(status, tuple(BudgetEntry(name) for name in names))


def test_scores_of_axes_that_are_recorded_twice() -> None:
    def key(*causes: str) -> Key:
        parameters = {cause: {"factor": 1.2} for cause in causes}
        return Key("changed" if causes else "unchanged", causes, {}, parameters, "sine", {}, gap=None)

    keys = {
        "first": key("payload_change", "cogging"),
        "second": key("friction_level_change"),
        "missed": key("force_constant_change"),
        "quiet": key(),
        "alarmed": key(),
        "puzzled": key(),
    }
    answers = {
        "first": answer("cogging", "payload_change"),
        "second": answer("end_effect", "friction_level_change"),
        "missed": answer(status="none"),
        "quiet": answer(status="none"),
        "alarmed": answer("backlash"),
        "puzzled": answer(status="unknown"),
    }
    told = score(keys, answers)
    found = {name: (one.count, one.total) for name, one in told.rates.items() if "changed" in name}
    assert found == {
        "changed_first": (1, 3),
        "changed_found": (3, 4),
        "changed_wrong": (2, 5),
        "unchanged_alarms": (2, 3),
    }
    rows, columns, counts = told.confusion
    assert rows == ("force_constant_change", "friction_level_change", "unchanged")
    assert counts[1][columns.index("friction_level_change")] == 0.5
    assert score(KEYS, dict.fromkeys(KEYS, answer())).rates["changed_first"].total == 0


def test_the_commands_make_and_score_them(tmp_path: Path) -> None:
    body = summary(
        "challenge",
        "make",
        "--count",
        1,
        "--seed",
        71,
        "--kinds",
        "changed",
        "--axes",
        "q_linear",
        "--out",
        tmp_path / "p",
    )
    assert body["campaigns"] == ["axis_0001"]
    (cause,) = read_keys(tmp_path / "p" / "keys.yaml").values()
    out = tmp_path / "p" / "results" / "axis_0001"
    out.mkdir(parents=True)
    entries = [{"effect": name, "share": 0.5} for name in cause.effects]
    told = {"verdict": {"status": "explained" if entries else "none"}, "budget": {"entries": entries}}
    (out / "diagnosis.json").write_text(json.dumps(told), encoding="utf-8")
    assert linid("challenge", "oracle", tmp_path / "p").exit_code == 0
    assert not (out / "oracle.json").exists()  # the base is given: there is no other to close the gap
    rates = summary("challenge", "score", tmp_path / "p", "--no-figures")["rates"]
    assert rates["changed_first"]["count"] == rates["changed_first"]["total"] == bool(entries)
