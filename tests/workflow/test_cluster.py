"""--scheduler: the same results as --jobs, workers that die or do not belong, resumption, Ctrl-C, clear refusals."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from linid.errors import ConfigError, LinidError
from linid.workflow.cluster import connection as cluster_module
from linid.workflow.cluster.connection import connected
from linid.workflow.cluster.worker import Terms, objection, own_versions
from linid.workflow.run.reporter import Reporter
from linid.workflow.run.request import Request
from tests.workflow.dask_processes import MINUTES, DaskProcesses, die, kill_worker, square
from tests.workflow.small import ROOT, campaign, children, linid, start, summary

distributed = pytest.importorskip("distributed", reason='needs the extra: pip install "linid[cluster]"')

DEFAULTS = "defaults: {population: 10, generations: 4, least_squares_steps: 4, figures: false}\njobs:\n"
FRICTION = "  - {name: friction, command: fit-friction, files: [campaign.yaml]}\n"
CMA = "  - {name: cma, command: fit-friction, files: [campaign.yaml], settings: {method: cma}, after: [friction]}\n"
CHECK = "  - {name: check, command: validate, files: [campaign.yaml], model: friction}\n"
DIAGNOSE = "  - {name: gap, command: diagnose, files: [campaign.yaml]}\n"
BAD = "  - {name: bad, command: fit-friction, files: [bad.csv]}\n"
NEEDS_BAD = "  - {name: needs_bad, command: validate, files: [campaign.yaml], model: bad}\n"
# Long enough to be caught in mid-search.
SLOW = (
    "  - {name: slow, command: fit-friction, files: [campaign.yaml], "
    "settings: {generations: 400, patience: 1000, population: 24}}\n"
)
# What may differ between equal runs: times, hosts, what a search saves on its way, and the list of digests.
UNEQUAL = {"run.json", "log.txt", "summary.csv", "checkpoint.json", ".linid_files"}


def batch(folder: Path, *jobs: str) -> Path:
    campaign(folder)
    (folder / "bad.csv").write_text("Time (ms),Actual Position (mm)\n", encoding="utf-8")
    path = folder / "batch.yaml"
    path.write_text(DEFAULTS + "".join(jobs), encoding="utf-8")
    return path


def results(folder: Path) -> dict[str, bytes]:
    """Everything below a run's folder that must be the same in an equal run."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in UNEQUAL]
    files = [path for path in files if path != folder / "config.yaml"]  # names the batch file
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def wait_for_generation(checkpoint: Path, least: int, process: Any) -> None:
    deadline = time.monotonic() + 60 * MINUTES
    while True:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline, "no checkpoint was written"
        try:
            if json.loads(checkpoint.read_text(encoding="utf-8"))["state"]["generation"] >= least:
                return
        except (OSError, ValueError):
            time.sleep(0.01)


def descendants(pid: int) -> list[int]:
    """The processes in which a worker computes."""
    return children(pid, "work_process")


def gone(pids: list[int]) -> bool:
    """Whether these processes end within a while."""
    deadline = time.monotonic() + 60.0
    while any(Path(f"/proc/{pid}").exists() for pid in pids):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


@pytest.fixture(scope="module")
def slow_alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The slow job without any cluster."""
    folder = tmp_path_factory.mktemp("alone")
    assert linid(
        "batch", batch(folder, SLOW, CHECK.replace("model: friction", "model: slow")), "--out", folder / "o"
    ).exit_code in (0, 5)
    return folder / "o"


def test_a_batch_on_workers_gives_the_same_files_and_resume_skips_what_is_done(tmp_path: Path) -> None:
    path = batch(tmp_path, CHECK, FRICTION, CMA, DIAGNOSE, BAD, NEEDS_BAD)
    here = summary("batch", path, "--out", tmp_path / "here")
    there = summary("batch", path, "--out", tmp_path / "there", "--scheduler", "local", "--jobs", 2)
    status = [(job["label"], job["status"], job["exit_code"]) for job in here["jobs"]]
    assert status == [(job["label"], job["status"], job["exit_code"]) for job in there["jobs"]]
    assert [one for _, one, _ in status][-2:] == ["failed", "skipped"]
    assert results(tmp_path / "here") == results(tmp_path / "there")
    assert {"friction/parameters.json", "check/gaps.json", "gap/diagnosis.json"} <= set(results(tmp_path / "there"))
    assert (tmp_path / "there" / "friction" / "log.txt").read_text(encoding="utf-8")
    stamps = {name: (tmp_path / "there" / name / "run.json").stat().st_mtime_ns for name in ("friction", "cma", "gap")}
    again = summary("batch", path, "--out", tmp_path / "there", "--scheduler", "local", "--jobs", 2, "--resume")
    assert [(job["label"], job["status"], job["exit_code"]) for job in again["jobs"]] == status
    assert stamps == {name: (tmp_path / "there" / name / "run.json").stat().st_mtime_ns for name in stamps}
    assert results(tmp_path / "here") == results(tmp_path / "there")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a campaign, and in `here` its diagnosis without any cluster."""
    folder = tmp_path_factory.mktemp("diagnosed")
    arguments = ("diagnose", campaign(folder, motor=True), "--out", folder / "here", "--no-figures", "--jobs", 2)
    assert linid(*arguments).exit_code == 0
    return folder


