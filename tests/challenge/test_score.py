"""Scoring hand-made results whose figures are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from linid.challenge.answers import Answer, BudgetEntry, Proposal, Stated, read_answer
from linid.challenge.budget import ledger, score_budgets
from linid.challenge.files import Key, write_keys
from linid.challenge.proposals import closed_of, grade, score_proposals
from linid.challenge.rates import rate
from linid.challenge.score import score
from linid.errors import DataError
from linid.physics.effects.registry import EFFECTS
from tests.workflow.small import linid, summary


def key(kind: str, *effects: str, strength: float = 0.3, **more: Any) -> Key:
    numbers = {e: {"amplitude": 1.0} for e in effects}
    return Key(kind, effects, dict.fromkeys(effects, strength), numbers, "sine", {}, **more)


CROWD = {"cogging": 0.6, "end_effect": 0.3, "friction_drift": 0.06, "payload_change": 0.02, "backlash": -0.02}
KEYS = {
    "axis_0001": key("single", "cogging", strength=0.07),  # named
    "axis_0002": key("single", "cable_force", strength=0.07),  # the only rival of the first entry: half
    "axis_0003": key("single", "end_effect", strength=0.3),  # wrong name first, right one third
    "axis_0004": key("single", "input_delay", strength=0.3),  # one of two rivals: nothing
    "axis_0005": key("single", "friction_drift", strength=1.01),  # said none
    "axis_0006": key("none"),  # right
    "axis_0007": key("none"),  # named: false alarm and wrong
    "axis_0008": key("none"),  # unknown: a false alarm, but no wrong name
    "axis_0009": key("unknown", "floor_vibration", shares={"floor_vibration": 1.0}, unexplained=1.0, gap=2.0),  # right
    "axis_0010": key("unknown", "clock_beat", shares={"clock_beat": 1.0}, unexplained=1.0, gap=2.0),  # named: wrong
    "axis_0011": key("pair", "cogging", "quadratic_drag"),  # both
    "axis_0012": key("pair", "cogging", "payload_change"),  # one
    "axis_0013": key("pair", "cogging", "force_ripple"),  # one right, one wrong
    "axis_0014": key("single", "force_ripple", strength=0.3),  # failed: no file
    # Two of three large ones found, one of them as a rival; a small one found too; one name absent.
    "axis_0015": key("crowd", *CROWD, shares=CROWD, unexplained=0.04, gap=0.5),
}


def said(
    status: str,
    *entries: dict[str, Any],
    gap: float = 1.0,
    left: tuple[float, float, float] | None = None,
    closed: float | None = 0.9,
    equivalent: tuple[str, ...] = (),
) -> dict[str, Any]:
    verdict = {"status": status, "effects": [e["effect"] for e in entries], "equivalent": list(equivalent)}
    unexplained = None if left is None else dict(zip(("share", "low", "high"), left, strict=True))
    return {
        "schema": 2,
        "verdict": verdict,
        "budget": {"gap": gap, "closed": closed, "unexplained": unexplained, "entries": list(entries)},
    }


def entry(
    effect: str, share: float, low: float = 0.0, high: float = 1.0, rivals: tuple[str, ...] = ()
) -> dict[str, Any]:
    return {
        "effect": effect,
        "rivals": list(rivals),
        "share": share,
        "low": low,
        "high": high,
        "last_in": share,
        "first_in": share,
    }


ANSWERS = {
    "axis_0001": said("explained", entry("cogging", 0.95)),
    "axis_0002": said("explained", entry("constant_force", 0.9, rivals=("cable_force",)), closed=0.5),
    "axis_0003": said(
        "explained", entry("end_effect", 0.1), entry("cogging", 0.6), entry("quadratic_drag", 0.3), closed=0.4
    ),
    "axis_0004": said("partly explained", entry("a", 0.5, rivals=("input_delay", "b")), closed=None),
    "axis_0005": said("none", closed=None),
    "axis_0006": said("none", closed=None),
    "axis_0007": said("explained", entry("cogging", 0.4)),
    "axis_0008": said("unknown"),
    "axis_0009": said("unknown", gap=0.4, left=(0.97, 0.9, 1.0)),
    "axis_0010": said("explained", entry("encoder_periodic_error", 0.9), gap=0.2),  # too little to matter
    "axis_0011": said("explained", entry("quadratic_drag", 0.6), entry("cogging", 0.4)),
    "axis_0012": said("partly explained", entry("cogging", 0.7)),
    "axis_0013": said("explained", entry("cogging", 0.7), entry("end_effect", 0.3)),
    "axis_0015": said(
        "partly explained",
        entry("cogging", 0.55, 0.5, 0.62),
        entry("end_effect_rival", 0.2, 0.1, 0.25, ("end_effect",)),
        entry("payload_change", 0.03, 0.0, 0.05),
        entry("thermal_derating", 0.1, 0.05, 0.2, ("cogging",)),
        left=(0.12, 0.03, 0.2),
    ),
}


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
        "named_but_wrong": (5, 15),  # 3, 7, 10, 13, 15
        "false_alarms": (2, 3),
        "false_names": (1, 3),
        "unknown_recall_visible": (1, 1),
        "unknown_recall": (1, 2),
        "pairs_both_named": (1, 3),
        "pairs_both_visible": (1, 1),
        "pairs_one_named": (1, 3),
        "changed_first": (0, 0),
        "changed_found": (0, 0),
        "changed_wrong": (0, 0),
        "unchanged_alarms": (0, 0),
        "interval_coverage": (2, 3),
        "failed": (1, 15),
    }
    # Closures of what hides something: 0.5, 0.4, and 0.9 of all others that state one.
    assert body["closure"] == pytest.approx(0.9)
    assert body["relative_closure"] == pytest.approx((0.9 / 0.96 + 0.4 / 0.8) / 2)
    totals = [(b["low"], b["top_1"]["count"], b["top_1"]["total"], b["wrong"]["count"]) for b in body["strength_bins"]]
    assert totals == [(0.05, 1.5, 2, 0), (0.1, 0, 0, 0), (0.2, 0, 3, 1), (0.5, 0, 1, 0)]


def test_the_figures_of_a_hand_made_budget(proof: Path) -> None:
    body = summary("challenge", "score", proof)
    crowd = body["budgets"]["crowd"]
    assert {name: (r["count"], r["total"]) for name, r in crowd["rates"].items()} == {
        "found": (2, 3),  # cogging and, as a rival, the end effect; the drift of 6 % is missed
        "found_visible": (2, 2),  # 6 % of half a floor is less than noise does
        "found_as_rival": (1, 2),
        "absent": (1, 4),  # cogging is accounted for already: its rival names nothing
        "share_covered": (2, 3),  # 0.6 and 0.02 lie within, 0.3 does not
        "unexplained_close": (0, 1),  # 0.12 for 0.04
        "unexplained_covered": (1, 1),
        "complete": (0, 1),
        "none_right": (0, 0),
    }
    bins = {one["low"]: (one["found"]["count"], one["found"]["total"]) for one in crowd["share_bins"]}
    assert bins == {0.0: (0, 1), 0.01: (0, 0), 0.02: (1, 1), 0.05: (0, 1), 0.1: (0, 0), 0.2: (1, 1), 0.5: (1, 1)}
    rates = body["budgets"]["all"]["rates"]
    assert (rates["none_right"]["count"], rates["none_right"]["total"]) == (1, 3)
    # The single effects have all of their gap; pairs without recorded shares do not count.
    assert (rates["found"]["count"], rates["found"]["total"]) == (4 + 2, 6 + 3)
    assert (rates["unexplained_close"]["count"], rates["unexplained_close"]["total"]) == (1, 2)


def test_an_entry_accounts_for_one_effect() -> None:
    hidden = key("pair", "cogging", "current_offset", shares={"cogging": 0.5, "current_offset": 0.5})
    one = Answer("explained", (BudgetEntry("cogging", ("current_offset",), Stated(1.0)),))
    found = ledger(hidden, one)
    assert [item.entry is not None for item in found.items] == [True, False] and not found.absent
    both = Answer("explained", (*one.entries, BudgetEntry("end_effect", ("cogging", "current_offset"))))
    found = ledger(hidden, both)
    assert [(item.entry is not None, item.rival) for item in found.items] == [(True, False), (True, True)]
    assert not found.absent


def test_a_right_budget_scores_full_marks_and_a_shuffled_one_none() -> None:
    shares = {"cogging": 0.5, "end_effect": 0.3, "quadratic_drag": 0.2}
    hidden = key("crowd", *shares, shares=shares, unexplained=0.0, gap=3.0)

    def answer(names: tuple[str, ...]) -> Answer:
        stated = [Stated(s, s - 0.05, s + 0.05) for s in shares.values()]
        entries = tuple(BudgetEntry(n, (), s) for n, s in zip(names, stated, strict=True))
        return Answer("explained", entries, Stated(0.01, 0.0, 0.04))

    right = score_budgets([(hidden, answer(tuple(shares)))]).rates
    assert all(right[n].value == 1.0 for n in ("found", "share_covered", "unexplained_close", "complete"))
    assert right["absent"].value == 0.0 and right["unexplained_covered"].value == 1.0
    turned = score_budgets([(hidden, answer(("end_effect", "quadratic_drag", "cogging")))]).rates
    assert turned["found"].value == 1.0 and turned["share_covered"].value == 0.0
    other = score_budgets([(hidden, answer(("backlash", "payload_change", "cable_force")))]).rates
    assert other["found"].value == 0.0 and other["absent"].value == 1.0


def test_the_confusion_matrix(proof: Path) -> None:
    matrix = summary("challenge", "score", proof)["confusion"]
    cell = {
        (row, column): matrix["counts"][i][j]
        for i, row in enumerate(matrix["rows"])
        for j, column in enumerate(matrix["columns"])
    }
    assert cell["cogging", "cogging"] == 1 and cell["end_effect", "cogging"] == pytest.approx(1 / 3)
    assert cell["cable_force", "constant_force"] == 1 and cell["friction_drift", "none"] == 1
    assert cell["none", "none"] == 1 and cell["none", "cogging"] == 1 and cell["none", "unknown"] == 1
    assert cell["unknown", "unknown"] == 1 and cell["unknown", "encoder_periodic_error"] == 1
    assert cell["force_ripple", "failed"] == 1
    assert sum(cell.values()) == pytest.approx(11)  # all but pairs and crowds


def test_files_and_tables(proof: Path) -> None:
    result = linid("challenge", "score", proof)
    assert result.exit_code == 0
    assert "1.5 of 6" in result.output and "25 % (" in result.output
    folder = proof / "score"
    assert json.loads((folder / "score.json").read_text(encoding="utf-8"))["rates"]["top_1"]["value"] == 0.25
    rows = (folder / "campaigns.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 16 and rows[2].startswith("axis_0002,single,cable_force,0.07,explained,constant_force,")
    shares = (folder / "shares.csv").read_text(encoding="utf-8").splitlines()
    assert "axis_0015,crowd,end_effect,0.3,0.3,end_effect_rival,1,0.2,0.1,0.25" in shares
    assert {p.name for p in folder.iterdir()} == {
        "score.json",
        "campaigns.csv",
        "shares.csv",
        "budget.csv",
        "strength.csv",
        "rates.png",
        "rates.pdf",
        "budget.png",
        "budget.pdf",
        "confusion.png",
        "confusion.pdf",
    }


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
    answers = {f"axis_{k:04d}": Answer("explained", (BudgetEntry(name),)) for k, name in enumerate(names)}
    own = score(keys, answers)
    assert own.rates["top_1"].value == 1.0 and own.rates["named_but_wrong"].value == 0.0
    turned = dict(zip(answers, [*list(answers.values())[1:], next(iter(answers.values()))], strict=True))
    other = score(keys, turned)
    assert other.rates["top_1"].value == 0.0 and other.rates["named_but_wrong"].value == 1.0


def test_arguments_are_exact_related_or_wrong() -> None:
    truth = ("time", "velocity")
    assert grade(("velocity", "time"), truth) == "exact"
    assert grade(("time",), truth) == grade(("time", "velocity", "position"), truth) == "related"
    # Without the main one, or beside the others something else: wrong.
    assert grade(("velocity",), truth) == grade(("time", "position"), truth) == grade((), truth) == "wrong"


def test_proposals_are_scored_by_arguments_and_closure() -> None:
    keys = {
        "a": key("unknown", "gated_vibration"),
        "b": key("unknown", "soft_rail"),
        "c": key("unknown", "wandering_force"),
        "d": key("unknown", "reversal_friction"),
        "e": key("none"),
        "f": key("none", law="maxwell"),
        "g": key("single", "cogging"),
        "h": key("unknown", "place_magnet"),
        "i": key("single", "cogging"),
    }
    entry = BudgetEntry("cogging")
    answers = {
        "a": Answer("unknown", oracle=0.8, proposal=Proposal(("velocity", "time"), 0.6)),
        # Half is named, and of the other half the proposal closes a half: three quarters in all.
        "b": Answer("partly explained", (entry,), closure=0.5, oracle=1.0, proposal=Proposal(("position",), 0.5)),
        # A walk at random tells nothing of other recordings: no closure is compared.
        "c": Answer("unknown", oracle=1.0, proposal=Proposal(("position",), 0.1)),
        "d": Answer("unknown", oracle=1.0),
        "e": Answer("none"),
        "f": Answer("unknown", proposal=Proposal(("travel",))),
        "g": Answer("explained", (entry,), proposal=Proposal(("time",))),
        # The rest of a named effect's form is no other cause.
        "i": Answer("partly explained", (entry,), proposal=Proposal(("position",), refines=("cogging",))),
        "h": Answer("failed"),
    }
    assert closed_of(answers["b"]) == pytest.approx(0.75) and closed_of(answers["d"]) is None
    score = score_proposals(keys, answers)
    counts = {name: (one.count, one.total) for name, one in score.rates.items()}
    assert counts == {
        "proposed": (3, 4),
        "arguments_exact": (1, 4),
        "arguments_main": (2, 4),
        "proposed_exact": (1, 3),
        "proposed_main": (2, 3),
        "proposed_where_none": (0, 1),
        "proposed_where_listed": (1, 2),
    }
    assert (score.closure, score.count) == (pytest.approx(0.75), 2)


def test_a_proposal_is_read_from_the_diagnosis(tmp_path: Path) -> None:
    body = said("unknown")
    for proposal, expected in (
        ({"arguments": ["time", "velocity"], "closed": 0.8}, Proposal(("time", "velocity"), 0.8)),
        (None, None),
    ):
        (tmp_path / "diagnosis.json").write_text(json.dumps({**body, "proposal": proposal}), encoding="utf-8")
        assert read_answer(tmp_path).proposal == expected
    (tmp_path / "diagnosis.json").write_text(json.dumps({**body, "proposal": {"closed": 1}}), encoding="utf-8")
    with pytest.raises(DataError):
        read_answer(tmp_path)


def test_a_friction_law_is_read_from_the_diagnosis(tmp_path: Path) -> None:
    laws = {"maxwell_slip": "maxwell", "dahl": "dahl", "lugre": None}
    for law, expected in laws.items():
        told = {"friction_law": {"law": law, "told": False}}
        (tmp_path / "diagnosis.json").write_text(json.dumps({**said("none"), **told}), encoding="utf-8")
        assert read_answer(tmp_path).law == expected
    for told, expected in (({"law": "lugre", "told": True}, "lugre"), (None, None)):
        (tmp_path / "diagnosis.json").write_text(json.dumps({**said("none"), "friction_law": told}), encoding="utf-8")
        assert read_answer(tmp_path).law == expected
