"""A run cut short by kill -9, kill or Ctrl-C goes on to the bytes of an undisturbed one; wrong ones are refused."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from linid.workflow.run.checkpoint import Memory
from tests.workflow.small import TINY, campaign, linid, start

# Long enough to be caught in mid-search: seconds, and the checkpoint is written every fifth of one.
GENERATIONS = 600
SEARCH = (
    "--population",
    "24",
    "--generations",
    str(GENERATIONS),
    "--set",
    "patience=1000",
    "--set",
    "least_squares_steps=4",
    "--no-figures",
)
MINUTES = 5.0


def generation(checkpoint: Path) -> int:
    try:
        return int(json.loads(checkpoint.read_text(encoding="utf-8"))["state"]["generation"])
    except (OSError, ValueError):
        return -1


def wait_for(checkpoint: Path, process: subprocess.Popen[str], least: int = 1) -> None:
    """Until the checkpoint holds a state in mid-search."""
    deadline = time.monotonic() + 60.0 * MINUTES
    while generation(checkpoint) < least:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline, "no checkpoint was written"
        time.sleep(0.005)


@pytest.fixture(scope="module", params=["genetic", "cma"])
def undisturbed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, tuple[str, ...]]:
    folder = tmp_path_factory.mktemp(f"undisturbed_{request.param}")
    path = campaign(folder)
    options = (*SEARCH, "--method", request.param)
    result = linid("fit-friction", path, "--out", folder / "out", *options)
    assert result.exit_code in (0, 5), result.stderr
    return folder, options


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM], ids=["kill -9", "Ctrl-C", "kill"])
def test_resumed_fit_is_the_undisturbed_one(
    undisturbed: tuple[Path, tuple[str, ...]], tmp_path: Path, blow: signal.Signals
) -> None:
    folder, options = undisturbed
    arguments = ("fit-friction", folder / "campaign.yaml", "--out", tmp_path / "out", *options)
    process = start(*arguments, cwd=tmp_path)
    wait_for(tmp_path / "out" / "checkpoint.json", process)
    process.send_signal(blow)
    _, said = process.communicate(timeout=60 * MINUTES)
    assert not (tmp_path / "out" / "parameters.json").exists(), "the search ended before it could be cut short"
    reached = generation(tmp_path / "out" / "checkpoint.json")
    assert 1 <= reached < GENERATIONS
    if blow != signal.SIGKILL:
        assert process.returncode == {signal.SIGINT: 130, signal.SIGTERM: 143}[blow]
        assert "--resume" in said and "Traceback" not in said
        record = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
        assert (record["status"], record["exit_code"]) == ("interrupted", process.returncode)
    result = linid(*arguments, "--resume", "--jobs", 2)
    assert result.exit_code in (0, 5), result.stderr
    assert f"going on from generation {reached}" in result.stderr
    for name in ("parameters.json", "convergence.csv", "gaps.json"):
        assert (tmp_path / "out" / name).read_bytes() == (folder / "out" / name).read_bytes(), name


def test_resumed_motor_fit_is_the_undisturbed_one(tmp_path: Path) -> None:
    """Killed in the friction stage, and again in the motor stage."""
    path = campaign(tmp_path, motor=True)
    options = ("--model", "sine", *SEARCH)
    out = tmp_path / "out"
    process = start("fit-motor", path, "--out", out, *options, cwd=tmp_path)
    wait_for(out / "friction" / "checkpoint.json", process)
    process.kill()
    process.communicate()
    assert not (out / "friction" / "parameters.json").exists()
    process = start("fit-motor", path, "--out", out, *options, "--resume", cwd=tmp_path)
    wait_for(out / "checkpoint.json", process)
    process.kill()
    process.communicate()
    assert (out / "friction" / "parameters.json").exists() and not (out / "parameters.json").exists()
    assert linid("fit-motor", path, "--out", out, *options, "--resume").exit_code in (0, 5)
    assert linid("fit-motor", path, "--out", tmp_path / "whole", *options).exit_code in (0, 5)
    for name in ("parameters.json", "friction/parameters.json", "gaps.json"):
        assert (out / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_resume_refuses_other_inputs_and_settings(tmp_path: Path) -> None:
    path = campaign(tmp_path / "c")
    out = tmp_path / "o"
    linid("fit-friction", path, "--out", out, *TINY)
    before = (out / "parameters.json").read_bytes()
    other = linid("fit-friction", path, "--out", out, "--resume", *TINY, "--seed", 9)
    assert other.exit_code == 3 and "other inputs, settings" in other.stderr
    assert linid("validate", out / "parameters.json", path, "--out", out, "--resume").exit_code == 2
    assert (out / "parameters.json").read_bytes() == before


def test_a_damaged_checkpoint_is_refused(tmp_path: Path) -> None:
    path = campaign(tmp_path / "c")
    out = tmp_path / "o"
    linid("fit-friction", path, "--out", out, *TINY)
    (out / "parameters.json").unlink()
    record = json.loads((out / "run.json").read_text(encoding="utf-8"))
    (out / "run.json").write_text(json.dumps({**record, "status": "interrupted"}), encoding="utf-8")
    (out / "checkpoint.json").write_text("{", encoding="utf-8")
    result = linid("fit-friction", path, "--out", out, "--resume", *TINY)
    assert result.exit_code == 3 and "checkpoint.json" in result.stderr


def test_resuming_a_finished_run_shows_it_again(tmp_path: Path) -> None:
    path = campaign(tmp_path / "c")
    out = tmp_path / "o"
    first = linid("fit-friction", path, "--out", out, *TINY)
    stamp = (out / "parameters.json").stat().st_mtime_ns
    again = linid("fit-friction", path, "--out", out, "--resume", *TINY)
    assert "already finished" in again.stderr
    assert again.stdout == first.stdout and (out / "parameters.json").stat().st_mtime_ns == stamp


def test_resume_alone_takes_the_newest_unfinished_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from linid.workflow.run.run_folder import open_run_folder

    monkeypatch.chdir(tmp_path)
    assert linid("fit-friction", campaign(tmp_path / "c"), "--resume").exit_code == 2
    for name, status in (("a", "interrupted"), ("b", "done")):
        folder = tmp_path / f"linid_fit-friction_{name}"
        folder.mkdir()
        record = {"tool": "linid", "command": "fit-friction", "status": status}
        (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    assert open_run_folder("fit-friction", None, resume=True).path.name == "linid_fit-friction_a"


def test_steps_that_end_in_several_threads_are_all_kept(tmp_path: Path) -> None:
    with Memory(tmp_path / "checkpoint.json", "same") as memory, ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: memory.__setitem__(f"step {k}", [float(k)] * 50), range(200)))
    later = Memory(tmp_path / "checkpoint.json", "same")
    later.load()
    assert dict(later) == {f"step {k}": [float(k)] * 50 for k in range(200)}


def test_steps_in_quick_succession_are_written_together_and_none_is_lost(tmp_path: Path) -> None:
    path, keys = tmp_path / "checkpoint.json", [f"step {k}" for k in range(50)]
    written = set()

    def kept() -> dict[str, list[float]]:
        later = Memory(path, "same")
        later.load()
        return dict(later)

    with pytest.raises(KeyboardInterrupt), Memory(path, "same") as memory:
        for key in keys:
            memory[key] = [1.0]
            written.add(path.stat().st_mtime_ns)
        assert keys[0] in kept()  # a kill loses what ended since
        raise KeyboardInterrupt
    assert len(written) < len(keys)
    assert list(kept()) == keys