def fits(out: Path) -> int:
    """How many fits of a diagnosis are kept so far."""
    try:
        kept = json.loads((out / "checkpoint.json").read_text(encoding="utf-8"))["state"]
    except (OSError, ValueError):
        return 0
    return sum(isinstance(value, list) for value in kept.values())


def test_a_diagnosis_on_workers_gives_the_same_files(tmp_path: Path, diagnosed: Path) -> None:
    options = ("--no-figures", "--jobs", 2, "--scheduler", "local")
    result = linid("diagnose", diagnosed / "campaign.yaml", "--out", tmp_path / "there", *options)
    assert result.exit_code == 0, result.stderr
    assert "2 workers on 1 host" in result.stderr
    first, second = results(diagnosed / "here"), results(tmp_path / "there")
    assert "diagnosis.json" in first and first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []
    # What the workers have fitted is kept, so that an interrupted run could go on.
    kept = [json.loads((out / "checkpoint.json").read_text()) for out in (diagnosed / "here", tmp_path / "there")]
    assert kept[1]["state"].items() <= kept[0]["state"].items()
    assert fits(tmp_path / "there") >= 3


def test_an_interrupted_diagnosis_on_workers_goes_on_anywhere(tmp_path: Path, diagnosed: Path) -> None:
    out = tmp_path / "out"
    arguments = ("diagnose", diagnosed / "campaign.yaml", "--out", out, "--no-figures")
    process = start(*arguments, "--scheduler", "local", "--jobs", 2, cwd=tmp_path)
    deadline = time.monotonic() + 60 * MINUTES
    while fits(out) < 3:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.01)
    workers = children(process.pid)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60 * MINUTES)
    assert process.returncode == 130 and "--resume" in said and "Traceback" not in said, said
    assert workers and gone(workers) and not (out / "diagnosis.json").exists()
    assert linid(*arguments, "--resume").exit_code == 0
    assert results(out) == results(diagnosed / "here")


def test_a_killed_worker_costs_time_and_nothing_else(tmp_path: Path, slow_alone: Path) -> None:
    path = batch(tmp_path, SLOW, CHECK.replace("model: friction", "model: slow"))
    with DaskProcesses(tmp_path) as dask, ExitStack() as stack:
        for _ in range(2):
            dask.worker()
        client = dask.client(stack, workers=2)
        pids = client.run(os.getpid)
        process = start("batch", path, "--out", "o", "--scheduler", dask.address, cwd=tmp_path)
        wait_for_generation(tmp_path / "o/slow/checkpoint.json", 2, process)
        (busy,) = [address for address, keys in client.processing().items() if keys]
        helpers = descendants(pids[busy])
        os.kill(pids[busy], signal.SIGKILL)
        assert helpers and gone(helpers)
        _, said = process.communicate(timeout=60 * MINUTES)
        assert process.returncode in (0, 5), said
        assert "slow: started again, its worker was lost" in said
    assert "going on from generation" in (tmp_path / "o/slow/log.txt").read_text(encoding="utf-8")
    assert results(tmp_path / "o") == results(slow_alone)


def test_a_job_that_costs_too_many_workers_fails_alone(tmp_path: Path) -> None:
    endless = SLOW.replace("generations: 400, patience: 1000", "generations: 100000, patience: 100000")
    path = batch(tmp_path, endless, FRICTION)
    with DaskProcesses(tmp_path, allowed_failures=0) as dask, ExitStack() as stack:
        dask.worker()
        pids = dask.client(stack, workers=1).run(os.getpid)
        process = start("batch", path, "--out", "o", "--scheduler", dask.address, cwd=tmp_path)
        wait_for_generation(tmp_path / "o/slow/checkpoint.json", 1, process)
        dask.worker()
        dask.client(stack, workers=2)
        os.kill(next(iter(pids.values())), signal.SIGKILL)
        out, said = process.communicate(timeout=60 * MINUTES)
    assert process.returncode == 1, said
    assert "slow: failed" in said and "1 worker died of the same work" in said and "Traceback" not in said + out
    assert (tmp_path / "o/friction/parameters.json").exists()


