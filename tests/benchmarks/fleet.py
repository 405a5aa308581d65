"""A fleet through dask: `python -m tests.benchmarks.fleet FOLDER [--axes N] [--slow MS] [--lose K] [--workers W]`.

Makes N axes in FOLDER (what is there stays), each with friction of its own and four free wheels, and identifies all of
them by one `linid batch` on W workers. Every look at the shared folder, open, stat, rename and the like, takes the
workers MS milliseconds longer; K times one of them is killed at work and another joins. Prints wall and processor time,
what the losses cost, how many jobs are done and how often the 95 % intervals hold the truth, and computes some axes
again by themselves: the same bytes.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from linid.challenge.run import in_processes
from linid.stand.description import load_axis_description
from linid.stand.export import TRUTH_FILE, read_truth, write_campaign
from linid.stand.generate import generate
from tests.workflow.dask_processes import DaskProcesses
from tests.workflow.small import ROOT

WHEELS = ("freewheel_1", "freewheel_2", "freewheel_4", "freewheel_5")
SPREAD = 1.5  # of an axis' friction over the stand's, at most: with less a free wheel would leave the stroke
AGAIN = 10  # axes computed again by themselves
Worker = Callable[[], subprocess.Popen[bytes]]  # starts one
SAME = ("parameters.json", "parameters.csv", "gaps.csv", "convergence.csv")
# Put before what a worker imports: what it does with files below a folder takes longer.
SLOW = '''"""Files of a slow shared folder."""

import builtins, io, os, time

def _slow(function, folder=os.environ["SLOW_FOLDER"], seconds=float(os.environ["SLOW_SECONDS"])):
    def later(path, *arguments, **more):
        if not isinstance(path, int) and os.fsdecode(path).startswith(folder):
            time.sleep(seconds)
        return function(path, *arguments, **more)
    return later

builtins.open = io.open = _slow(io.open)
for _name in ("open", "stat", "lstat", "mkdir", "listdir", "scandir", "rename", "replace", "unlink", "access"):
    setattr(os, _name, _slow(getattr(os, _name)))
'''


def make_axis(folder: Path, number: int) -> int:
    """Write the recordings of one axis, unless they are there; its number."""
    if (folder / TRUTH_FILE).exists():
        return number
    stand = load_axis_description(ROOT / "configs" / "stand_axis.yaml")
    drawn = np.random.default_rng([7, number]).uniform(0.0, math.log(SPREAD), 6)
    values = stand.friction.model_dump()
    names = [name for name in values if name != "stribeck_exponent"]
    changed = {name: values[name] * float(np.exp(one)) for name, one in zip(names, drawn, strict=True)}
    description = stand.model_copy(update={"friction": stand.friction.model_copy(update=changed)})
    made = folder.with_suffix(".part")
    shutil.rmtree(made, ignore_errors=True)
    write_campaign(generate(description, seed=number, only=WHEELS), made)
    made.rename(folder)
    return number


def names_of(count: int) -> list[str]:
    return [f"axis_{k:05d}" for k in range(1, count + 1)]


def write_batch(folder: Path, names: Sequence[str]) -> Path:
    """The batch file of all axes."""
    jobs = [
        {"name": name, "command": "fit-friction", "files": [str(folder / "axes" / name / "campaign.yaml")]}
        for name in names
    ]
    path = folder / "fleet.yaml"
    path.write_text(yaml.safe_dump({"defaults": {"figures": "none"}, "jobs": jobs}), encoding="utf-8")
    return path


def bodies(out: Path) -> list[dict[str, Any]]:
    """run.json of every job that has begun."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(out.glob("axis_*/run.json"))]


def done(out: Path) -> int:
    return sum(1 for _ in out.glob("axis_*/parameters.json"))


def lose_workers(
    at_work: list[subprocess.Popen[bytes]], start: Worker, out: Path, count: int, lose: int, end: threading.Event
) -> list[tuple[float, int]]:
    """Kill `lose` workers, evenly over the jobs, and have another join at once for each.

    Returns when (s) and how many jobs were done by then.
    """
    losses, began = [], time.perf_counter()
    for k in range(1, lose + 1):
        while done(out) < k * count / (lose + 1):
            if end.wait(1.0):
                return losses
        at_work.pop(0).kill()
        losses.append((time.perf_counter() - began, done(out)))
        at_work.append(start())
    return losses


