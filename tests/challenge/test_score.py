"""Scoring hand-made results whose figures are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from linid.challenge.files import Key, write_keys
from linid.challenge.score import Answer, rate, read_answer, score
from linid.errors import DataError
from linid.physics.effects.registry import EFFECTS
from tests.workflow.small import linid, summary


def key(kind: str, *effects: str, strength: float = 0.3) -> Key:
    return Key(kind, effects, dict.fromkeys(effects, strength), {e: {"amplitude": 1.0} for e in effects}, "sine", {})


KEYS = {
    "axis_0001": key("single", "cogging", strength=0.07),  # named
    "axis_0002": key("single", "cable_force", strength=0.07),  # ambiguous group of two that holds it: half
    "axis_0003": key("single", "end_effect", strength=0.3),  # wrong name, right one third
    "axis_0004": key("single", "input_delay", strength=0.3),  # ambiguous group of three: nothing
    "axis_0005": key("single", "friction_drift", strength=1.01),  # said none
    "axis_0006": key("none"),  # right
    "axis_0007": key("none"),  # named: false alarm and wrong
    "axis_0008": key("none"),  # unknown: a false alarm, but no wrong name
    "axis_0009": key("unknown", "floor_vibration"),  # right
    "axis_0010": key("unknown", "clock_beat"),  # named: wrong
    "axis_0011": key("pair", "cogging", "quadratic_drag"),  # both
    "axis_0012": key("pair", "cogging", "payload_change"),  # one
    "axis_0013": key("pair", "cogging", "force_ripple"),  # one right, one wrong
    "axis_0014": key("single", "force_ripple", strength=0.3),  # failed: no file
}


def said(status: str, effects: tuple[str, ...] = (), equivalent: tuple[str, ...] = (), **more: Any) -> dict[str, Any]:
    ranking = more.pop("ranking", [{"effect": e, "closure": more.get("first", 0.9)} for e in effects])
    verdict = {"status": status, "effects": list(effects), "equivalent": list(equivalent)}
    excess = {"before": more.get("excess", 0.0), "floor": 0.5}
    return {
        "schema": 1, "verdict": verdict, "ranking": ranking, "where": [], "next_experiment": None, "excess": excess
    }  # fmt: skip


ANSWERS = {
    "axis_0001": said("identified", ("cogging",)),
    "axis_0002": said("ambiguous", ("constant_force",), ("cable_force",), first=0.5),
    "axis_0003": said("identified", ("cogging",), ranking=[
        {"effect": "cogging", "closure": 0.4}, {"effect": "quadratic_drag", "closure": 0.3},
        {"effect": "end_effect", "closure": 0.2}, {"effect": "input_delay", "closure": 0.1}]),
    "axis_0004": said("ambiguous", ("a", "input_delay"), ("b",), ranking=[]),
    "axis_0005": said("none"),
    "axis_0006": said("none"),
    "axis_0007": said("identified", ("cogging",)),
    "axis_0008": said("unknown"),
    "axis_0009": said("unknown", excess=0.2),  # 0.4 floors
    "axis_0010": said("identified", ("encoder_periodic_error",), excess=0.1),  # too little to matter
    "axis_0011": said("identified", ("quadratic_drag", "cogging")),
    "axis_0012": said("identified", ("cogging",)),
    "axis_0013": said("identified", ("cogging", "end_effect")),
}  # fmt: skip


@pytest.fixture
def proof(tmp_path: Path) -> Path:
    write_keys(KEYS, tmp_path / "keys.yaml", seed=1)
    for name in KEYS:
        folder = tmp_path / "results" / name
        folder.mkdir(parents=True)
        if name in ANSWERS:
            (folder / "diagnosis.json").write_text(json.dumps(ANSWERS[name]), encoding="utf-8")
    (tmp_path / "results/axis_0001/oracle.json").write_text(
        json.dumps({"effects": ["cogging"], "closure": 0.96}), encoding="utf-8"
    )
    (tmp_path / "results/axis_0003/oracle.json").write_text(
        json.dumps({"effects": ["end_effect"], "closure": 0.8}), encoding="utf-8"
    )
    for name, least in (("axis_0011", 0.6), ("axis_0012", 0.1)):  # of the second, the payload cannot be seen
        each = {KEYS[name].effects[0]: 0.9, KEYS[name].effects[1]: least}
        (tmp_path / "results" / name / "oracle.json").write_text(
            json.dumps({"effects": list(each), "closure": None, "each": each}), encoding="utf-8"
        )
    gaps = [{"recording": "r", "measure": "force", "value": v, "low": 1.0, "high": 2.0} for v in (0.5, 1.0, 1.5)]
    (tmp_path / "results/axis_0001/fresh.json").write_text(json.dumps({"gaps": gaps}), encoding="utf-8")
    return tmp_path


def test_the_figures_of_hand_made_results(proof: Path) -> None:
    body = summary("challenge", "score", proof)
    rates = {name: (r["count"], r["total"]) for name, r in body["rates"].items()}
    assert rates == {
        "top_1": (1.5, 6),
        "top_3": (2.5, 6),
        "top_1_visible": (1, 2),
        "top_3_visible": (2, 2),
        "top_1_faint": (0, 0),
        "named_but_wrong": (4, 14),
        "false_alarms": (2, 3),
        "false_names": (1, 3),
        "unknown_recall_visible": (1, 1),
        "unknown_recall": (1, 2),
        "pairs_both_named": (1, 3),
        "pairs_both_visible": (1, 1),
        "pairs_one_named": (1, 3),
        "interval_coverage": (2, 3),
        "failed": (1, 14),
    }
    # Closures of what hides something: 0.9, 0.5, 0.4, then 0.9 four times.
    assert body["closure"] == pytest.approx(0.9)
    assert body["relative_closure"] == pytest.approx((0.9 / 0.96 + 0.4 / 0.8) / 2)
    totals = [(b["low"], b["top_1"]["count"], b["top_1"]["total"], b["wrong"]["count"]) for b in body["strength_bins"]]
    assert totals == [(0.05, 1.5, 2, 0), (0.1, 0, 0, 0), (0.2, 0, 3, 1), (0.5, 0, 1, 0)]


def test_the_confusion_matrix(proof: Path) -> None:
    matrix = summary("challenge", "score", proof)["confusion"]
    cell = {
        (row, column): matrix["counts"][i][j]
        for i, row in enumerate(matrix["rows"])
        for j, column in enumerate(matrix["columns"])
    }
    assert cell["cogging", "cogging"] == 1 and cell["end_effect", "cogging"] == 1
    assert cell["cable_force", "ambiguous"] == 1 and cell["friction_drift", "none"] == 1
    assert cell["none", "none"] == 1 and cell["none", "cogging"] == 1 and cell["none", "unknown"] == 1
    assert cell["unknown", "unknown"] == 1 and cell["unknown", "encoder_periodic_error"] == 1
    assert cell["force_ripple", "failed"] == 1
    assert sum(cell.values()) == 11  # all but the pairs


def test_files_and_tables(proof: Path) -> None:
    result = linid("challenge", "score", proof)
    assert result.exit_code == 0
    assert "1.5 of 6" in result.output and "25 % (" in result.output
    folder = proof / "score"
    assert json.loads((folder / "score.json").read_text(encoding="utf-8"))["rates"]["top_1"]["value"] == 0.25
    rows = (folder / "campaigns.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 15 and rows[2].startswith("axis_0002,single,cable_force,0.07,ambiguous,")
    assert {p.name for p in folder.iterdir()} == {
        "score.json", "campaigns.csv", "strength.csv", "rates.png", "rates.pdf", "confusion.png", "confusion.pdf",
    }  # fmt: skip


def test_scoring_twice_gives_the_same_bytes(proof: Path) -> None:
    linid("challenge", "score", proof)
    before = {p.name: p.read_bytes() for p in (proof / "score").iterdir()}
    linid("challenge", "score", proof)
    assert {p.name: p.read_bytes() for p in (proof / "score").iterdir()} == before


def test_keys_elsewhere_and_missing(proof: Path) -> None:
    (proof / "keys.yaml").rename(proof.parent / "sealed.yaml")
    assert linid("challenge", "score", proof, "--no-figures").exit_code == 4
    assert linid("challenge", "score", proof, "--no-figures", "--keys", proof.parent / "sealed.yaml").exit_code == 0


@pytest.mark.parametrize("body", ["nonsense", "[]", "{}", '{"verdict": {"status": "perhaps"}}'])
def test_a_result_that_is_none_is_refused(tmp_path: Path, body: str) -> None:
    (tmp_path / "diagnosis.json").write_text(body, encoding="utf-8")
    with pytest.raises(DataError):
        read_answer(tmp_path)


@given(n=st.integers(1, 200), data=st.data())
def test_wilson_interval_is_scipys(n: int, data: st.DataObject) -> None:
    k = data.draw(st.integers(0, n))
    ours = rate([1.0] * k + [0.0] * (n - k))
    theirs = binomtest(k, n).proportion_ci(method="wilson")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)


def test_without_campaigns_of_a_kind_there_is_no_rate() -> None:
    nothing = score({}, {})
    assert nothing.rates["top_1"].total == 0 and nothing.rates["top_1"].value != nothing.rates["top_1"].value


def test_shuffled_labels_score_nothing(tmp_path: Path) -> None:
    """A negative control: perfect answers, each for another campaign than its own."""
    names = [effect.name for effect in EFFECTS]
    keys = {f"axis_{k:04d}": Key("single", (name,), {name: 0.5}, {}, "sine", {}) for k, name in enumerate(names)}
    answers = {f"axis_{k:04d}": Answer("identified", (name,), (), (name,)) for k, name in enumerate(names)}
    own = score(keys, answers)
    assert own.rates["top_1"].value == 1.0 and own.rates["named_but_wrong"].value == 0.0
    turned = dict(zip(answers, [*list(answers.values())[1:], next(iter(answers.values()))], strict=True))
    other = score(keys, turned)
    assert other.rates["top_1"].value == 0.0 and other.rates["named_but_wrong"].value == 1.0
