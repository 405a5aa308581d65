"""A suite that others can enter: the same bytes for the same seed, keys apart, files as the manifest lists them."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid.challenge.axes import draw_axis
from linid.challenge.catalogue import LISTED
from linid.challenge.hidden_axis import LAWS
from linid.challenge.make import assignment, variant
from linid.challenge.outside import OUTSIDE
from linid.challenge.suite import (
    GROUPS,
    SUITE_VERSION,
    campaign_plan,
    dealt_names,
    group_plan,
    group_sizes,
    read_suite_keys,
)
from linid.challenge.suite_files import check_files, check_keys, default_keys, export_suite, read_manifest
from linid.errors import ConfigError, DataError, UsageError
from linid.recording.campaign import read_campaign
from linid.workflow.commands.suite import answer, score_submission
from linid.workflow.run.reporter import Reporter
from tests.challenge.test_make import digests
from tests.workflow.small import linid, summary

TINY: dict[str, Any] = {"seed": 5, "size": 2, "groups": ("single", "none")}


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("entered") / "suite"
    export_suite(folder, default_keys(folder), **TINY)
    return folder


def test_equal_seeds_give_equal_bytes_whatever_jobs(suite: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    manifest = export_suite(again, tmp_path / "sealed.yaml", **TINY, jobs=2)
    assert digests(again) == digests(suite)
    assert (tmp_path / "sealed.yaml").read_bytes() == default_keys(suite).read_bytes()
    assert manifest == read_manifest(suite) == read_manifest(again)


def test_the_manifest_lists_every_file_and_the_campaigns_are_read(suite: Path) -> None:
    manifest = read_manifest(suite)
    there = digests(suite)
    del there["suite.json"]
    assert manifest.files == there
    assert {"README.md", "LICENSE", "submission.schema.json"} <= set(there)
    body = json.loads((suite / "suite.json").read_text(encoding="utf-8"))
    assert body["seed"] == 5 and body["suite"].startswith(f"{SUITE_VERSION}-") and body["license"] == "CC-BY-4.0"
    for name in manifest.campaigns:
        assert len(read_campaign(suite / name / "campaign.yaml").recordings) == 19
    check_files(suite, manifest)


def test_nothing_in_the_suite_tells_what_is_hidden(suite: Path) -> None:
    sealed = read_suite_keys(default_keys(suite))
    hidden = [name for key in sealed.keys.values() for name in key.effects]
    assert hidden and set(sealed.groups.values()) == {"single", "none"}
    assert not list(suite.rglob("*keys*")) and not (suite / "fresh").exists()
    for path in suite.glob("axis_*/*"):
        text = path.read_text(encoding="utf-8")
        assert not any(word in text for word in (*hidden, "seed", "strength", "single"))
    body = (suite / "suite.json").read_text(encoding="utf-8")
    assert not any(name in body for name in hidden)
    check_keys(default_keys(suite), sealed, read_manifest(suite))


def test_names_are_dealt_over_all_groups() -> None:
    dealt = dealt_names(group_sizes(60), 2026)
    assert Counter(group for group, _ in dealt.values()) == {name: group.weight for name, group in GROUPS.items()}
    assert len(set(dealt.values())) == 60 and list(dealt) == sorted(dealt)
    assert [group for group, _ in dealt.values()] != sorted(group for group, _ in dealt.values())
    assert dealt_names(group_sizes(60), 2027) != dealt


def test_groups_hide_what_they_say() -> None:
    def drawn(group: str) -> list[tuple[str, ...]]:
        return [assignment(group_plan(group, 2026), k)[1] for k in range(GROUPS[group].weight)]

    assert all(len(names) == 4 and set(names) <= set(LISTED) for names in drawn("crowds"))
    assert all(len(set(names)) == 2 for names in drawn("pairs"))
    outside = [name for names in drawn("outside") for name in names]
    assert set(outside) <= set(OUTSIDE) and len(set(outside)) == len(outside)
    assert all(
        len(names) == 1 and names[0] in LISTED for group in ("single", "laws", "coarse") for names in drawn(group)
    )
    assert set(drawn("none")) == {()}
    assert len({group_plan(group, 3).seed for group in GROUPS}) == len(GROUPS)


def test_every_friction_law_but_lugres_is_hidden_equally_often() -> None:
    drawn = [
        variant(campaign_plan("laws", 2026, k), k, draw_axis("axis", np.random.default_rng(k))).law
        for k in range(GROUPS["laws"].weight)
    ]
    assert Counter(drawn) == {law: 2 for law in LAWS if law != "lugre"}
    assert campaign_plan("single", 3, 5) == group_plan("single", 3)


@pytest.mark.parametrize("size", [7, 8, 20, 59, 60, 61, 300])
def test_sizes_add_up_and_leave_no_group_out(size: int) -> None:
    sizes = group_sizes(size)
    assert sum(sizes.values()) == size and list(sizes) == list(GROUPS) and min(sizes.values()) >= 1


@pytest.mark.parametrize(("size", "groups"), [(6, tuple(GROUPS)), (3, ("singles",)), (3, ())])
def test_sizes_and_groups_that_cannot_be(size: int, groups: tuple[str, ...]) -> None:
    with pytest.raises(UsageError):
        group_sizes(size, groups)


def test_a_suite_goes_nowhere_where_something_is_and_never_around_its_keys(suite: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="not an empty folder"):
        export_suite(suite, tmp_path / "keys.yaml", **TINY)
    with pytest.raises(UsageError, match="exists"):
        export_suite(tmp_path / "new", default_keys(suite), **TINY)
    with pytest.raises(UsageError, match="lies in the suite"):
        export_suite(tmp_path / "new", tmp_path / "new" / "keys.yaml", **TINY)
    assert not (tmp_path / "new").exists()


def fake(path: Path, out: Path, jobs: int) -> None:
    """A diagnosis that names cogging in the first campaign and fails on the second."""
    if path.parent.name == "axis_0002":
        raise DataError(str(path), "is odd", "Look at it.")
    entry = {"effect": "cogging", "rivals": ["cable_force"], "share": 0.9, "low": 0.8, "high": 1.0}
    body = {"verdict": {"status": "explained"}, "budget": {"gap": 1.0, "closed": 0.9, "entries": [entry]}}
    (out / "diagnosis.json").write_text(json.dumps(body), encoding="utf-8")


def test_diagnoses_become_a_submission_that_is_scored(suite: Path, tmp_path: Path) -> None:
    out = tmp_path / "linid.json"
    done = answer(suite, out, Reporter(-1), diagnose=fake)
    assert done.exit_code == 1 and done.summary["failed"] == ["axis_0002"]
    body = json.loads(out.read_text(encoding="utf-8"))
    said = {"effects": ["cogging"], "shares": {"cogging": {"share": 0.9, "low": 0.8, "high": 1.0}}}
    assert body["answers"] == {"axis_0001": said} and body["entrant"].startswith("linid ")
    with pytest.raises(UsageError, match="--resume"):
        answer(suite, out, Reporter(-1), diagnose=fake)
    again = answer(suite, out, Reporter(-1), diagnose=fake, resume=True)
    assert [one["status"] for one in again.summary["campaigns"]] == ["kept", "failed"]
    scored = summary("challenge", "score", out, "--suite", suite)
    assert scored["missing"] == ["axis_0002"] and scored["groups"]["all"]["rates"]["answered"]["count"] == 1
    shown = linid("challenge", "score", out, "--keys", default_keys(suite))
    assert shown.exit_code == 0 and "Named" in shown.stdout and "axis_0002" in shown.stderr
    with pytest.raises(UsageError, match="no keys are named"):
        score_submission(out, Reporter(-1))


def test_an_unknown_cause_is_handed_in_with_what_it_depends_on(suite: Path, tmp_path: Path) -> None:
    def unknown(path: Path, out: Path, jobs: int) -> None:
        where = [{"label": "time within the recording", "coordinate": "time"}]
        left = {"share": 1.0, "low": 0.9, "high": 1.0, "depends_on": ["time within the recording", "recording"]}
        body = {
            "verdict": {"status": "unknown"},
            "where": where,
            "budget": {"gap": 1.0, "closed": 0.0, "entries": [], "unexplained": left},
        }
        (out / "diagnosis.json").write_text(json.dumps(body), encoding="utf-8")

    import shutil

    shutil.rmtree(suite / "results", ignore_errors=True)
    answer(suite, tmp_path / "out.json", Reporter(-1), diagnose=unknown)
    shutil.rmtree(suite / "results")
    body = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert body["answers"]["axis_0001"] == {"unknown": True, "arguments": ["time"]}


def test_changed_files_and_keys_are_seen(suite: Path, tmp_path: Path) -> None:
    manifest = read_manifest(suite)
    changed = next(suite.glob("axis_0001/*.csv"))
    before = changed.read_bytes()
    try:
        changed.write_bytes(before + b"\n")
        with pytest.raises(DataError, match="SHA-256 differs"):
            check_files(suite, manifest)
        changed.unlink()
        with pytest.raises(DataError, match="missing"):
            check_files(suite, manifest)
    finally:
        changed.write_bytes(before)
    (suite / "axis_0009").mkdir()
    (suite / "axis_0009" / "campaign.yaml").write_text("name: x\n", encoding="utf-8")
    with pytest.raises(DataError, match="no campaign of the suite"):
        check_files(suite, manifest)
    (suite / "axis_0009" / "campaign.yaml").unlink()
    (suite / "axis_0009").rmdir()
    keys = tmp_path / "keys.yaml"
    keys.write_bytes(default_keys(suite).read_bytes() + b"# more\n")
    with pytest.raises(ConfigError, match="was changed"):
        check_keys(keys, read_suite_keys(keys), manifest)


def test_the_commands_write_suites_and_keep_secret_seeds(tmp_path: Path) -> None:
    made = summary(
        "challenge",
        "export",
        tmp_path / "s",
        "--size",
        1,
        "--groups",
        "none",
        "--seed",
        8,
        "--secret-seed",
        "--jobs",
        1,
    )
    assert made["seed"] is None and Path(made["keys"]) == tmp_path / "s_keys.yaml"
    text = (tmp_path / "s" / "suite.json").read_text(encoding="utf-8")
    assert json.loads(text)["seed"] is None and "seed is not told" in (tmp_path / "s" / "README.md").read_text("utf-8")
    assert linid("challenge", "export", tmp_path / "t", "--groups", "nothing").exit_code == 2
