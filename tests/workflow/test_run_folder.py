"""Run folders own their files: nothing else is removed or written over, and two runs never share a folder."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from linid.cli.main import cli
from linid.errors import UsageError
from linid.report.files import LIST_FILE, FileList, start_listing, stop_listing, write_atomic
from linid.workflow.run.run_folder import RunFolder, clear_run, open_run_folder

STAND = Path(__file__).parents[2] / "data" / "stand"
QUICK = ("--no-figures", "--set", "generations=2", "--jobs", "1", "-q")


def run(*arguments: object) -> tuple[int, str]:
    """Exit code and output of a command."""
    result = CliRunner().invoke(cli, [str(a) for a in arguments])
    return result.exit_code, result.output


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder by relative path."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture
def fitted(tmp_path: Path) -> Path:
    for k in (1, 2):
        shutil.copy(STAND / f"freewheel_{k}.csv", tmp_path / f"freewheel_{k}.csv")
    code, output = run("fit-friction", tmp_path / "freewheel_1.csv", "--out", tmp_path / "o", *QUICK)
    assert code in (0, 5), output
    return tmp_path


def test_every_file_of_a_run_is_listed(fitted: Path) -> None:
    out = fitted / "o"
    there = {name for name in contents(out) if not name.startswith(".linid")}
    assert there == set(FileList(out).files)


@pytest.mark.parametrize("command", ["simulate", "fit-motor"])
def test_an_input_of_the_run_is_never_removed(fitted: Path, command: str) -> None:
    """Both once deleted the fit that they were given."""
    out, model = fitted / "o", fitted / "o" / "parameters.json"
    shutil.copy(STAND / "moves_1.csv", fitted / "moves_1.csv")
    link = fitted / "model.json"
    link.symlink_to(model)
    before = contents(out)
    for given in (model, link):
        files = [given, fitted / "freewheel_2.csv"] if command == "simulate" else [fitted / "moves_1.csv"]
        options = [] if command == "simulate" else ["--model", "sine", "--friction", given, *QUICK]
        code, output = run(command, *files, *options, "--out", out, "--overwrite")
        assert code == 2 and "is an input of this run" in output, output
        now = contents(out)
        assert {k: v for k, v in now.items() if k != ".linid.lock"} == {
            k: v for k, v in before.items() if k != ".linid.lock"
        }


def test_files_of_others_stay(fitted: Path) -> None:
    out = fitted / "o"
    mine = {
        "report.html": b"mine",
        "figures/mine.png": b"mine",
        "friction/notes.txt": b"mine",
        "simulations/a.csv": b"1",
    }
    for name, content in mine.items():
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_bytes(content)
    code, output = run("fit-friction", fitted / "freewheel_2.csv", "--out", out, "--overwrite", *QUICK)
    assert code in (0, 5), output
    assert {name: (out / name).read_bytes() for name in mine} == mine
    clear_run(out)
    assert {k for k in contents(out) if not k.startswith(".linid")} == set(mine)


def test_a_file_that_was_changed_since_is_kept_and_named(fitted: Path) -> None:
    out = fitted / "o"
    (out / "parameters.csv").write_text("my notes\n", encoding="utf-8")
    before = contents(out)
    code, output = run("fit-friction", fitted / "freewheel_2.csv", "--out", out, "--overwrite", *QUICK)
    assert code == 2 and "parameters.csv" in output and "has been changed" in output
    assert contents(out) == before


def test_a_folder_without_a_list_is_left_alone(fitted: Path) -> None:
    (fitted / "o" / LIST_FILE).unlink()
    code, output = run("fit-friction", fitted / "freewheel_2.csv", "--out", fitted / "o", "--overwrite", *QUICK)
    assert code == 2 and "did not list its files" in output


def test_a_foreign_file_in_the_way_of_a_result_is_not_replaced(fitted: Path) -> None:
    out = fitted / "o"
    (out / "parameters.csv").unlink()
    list_file = out / LIST_FILE
    kept = [line for line in list_file.read_text(encoding="utf-8").splitlines() if '"parameters.csv"' not in line]
    list_file.write_text("\n".join(kept) + "\n", encoding="utf-8")
    (out / "parameters.csv").write_text("mine\n", encoding="utf-8")
    code, output = run("fit-friction", fitted / "freewheel_2.csv", "--out", out, "--overwrite", *QUICK)
    assert code == 2 and "is in the way" in output
    assert (out / "parameters.csv").read_text(encoding="utf-8") == "mine\n"


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    one = open_run_folder("simulate", tmp_path / "o")
    one.begin(identity="1", config="", inputs=[], seed=None, jobs=1)
    other = RunFolder(tmp_path / "o", "simulate", overwrite=True)
    with pytest.raises(UsageError, match=rf"another run \(process {os.getpid()} on"):
        other.begin(identity="2", config="", inputs=[], seed=None, jobs=1)
    one.end("done", 0)
    other.begin(identity="2", config="", inputs=[], seed=None, jobs=1)
    other.end("done", 0)
    assert json.loads((tmp_path / "o" / "run.json").read_text(encoding="utf-8"))["identity"] == "2"


def test_two_processes_at_once_leave_one_result(fitted: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "linid.cli.main",
        "fit-friction",
        "freewheel_1.csv",
        "--out",
        "o",
        "--overwrite",
        *QUICK,
    ]
    both = [subprocess.Popen(command, cwd=fitted, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    codes = [process.wait(120) for process in both]
    said = "".join(process.stderr.read() for process in both if process.stderr)
    assert sorted(codes) in ([0, 2], [0, 0], [5, 5], [2, 5]), said
    assert ("is writing into this folder" in said) == (2 in codes)
    record = json.loads((fitted / "o" / "run.json").read_text(encoding="utf-8"))
    assert record["status"] in ("done", "not_converged")
    listed = FileList(fitted / "o")
    assert {p.name for p in listed.own()} >= {"parameters.json", "run.json"}


def test_a_run_that_has_just_begun_is_named_whatever_it_has_written(tmp_path: Path) -> None:
    one = open_run_folder("simulate", tmp_path / "o")
    one.begin(identity="1", config="", inputs=[], seed=None, jobs=1)
    (tmp_path / "o" / "run.json").unlink()  # as between its first file and its second
    for overwrite in (False, True):
        with pytest.raises(UsageError, match="another run is writing into this folder"):
            open_run_folder("simulate", tmp_path / "o", overwrite=overwrite)
    one.end("done", 0)


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_run_that_came_and_went_since_the_folder_was_chosen_is_not_mixed_with(
    tmp_path: Path, overwrite: bool
) -> None:
    late = open_run_folder("simulate", tmp_path / "o", overwrite=overwrite)
    early = open_run_folder("simulate", tmp_path / "o")
    early.begin(identity="1", config="", inputs=[], seed=None, jobs=1)
    write_atomic(tmp_path / "o" / "early.csv", b"1")
    early.end("done", 0)
    if overwrite:
        late.begin(identity="2", config="", inputs=[], seed=None, jobs=1)
        late.end("done", 0)
    else:
        with pytest.raises(UsageError, match="not empty"):
            late.begin(identity="2", config="", inputs=[], seed=None, jobs=1)
        open_run_folder("simulate", tmp_path / "o", overwrite=True)  # nobody holds it
    assert (tmp_path / "o" / "early.csv").exists() == (not overwrite)
    record = json.loads((tmp_path / "o" / "run.json").read_text(encoding="utf-8"))
    assert record["identity"] == ("2" if overwrite else "1")


def test_a_full_disk_names_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(source: object, target: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left") as caught:
        write_atomic(tmp_path / "a" / "result.csv", b"1")
    assert caught.value.filename == str(tmp_path / "a" / "result.csv")
    assert list((tmp_path / "a").iterdir()) == []


def test_what_was_listed_survives_a_kill_in_the_middle(tmp_path: Path) -> None:
    start_listing(tmp_path)
    write_atomic(tmp_path / "a.csv", b"1")
    stop_listing(tmp_path)
    with (tmp_path / LIST_FILE).open("a", encoding="utf-8") as file:
        file.write('{"file": "b.csv", "sha')  # killed while it wrote the line
    (tmp_path / ".a.csv.linid-x1y2").write_bytes(b"half")
    (tmp_path / "a.csv.linid-mine").write_bytes(b"mine")
    clear_run(tmp_path)
    assert contents(tmp_path) == {"a.csv.linid-mine": b"mine"}


def killed_at(moment: float, folder: Path, arguments: list[str]) -> bool:
    """Start a command and kill it after so many seconds; whether it had ended before."""
    process = subprocess.Popen(
        [sys.executable, "-m", "linid.cli.main", *arguments],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    end = time.monotonic() + moment
    while time.monotonic() < end:
        if process.poll() is not None:
            return True
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    return False


def survives_kills(folder: Path, arguments: list[str], compared: tuple[str, ...], kills: int, seed: int) -> None:
    """Killed at random moments, --resume ends at the bytes of an undisturbed run; the user's files stay."""
    start = time.monotonic()
    undisturbed = [*arguments, "--out", "whole"]
    assert not killed_at(1e3, folder, undisturbed) or (folder / "whole" / "run.json").exists()
    lasted = time.monotonic() - start
    mine = {p.name: p.read_bytes() for p in folder.glob("*.*") if p.is_file()}
    generator = np.random.default_rng(seed)
    for _ in range(kills):
        resume = ["--resume"] if (folder / "o" / "run.json").exists() else []
        if not resume and (folder / "o").exists():
            shutil.rmtree(folder / "o")  # killed before the folder was a run's
        if killed_at(float(generator.uniform(0.2, 1.0)) * lasted, folder, [*arguments, "--out", "o", *resume]):
            shutil.rmtree(folder / "o")
    resume = ["--resume"] if (folder / "o" / "run.json").exists() else ["--overwrite"]
    killed_at(1e3, folder, [*arguments, "--out", "o", *resume])
    for name in compared:
        assert (folder / "o" / name).read_bytes() == (folder / "whole" / name).read_bytes(), name
    assert {p.name: p.read_bytes() for p in folder.glob("*.*") if p.is_file()} == mine
    assert not list((folder / "o").rglob("*.linid-*"))


