"""Wrong configuration exits with 3, bad data with 4; each says where, what and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.workflow.small import STAND, campaign, linid

CAMPAIGN = f"recordings:\n  - {{file: {STAND / 'freewheel_1.csv'}, kind: free_wheel}}\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("population: 20\npopulatoin: 30\n", 2, ["populatoin", "Did you mean 'population'"]),
        ("seed: 1\npopulation: many\n", 2, ["population", "many"]),
        ("population: 3\n", 1, ["population", "greater than or equal to 8"]),
        ("seed: 1\nknown: {mass: heavy}\n", 2, ["known.mass", "heavy"]),
        ("bounds:\n  mass: [1]\n", 2, ["bounds.mass"]),
        ("seed: [1\n", 2, ["not valid YAML"]),
        ("objective: fast\n", 1, ["objective", "fast", "free_run"]),
        ("channels: {position: {column: y, unti: mm}}\n", 1, ["unti", "Did you mean 'unit'"]),
    ],
)
def test_a_wrong_settings_file_exits_with_3_and_names_the_line(
    tmp_path: Path, text: str, line: int, words: list[str]
) -> None:
    config = write(tmp_path / "settings.yaml", text)
    result = linid("fit-friction", campaign(tmp_path / "c"), "--config", config, "--dry-run")
    assert result.exit_code == 3, result.output
    assert f"{config}, line {line}" in result.stderr
    for word in words:
        assert word in result.stderr


def test_a_settings_file_may_be_empty(tmp_path: Path) -> None:
    config = write(tmp_path / "settings.yaml", "# all defaults\n")
    assert linid("fit-friction", campaign(tmp_path / "c"), "--config", config, "--dry-run").exit_code == 0


@pytest.mark.parametrize(
    ("assignment", "word"), [("populatoin=3", "population"), ("population=many", "many"), ("population", "key=value")]
)
def test_a_wrong_set_exits_with_3(tmp_path: Path, assignment: str, word: str) -> None:
    result = linid("fit-friction", campaign(tmp_path), "--set", assignment, "--dry-run")
    assert result.exit_code == 3 and word in result.stderr


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (CAMPAIGN + "axsi: linear\n", 3, "Did you mean 'axis'"),
        ("recordings:\n  - {file: nowhere.csv, kind: free_wheel}\n", 2, "nowhere.csv"),
        (CAMPAIGN.replace("kind: free_wheel", "kind: coasting"), 2, "coasting"),
        ("name: x\n", 1, "recordings"),
    ],
)
def test_a_wrong_campaign_exits_with_3(tmp_path: Path, text: str, line: int, word: str) -> None:
    path = write(tmp_path / "campaign.yaml", text)
    result = linid("fit-friction", path)
    assert result.exit_code == 3
    assert f"{path}, line {line}" in result.stderr and word in result.stderr


@pytest.mark.parametrize(
    "content",
    [b"", b"Time (ms),Actual Position (mm)\n", bytes(range(256)) * 20, b"a,b\n1,2\n"],
    ids=["empty", "header only", "binary", "too short"],
)
def test_bad_data_exit_with_4_and_leave_nothing(
    tmp_path: Path, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    monkeypatch.chdir(tmp_path)
    result = linid("fit-friction", path)
    assert result.exit_code == 4, result.stderr
    assert str(path) in result.stderr and "Traceback" not in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["bad.csv"]


def test_a_missing_recording_is_named(tmp_path: Path) -> None:
    result = linid("fit-friction", tmp_path / "nowhere.csv")
    assert result.exit_code in (2, 3, 4) and "nowhere.csv" in result.stderr and "Traceback" not in result.stderr


def test_a_file_that_is_no_model_exits_with_3(tmp_path: Path) -> None:
    model = write(tmp_path / "model.json", "{}")
    result = linid("validate", model, STAND / "freewheel_1.csv")
    assert result.exit_code == 3 and "not a linid model" in result.stderr


def test_a_folder_in_use_is_not_touched(tmp_path: Path) -> None:
    write(tmp_path / "mine.txt", "precious")
    for more in ([], ["--overwrite"], ["--resume"]):
        result = linid("fit-friction", campaign(tmp_path / "c"), "--out", tmp_path, *more)
        assert result.exit_code == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c", "mine.txt"]


def test_dry_run_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = campaign(tmp_path / "c", motor=True)
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    result = linid("fit-motor", "--model", "sine", path, "--dry-run", "--known", "bristle_damping=90")
    assert result.exit_code == 0
    assert "Stage friction" in result.output and "bristle_damping = 90" in result.output
    assert "Held out: freewheel_6, sine_current_3" in result.output
    assert list(work.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fit-motor", "--model", "theta"), ["driven runs with position and phase currents", "--model theta campaign"]),
        (("fit-motor",), ["driven runs"]),
        (("fit-friction",), ["free wheels"]),
        (("simulate", "model.json"), ["recordings whose inputs"]),
        (("validate", "model.json"), ["has not seen"]),
        (("diagnose",), ["more than once"]),
    ],
)
def test_a_command_without_a_file_says_what_to_give(arguments: tuple[str, ...], words: list[str]) -> None:
    result = linid(*arguments)
    assert result.exit_code == 2
    assert f"error: linid {arguments[0]}: no FILE is given" in result.stderr
    for word in (*words, "a campaign that lists them", "linid inspect FOLDER"):
        assert word in result.stderr