def run_batch(folder: Path, names: Sequence[str], workers: int, slow: float, lose: int) -> dict[str, Any]:
    """Run the batch on workers; what it took."""
    out, extra = folder / "out", folder / "slow"
    extra.mkdir(exist_ok=True)
    (extra / "sitecustomize.py").write_text(SLOW, encoding="utf-8")
    environment = {"PYTHONPATH": f"{extra}{os.pathsep}{ROOT}" if slow > 0.0 else str(ROOT)}
    environment |= {"SLOW_FOLDER": str(folder), "SLOW_SECONDS": str(slow)}
    batch = write_batch(folder, names)
    with DaskProcesses(folder) as dask:

        def start() -> subprocess.Popen[bytes]:
            return dask.worker(more=environment)

        at_work, end = [start() for _ in range(workers)], threading.Event()
        watcher = ThreadPoolExecutor(1)
        lost = watcher.submit(lose_workers, at_work, start, out, len(names), lose, end)
        before, began = os.times(), time.perf_counter()
        command = [sys.executable, "-m", "linid", "batch", str(batch), "--scheduler", dask.address, "--out", str(out)]
        again = ["--resume"] if (out / "run.json").exists() else []
        with (folder / "batch.txt").open("w", encoding="utf-8") as told:
            status = subprocess.run([*command, *again], check=False, stdout=told, stderr=told).returncode
        wall = time.perf_counter() - began
        own = sum(os.times()[2:4]) - sum(before[2:4])
        end.set()
        watcher.shutdown()
    return {"exit code": status, "wall": wall, "client": own, "losses": lost.result()}


def coverage(folder: Path, names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """How many of the 95 % intervals hold the truth, and of how many, by parameter."""
    held: dict[str, list[bool]] = defaultdict(list)
    for name in names:
        path = folder / "out" / name / "parameters.json"
        if not path.exists():
            continue
        truth = read_truth(folder / "axes" / name / TRUTH_FILE)
        for row in json.loads(path.read_text(encoding="utf-8"))["estimates"]:
            if row["status"] == "fitted":
                held[row["name"]].append(row["low"] <= truth[row["name"]] <= row["high"])
    return {name: (sum(rows), len(rows)) for name, rows in held.items()}


def same_alone(folder: Path, names: Sequence[str]) -> int:
    """How many of some axes, identified by a command of their own, give the bytes of the batch."""
    alike = 0
    for name in names:
        alone = folder / "alone" / name
        shutil.rmtree(alone, ignore_errors=True)
        campaign = str(folder / "axes" / name / "campaign.yaml")
        command = [sys.executable, "-m", "linid", "fit-friction", campaign, "--figures", "none", "--out", str(alone)]
        command += ["--jobs", "1", "--verify-search", "--quiet"]  # as in a batch
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        alike += all((alone / file).read_bytes() == (folder / "out" / name / file).read_bytes() for file in SAME)
    return alike


def report(folder: Path, names: Sequence[str], ran: dict[str, Any]) -> list[str]:
    """What there is to say."""
    out = folder / "out"
    begun = bodies(out)
    states = [body["status"] for body in begun]
    seconds = np.array([body["seconds"] for body in begun if body.get("seconds")])
    files = [path for path in out.rglob("*") if path.is_file()]
    lines = [
        f"jobs: {len(names)}, {', '.join(f'{states.count(one)} {one}' for one in sorted(set(states)))}; exit code "
        f"{ran['exit code']}",
        f"wall: {ran['wall']:.0f} s, {1e3 * ran['wall'] / len(names):.0f} ms a job; client {ran['client']:.0f} CPU s",
        f"written: {len(files)} files, {sum(path.stat().st_size for path in files) / 1e6:.0f} MB",
    ]
    if seconds.size:
        lines.append(f"a job: median {np.median(seconds):.2f} s, longest {seconds.max():.1f} s")
    lines += [f"lost a worker after {at:.0f} s, {count} jobs done" for at, count in ran["losses"]]
    held = coverage(folder, names)
    lines += [f"{name}: {inside} of {of} intervals hold the truth" for name, (inside, of) in held.items()]
    chosen = names[:: max(len(names) // AGAIN, 1)][:AGAIN]
    lines.append(f"by themselves: {same_alone(folder, chosen)} of {len(chosen)} the same bytes")
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--axes", type=int, default=1000)
    parser.add_argument("--slow", type=float, default=20.0, help="ms that each look at the shared folder takes longer")
    parser.add_argument("--lose", type=int, default=3, help="workers that are killed at work")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args(arguments)
    folder = options.folder.resolve()
    (folder / "axes").mkdir(parents=True, exist_ok=True)
    names = names_of(options.axes)
    items = [(folder / "axes" / name, number) for number, name in enumerate(names, 1)]
    for made, _ in enumerate(in_processes(make_axis, items, options.workers), 1):
        print(f"\r{made} of {len(names)} axes made", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    ran = run_batch(folder, names, options.workers, 1e-3 * options.slow, options.lose)
    print("\n".join(report(folder, names, ran)))


if __name__ == "__main__":
    main()