@pytest.mark.parametrize("group", [False, True], ids=["parent only", "whole group"])
def test_ctrl_c_saves_the_state_and_leaves_no_process(tmp_path: Path, slow_alone: Path, group: bool) -> None:
    path = batch(tmp_path, SLOW, CHECK.replace("model: friction", "model: slow"))
    arguments = ("batch", path, "--out", tmp_path / "o", "--scheduler", "local", "--jobs", 1)
    process = start(*arguments, cwd=tmp_path)
    wait_for_generation(tmp_path / "o/slow/checkpoint.json", 1, process)
    workers = children(process.pid)
    processes = [*workers, *(helper for pid in workers for helper in descendants(pid))]
    assert len(processes) == 2
    for pid in [process.pid, *(workers if group else [])]:
        os.kill(pid, signal.SIGINT)
    _, said = process.communicate(timeout=60 * MINUTES)
    assert process.returncode == 130 and "--resume" in said and "Traceback" not in said, said
    assert gone(processes)
    assert json.loads((tmp_path / "o/slow/run.json").read_text(encoding="utf-8"))["status"] == "interrupted"
    assert not (tmp_path / "o/slow/parameters.json").exists() and not (tmp_path / "o/check").exists()
    assert linid(*arguments, "--resume").exit_code in (0, 5)
    assert results(tmp_path / "o") == results(slow_alone)


def test_workers_here_end_with_the_program_that_started_them(tmp_path: Path) -> None:
    path = batch(tmp_path, SLOW)
    process = start("batch", path, "--out", tmp_path / "o", "--scheduler", "local", "--jobs", 1, cwd=tmp_path)
    wait_for_generation(tmp_path / "o/slow/checkpoint.json", 1, process)
    workers = children(process.pid)
    processes = [*workers, *(helper for pid in workers for helper in descendants(pid))]
    process.kill()
    process.communicate()
    assert len(processes) == 2 and gone(processes)


def test_a_worker_of_another_linid_is_refused(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "linid", tmp_path / "other" / "linid", ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / "other/linid/errors.py").open("a", encoding="utf-8") as stream:
        stream.write("# edited\n")
    path = batch(tmp_path, FRICTION)
    with DaskProcesses(tmp_path) as dask, ExitStack() as stack:
        dask.worker(package=tmp_path / "other")
        dask.client(stack, workers=1)
        result = linid("batch", path, "--out", tmp_path / "o", "--scheduler", dask.address)
    assert result.exit_code == 3 and "has linid source" in result.stderr and "worker tcp://" in result.stderr
    assert not (tmp_path / "o").exists()


def test_what_a_worker_objects_to(tmp_path: Path) -> None:
    mine = own_versions()
    (tmp_path / "run.json").write_text("this run", encoding="utf-8")
    good = Terms("token", mine, str(tmp_path), "this run")
    assert objection(good, [str(tmp_path / "run.json")]) is None
    cases = (
        (objection(Terms("token", {**mine, "Python": "2.7"})), f"has Python {mine['Python']}, this program 2.7"),
        (objection(Terms("token", {**mine, "linid": "9.9"})), f"has linid {mine['linid']}, this program 9.9"),
        (objection(Terms("token", mine, str(tmp_path / "elsewhere"), "this run")), "does not see the folder"),
        # Another folder under the same path is not the shared one.
        (objection(Terms("token", mine, str(tmp_path), "another run")), "does not see the folder"),
        (objection(good, [str(tmp_path / "nowhere.csv")]), "does not see the file"),
    )
    for found, words in cases:
        assert found is not None and words in found[0] and found[1].endswith(".")


def test_an_address_where_nothing_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "ANSWER_WITHIN", 2)
    path = batch(tmp_path, FRICTION)
    for address in ("tcp://127.0.0.1:9", "nonsense://somewhere"):
        result = linid("batch", path, "--out", tmp_path / "o", "--scheduler", address)
        assert result.exit_code == 2 and address in result.stderr and "dask scheduler" in result.stderr, result.output
    assert not (tmp_path / "o").exists()


def test_a_cluster_without_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "WORKER_WITHIN", 1)
    with DaskProcesses(tmp_path) as dask:
        result = linid("diagnose", campaign(tmp_path), "--out", tmp_path / "o", "--scheduler", dask.address)
    assert result.exit_code == 2 and "no workers" in result.stderr and f"dask worker {dask.address}" in result.stderr


@pytest.mark.parametrize("command", ["batch", "diagnose"])
def test_without_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    path = batch(tmp_path, FRICTION) if command == "batch" else campaign(tmp_path)
    result = linid(command, path, "--out", tmp_path / "o", "--scheduler", "local")
    assert result.exit_code == 2 and 'pip install "linid[cluster]"' in result.stderr
    assert not (tmp_path / "o").exists()


def test_items_side_by_side_on_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with connected(Request(scheduler="local", jobs=2), Reporter(-1)) as cluster:
        assert cluster is not None
        assert list(cluster.map(square, range(5))) == [0, 1, 4, 9, 16]
        with pytest.raises(ConfigError, match="cannot be squared"):
            list(cluster.map(square, [7]))
        with pytest.raises(LinidError, match=r"ended without an answer \(exit code 9\), 3 times"):
            list(cluster.map(die, [1]))
        with pytest.raises(LinidError, match="4 workers died of the same work"):
            list(cluster.map(kill_worker, [1]))
        assert list(cluster.map(square, range(5))) == [0, 1, 4, 9, 16]
