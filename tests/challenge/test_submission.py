"""Submissions: what they must look like, and scores that are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from linid.challenge.catalogue import LISTED
from linid.challenge.entry_score import EntryScore, score_entry
from linid.challenge.files import Key
from linid.challenge.outside import DEPENDS_ON, OUTSIDE
from linid.challenge.submission import (
    CampaignAnswer,
    check_campaigns,
    parse_submission,
    read_submission,
    submission_schema,
    submission_text,
)
from linid.challenge.suite import GROUPS, SuiteKeys, read_suite_keys, write_suite_keys
from linid.errors import ConfigError
from tests.challenge.test_score import key
from tests.workflow.small import linid, summary

CROWD = {"cogging": 0.6, "end_effect": 0.3, "friction_drift": 0.06, "payload_change": 0.02}
KEYS = {
    "axis_0001": key("single", "cogging", shares={"cogging": 0.9}, unexplained=0.1, gap=3.0),
    "axis_0002": key("pair", "cogging", "gravity", shares={"cogging": 0.5, "gravity": 0.5}, gap=3.0),
    "axis_0003": key("crowd", *CROWD, shares=CROWD, unexplained=0.02, gap=3.0),
    "axis_0004": key("unknown", "clock_beat", shares={"clock_beat": 1.0}, unexplained=1.0, gap=2.0),
    "axis_0005": key("single", "backlash", shares={"backlash": 0.7}, unexplained=0.3, gap=2.0, law="dahl"),
    "axis_0006": key("single", "cable_force", shares={"cable_force": 0.8}, gap=2.0, encoder=5e-6),
    "axis_0007": key("none"),
}
SEALED = SuiteKeys("1-test", dict(zip(KEYS, GROUPS, strict=True)), KEYS)


def perfect(truth: Key) -> CampaignAnswer:
    named = [name for name in truth.effects if name in LISTED]
    outside = [name for name in truth.effects if name in OUTSIDE]
    return CampaignAnswer.model_validate(
        {
            "effects": tuple(named),
            "shares": {
                n: {"share": s, "low": s - 0.01, "high": s + 0.01} for n, s in truth.shares.items() if n in named
            },
            "unknown": bool(outside),
            "arguments": tuple(name for effect in outside for name in DEPENDS_ON[effect]),
            "law": truth.law,
        }
    )


def scored(answers: dict[str, CampaignAnswer]) -> EntryScore:
    return score_entry(SEALED.keys, SEALED.groups, answers)


def values(score: EntryScore, group: str) -> dict[str, float]:
    return {name: rate.value for name, rate in score.groups[group].rates.items() if rate.total}


GOOD = {"answered", "points", "named", "told", "covered", "arguments", "arguments_exact", "arguments_main", "law"}
BAD = {"wrong", "false_alarms", "astray", "arguments_wrong"}


def test_perfect_answers_score_perfectly() -> None:
    score = scored({name: perfect(truth) for name, truth in KEYS.items()})
    assert list(score.groups) == ["all", *GROUPS]
    everywhere = values(score, "all")
    assert set(everywhere) == GOOD | BAD
    assert all(value == (name in GOOD) for group in score.groups for name, value in values(score, group).items())
    assert score.groups["all"].width == pytest.approx(0.02)


def test_no_answers_score_nothing() -> None:
    score = scored({})
    for group in score.groups:
        assert set(values(score, group).values()) == {0.0}
    assert all(line.points == 0 and line.said is None for line in score.lines)


def test_silence_is_right_where_nothing_is_hidden_and_nowhere_else() -> None:
    score = scored({name: CampaignAnswer() for name in KEYS})
    assert {line.group: line.points for line in score.lines if line.points} == {"none": 1.0}
    assert values(score, "all")["named"] == 0 and values(score, "none")["false_alarms"] == 0


def test_wrong_answers_are_counted() -> None:
    answers = {name: perfect(truth) for name, truth in KEYS.items()}
    answers["axis_0001"] = CampaignAnswer(effects=("cogging", "gravity"), unknown=True)  # two wrong words
    answers["axis_0002"] = CampaignAnswer(effects=("backlash",))
    answers["axis_0003"] = CampaignAnswer(effects=("cogging", "payload_change"))  # one of three that matter
    answers["axis_0004"] = CampaignAnswer(effects=("cogging",), unknown=True, arguments=("time", "position"))
    answers["axis_0005"] = CampaignAnswer(effects=("backlash",), unknown=True, law="maxwell")
    answers["axis_0007"] = CampaignAnswer(unknown=True)
    score = scored(answers)
    points = {line.campaign: line.points for line in score.lines}
    assert points == pytest.approx(dict(zip(KEYS, (1 / 3, 0, 1 / 3, 1 / 2, 1, 1, 1 / 2), strict=True)))
    every = score.groups["all"].rates
    assert (every["named"].count, every["named"].total) == (1 + 0 + 1 + 1 + 1, 1 + 2 + 3 + 1 + 1)
    assert (every["wrong"].count, every["wrong"].total) == (3, 8)
    assert every["false_alarms"].value == 1 and every["astray"].count == 2
    assert every["law"].count == every["law"].total - 1
    assert every["arguments"].value == every["arguments_wrong"].value == 1 / 2
    assert [line["campaign"] for line in entry_lines(score) if line["wrong"]] == [
        "axis_0001",
        "axis_0002",
        "axis_0004",
        "axis_0007",
    ]


def entry_lines(score: EntryScore) -> list[dict[str, Any]]:
    from linid.report.entry import entry_body

    lines: list[dict[str, Any]] = entry_body(score)["campaigns"]
    return lines


@hypothesis_settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_naming_what_is_not_there_never_raises_a_score(data: st.DataObject) -> None:
    names = st.lists(st.sampled_from(list(LISTED)), unique=True, max_size=6)
    answers = {
        name: CampaignAnswer(effects=tuple(data.draw(names)), unknown=data.draw(st.booleans()))
        for name in data.draw(st.lists(st.sampled_from(list(KEYS)), unique=True, min_size=1))
    }
    name = data.draw(st.sampled_from(list(answers)))
    before = answers[name]
    absent = data.draw(st.sampled_from([e for e in LISTED if e not in (*before.effects, *KEYS[name].effects)]))
    worse = {**answers, name: before.model_copy(update={"effects": (*before.effects, absent)})}
    one, other = scored(answers), scored(worse)
    for group in one.groups:
        was, now = one.groups[group].rates, other.groups[group].rates
        for good in GOOD & set(values(one, group)):
            assert now[good].value <= was[good].value + 1e-12, (group, good)
        for bad in BAD & set(values(one, group)):
            assert now[bad].value >= was[bad].value - 1e-12, (group, bad)
    assert other.groups["all"].rates["wrong"].count == one.groups["all"].rates["wrong"].count + 1


def body(**answer: Any) -> dict[str, Any]:
    return {"suite": "1-test", "entrant": "me", "answers": {"axis_0001": answer}}


@pytest.mark.parametrize(
    ("data", "place", "said"),
    [
        (body(effects=["coging"]), "answers.axis_0001.effects[1]", "Did you mean 'cogging'?"),
        (body(effects=["cogging", "floor_vibration"]), "effects[2]", "is no effect of the list"),
        (body(effects=["cogging", "cogging"]), "answers.axis_0001.effects", "more than once"),
        (body(effects="cogging"), "answers.axis_0001.effects", "Correct the value"),
        (body(effect=["cogging"]), "answers.axis_0001.effect", "does not belong here"),
        (body(effects=["cogging"], shares={"gravity": {"share": 1}}), "axis_0001", "effects does not name"),
        (body(effects=["cogging"], shares={"cogging": {"share": 1, "low": 2, "high": 1}}), "cogging", "above high"),
        (body(effects=["cogging"], shares={"cogging": {"share": 1, "low": 2}}), "cogging", "one end"),
        (body(effects=["cogging"], shares={"coging": {"share": 1}}), "shares.coging", "Did you mean 'cogging'?"),
        (body(arguments=["time"]), "axis_0001", "unknown is false"),
        (body(unknown=True, arguments=["speed"]), "arguments[1]", "Known: position"),
        (body(law="dahls"), "axis_0001.law", "Did you mean 'dahl'?"),
        ({"suite": "1-test", "answers": {}}, "entrant", "is missing"),
        ({"suite": "1-test", "entrant": "", "answers": []}, "entrant", "1 more fault"),
        ([], "here.json", "not an object"),
    ],
)
def test_bad_submissions_are_told_where_what_and_what_to_do(data: Any, place: str, said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_submission(data, "here.json")
    assert place in caught.value.place and caught.value.remedy.endswith((".", "?"))
    assert said in str(caught.value)


def test_answers_to_other_suites_and_campaigns_are_told() -> None:
    entry = parse_submission({"suite": "1-test", "entrant": "me", "answers": {"axis_001": {}}}, "here.json")
    with pytest.raises(ConfigError, match=r"no campaign axis_001\. Did you mean 'axis_0001'"):
        check_campaigns(entry, "1-test", tuple(KEYS), "here.json")
    with pytest.raises(ConfigError, match="answers the suite '1-test', these keys are of '1-else'"):
        check_campaigns(entry, "1-else", tuple(KEYS), "here.json")
    fine = parse_submission(body(effects=["cogging"]), "here.json")
    assert check_campaigns(fine, "1-test", tuple(KEYS), "here.json") == tuple(KEYS)[1:]


def test_submissions_and_keys_come_back_from_their_files(tmp_path: Path) -> None:
    answers = {name: perfect(truth) for name, truth in KEYS.items()}
    path = tmp_path / "entry.json"
    path.write_text(submission_text("1-test", "me", answers), encoding="utf-8")
    assert read_submission(path).answers == answers
    keys = tmp_path / "keys.yaml"
    write_suite_keys(SEALED, keys, seed=1)
    assert read_suite_keys(keys) == SEALED
    found = summary("challenge", "score", path, "--keys", keys)
    assert found["groups"]["all"]["rates"]["points"]["value"] == 1 and found["missing"] == []
    shown = linid("challenge", "score", path, "--keys", keys)
    assert shown.exit_code == 0 and "100 (" in shown.stdout and "Unlisted causes" in shown.stdout


def test_commands_tell_what_is_wrong_with_a_submission(tmp_path: Path) -> None:
    keys, path = tmp_path / "keys.yaml", tmp_path / "entry.json"
    write_suite_keys(SEALED, keys, seed=1)
    for text in ("{", json.dumps(body(effects=["coging"])), json.dumps({**body(), "suite": "2"})):
        path.write_text(text, encoding="utf-8")
        result = linid("challenge", "score", path, "--keys", keys)
        assert result.exit_code == 3 and "entry.json" in result.stderr
    keys.write_text("campaigns: {}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="not those of a suite"):
        read_suite_keys(keys)


def test_the_schema_says_what_the_program_takes() -> None:
    schema = submission_schema("1-test", list(KEYS))
    assert schema["properties"]["suite"]["const"] == "1-test"
    assert schema["properties"]["answers"]["propertyNames"]["enum"] == list(KEYS)
    assert schema["$defs"]["CampaignAnswer"]["properties"]["effects"]["items"]["enum"] == list(LISTED)
    jsonschema = pytest.importorskip("jsonschema")
    good = json.loads(submission_text("1-test", "me", {name: perfect(truth) for name, truth in KEYS.items()}))
    jsonschema.validate(good, schema)
    for wrong in (body(effects=["coging"]), body(effect=[]), {**body(), "suite": "2"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)