FRICTION = ["fit-friction", "freewheel_1.csv", "freewheel_2.csv", "--no-figures", "--jobs", "1", "-q"]


def test_kills_while_a_fit_writes(fitted: Path) -> None:
    shutil.rmtree(fitted / "o")
    survives_kills(fitted, FRICTION, ("parameters.json", "parameters.csv", "gaps.json"), kills=3, seed=5)


@pytest.mark.exhaustive
def test_fifty_kills(fitted: Path) -> None:
    shutil.rmtree(fitted / "o")
    survives_kills(fitted, FRICTION, ("parameters.json", "parameters.csv", "gaps.json"), kills=50, seed=6)


BATCH = """
name: two
defaults: {figures: false}
jobs:
  - {name: one, command: fit-friction, files: [freewheel_1.csv]}
  - {name: two, command: fit-friction, files: [freewheel_1.csv, freewheel_2.csv]}
"""


@pytest.mark.exhaustive
def test_kills_while_a_batch_writes(fitted: Path) -> None:
    """The jobs' processes go with the batch that is killed, so that --resume finds their folders free."""
    shutil.rmtree(fitted / "o")
    (fitted / "batch.yaml").write_text(BATCH, encoding="utf-8")
    compared = ("one/parameters.json", "two/parameters.json", "two/gaps.json")
    survives_kills(fitted, ["batch", "batch.yaml", "--jobs", "2", "-q"], compared, kills=12, seed=7)


@pytest.mark.exhaustive
def test_kills_while_a_diagnosis_writes(fitted: Path) -> None:
    shutil.rmtree(fitted / "o")
    rows = [f"  - {{file: freewheel_{k}.csv, split: {split}}}" for k, split in ((1, "fit"), (2, "held_out"))]
    (fitted / "campaign.yaml").write_text("\n".join(["name: small", "recordings:", *rows]) + "\n", encoding="utf-8")
    compared = ("diagnosis.json", "model_before.json", "report.html")
    survives_kills(fitted, ["diagnose", "campaign.yaml", "-q", "--jobs", "1"], compared, kills=8, seed=8)
