"""Running a diagnosis over a challenge: keys stay sealed, failures stay local, resume, jobs."""

from __future__ import annotations

import builtins
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from linid.challenge.run import run_challenge
from linid.errors import DataError, UsageError
from linid.workflow.commands.challenge import run
from linid.workflow.run.reporter import Reporter
from tests.workflow.small import ROOT, children, interruptible, linid


def fake(path: Path, out: Path, jobs: int) -> None:
    """A diagnosis that knows nothing; axis_0002 makes it fail."""
    if path.parent.name == "axis_0002":
        raise DataError(str(path), "is odd", "Look at it.")
    assert path.is_file() and jobs == 1
    body = {"schema": 1, "verdict": {"status": "none", "effects": [], "equivalent": []}, "ranking": []}
    (out / "diagnosis.json").write_text(json.dumps(body), encoding="utf-8")


def never(path: Path, out: Path, jobs: int) -> None:
    raise AssertionError("must not be called")


@pytest.fixture
def proof(tmp_path: Path) -> Path:
    for name in ("axis_0001", "axis_0002", "axis_0003"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "campaign.yaml").write_text("name: x\n", encoding="utf-8")
    return tmp_path


def test_every_campaign_is_diagnosed_and_a_failure_stays_its_own(proof: Path) -> None:
    outcome = run(proof, Reporter(-1), diagnose=fake)
    assert outcome.exit_code == 1 and outcome.summary["failed"] == ["axis_0002"]
    assert (proof / "results/axis_0001/diagnosis.json").exists() and (
        proof / "results/axis_0003/diagnosis.json"
    ).exists()
    assert "is odd" in (proof / "results/axis_0002/error.txt").read_text(encoding="utf-8")


def test_processes_write_the_same(proof: Path) -> None:
    one = run_challenge(proof, fake, jobs=2)
    assert [(d.campaign, d.status) for d in one] == [
        ("axis_0001", "done"),
        ("axis_0002", "failed"),
        ("axis_0003", "done"),
    ]


def test_resume_keeps_what_is_done_and_repeats_what_failed(proof: Path) -> None:
    run_challenge(proof, fake)
    with pytest.raises(UsageError, match="--resume"):
        run_challenge(proof, never)
    called: list[str] = []

    def note(path: Path, out: Path, jobs: int) -> None:
        called.append(path.parent.name)
        (out / "diagnosis.json").write_text("{}", encoding="utf-8")

    ended = run_challenge(proof, note, resume=True)
    assert called == ["axis_0002"]
    assert [d.status for d in ended] == ["kept", "done", "kept"]
    assert not (proof / "results/axis_0002/error.txt").exists()


@pytest.mark.parametrize("present", [True, False])
def test_run_never_opens_the_keys(proof: Path, present: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = proof / "keys.yaml"
    if present:
        keys.write_text("sealed", encoding="utf-8")
    opened: list[str] = []
    true_open, true_io_open = builtins.open, io.open

    def watch(original: Any) -> Any:
        def watched(file: Any, *arguments: Any, **options: Any) -> Any:
            opened.append(str(file))
            assert "keys" not in Path(str(file)).name
            return original(file, *arguments, **options)

        return watched

    monkeypatch.setattr(builtins, "open", watch(true_open))
    monkeypatch.setattr(io, "open", watch(true_io_open))
    outcome = run(proof, Reporter(-1), diagnose=fake)
    assert outcome.summary["failed"] == ["axis_0002"]
    assert any("error.txt" in name for name in opened)  # the watch sees what is opened


def test_a_diagnosis_that_writes_nothing_has_failed(proof: Path) -> None:
    ended = run_challenge(proof, lambda path, out, jobs: None)
    assert {d.status for d in ended} == {"failed"} and "no diagnosis.json" in ended[0].error


def test_without_campaigns_there_is_nothing_to_run(tmp_path: Path) -> None:
    result = linid("challenge", "run", tmp_path)
    assert result.exit_code == 4 and "challenge make" in result.stderr


WAITING = """
import time
from linid.challenge.run import in_processes

if __name__ == "__main__":
    list(in_processes(time.sleep, [(300.0,)] * 4, 2))
"""


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=["kill -9", "kill", "Ctrl-C"])
def test_workers_end_with_the_process_that_started_them(tmp_path: Path, blow: signal.Signals) -> None:
    script = tmp_path / "waiting.py"
    script.write_text(WAITING, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([sys.executable, str(script)], env=environment, preexec_fn=interruptible)
    workers: list[int] = []
    for _ in range(300):
        workers = children(process.pid)
        if len(workers) == 2:
            break
        time.sleep(0.1)
    time.sleep(1.0)  # both have taken up work
    process.send_signal(blow)
    process.wait(30)
    assert len(workers) == 2
    for _ in range(200):
        if not any(Path(f"/proc/{pid}").exists() for pid in workers):
            return
        time.sleep(0.1)
    raise AssertionError("a worker goes on alone")
