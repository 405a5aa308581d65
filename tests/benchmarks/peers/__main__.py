"""linid against its peers: `python -m tests.benchmarks.peers [--seeds 20] [--limit 300] [--resume]`.

The same recordings, cost and bounds for everyone, each run in a process of its own on one core. Results grow in a JSON
file, so that an interrupted run goes on with --resume; at its end docs/benchmarks.md and two figures are written
(--report writes them from the file as it is). Run it on an otherwise idle machine.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.peers import report
from tests.benchmarks.peers.fits import FITS, PositionError
from tests.benchmarks.peers.problems import NAMES, Problem, judge, make_problem, truth
from tests.benchmarks.peers.simulators import SIMULATORS, missing
from tests.benchmarks.peers.speed import CASES
from tests.benchmarks.peers.watch import Done, Watch

ROOT = Path(__file__).parents[3]
SHARE = 0.01  # a cost within this share of the best known one counts as arrived
FAST = ("linid", "numbalsoda LSODA")  # simulators of the peers that --slow-seeds leaves alone
_STOP = 0.005  # ... and a run ends at half of it, so that a better best found later does not undo it


class Results:
    """The JSON file: versions, the best known costs, speeds and runs; written after each change."""

    def __init__(self, path: Path, resume: bool) -> None:
        self.path = path
        empty: dict[str, Any] = {"about": {}, "best": {}, "speed": {}, "box": {}, "runs": {}}
        self.data = json.loads(path.read_text(encoding="utf-8")) if resume and path.exists() else empty

    def put(self, part: str, key: str, value: Any) -> None:
        """Store one result."""
        self.data[part][key] = value
        scratch = self.path.with_suffix(".part")
        scratch.write_text(json.dumps(self.data, indent=1), encoding="utf-8")
        scratch.replace(self.path)


def about(seeds: int, limit: float) -> dict[str, Any]:
    """Machine, versions and settings of a run."""
    versions = {}
    for package in (
        "linid",
        "numpy",
        "scipy",
        "numba",
        "deap",
        "lmfit",
        "cma",
        "pints",
        "pypesto",
        "diffrax",
        "jax",
        "casadi",
        "numbalsoda",
        "heyoka",
        "amici",
        "mujoco",
    ):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "not installed"
    return {
        "date": datetime.date.today().isoformat(),
        "python": platform.python_version(),
        "machine": _processor(),
        "versions": versions,
        "seeds": seeds,
        "limit_s": limit,
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def best_known(problem: Problem, seconds: float) -> dict[str, Any]:
    """Lowest cost of long least-squares fits: from the truth and from linid's search, by repeated least squares."""
    from linid.identification.objectives.problem import Cost
    from linid.identification.objectives.problem import Problem as FitProblem
    from linid.identification.optimise.least_squares import levenberg_marquardt
    from linid.identification.settings import Ending

    cost = judge(problem)
    lines: list[dict[str, Any]] = []
    found: list[tuple[float, np.ndarray]] = []
    starts = [problem.space.encode(truth()), problem.space.encode(problem.first)]
    begin = time.perf_counter()
    for seed in (1, 2, 3):
        lines.clear()
        with contextlib.suppress(Done):
            FITS["linid"].run(problem, None, seed, Watch(seconds, 0.0, lines.append))
        starts.append(np.array([line for line in lines if "x" in line][-1]["x"]))
        if time.perf_counter() - begin > 3.0 * seconds:
            break
    for start in starts:
        fit = FitProblem(problem.space, (PositionError(problem, Watch(1e9, 0.0), problem.substeps),))
        x = levenberg_marquardt(fit, Cost(fit), start, ending=Ending(400, 1e-8)).point
        found.append((cost(x), x))
    value, x = min(found, key=lambda pair: pair[0])
    return {"cost": value, "x": [float(g) for g in x], "from": "long least squares by linid"}


def run_process(arguments: list[str], limit: float | None) -> tuple[list[dict[str, Any]], str]:
    """Lines of one process and the end of its error output; ended when it does not end itself after `limit` s of
    processor time, for which a busy machine may need three times as long."""
    command = [sys.executable, "-m", "tests.benchmarks.peers.one", *arguments]
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    lines: list[dict[str, Any]] = []
    errors: list[str] = []
    assert process.stdout is not None and process.stderr is not None
    listener = threading.Thread(target=lambda: errors.extend(process.stderr or []), daemon=True)
    listener.start()
    timer: threading.Timer | None = None
    try:
        for text in process.stdout:
            lines.append(json.loads(text))
            if "ready" in lines[-1] and limit is not None:
                timer = threading.Timer(3.0 * limit + 2.0, process.kill)
                timer.start()
    except BaseException:
        process.kill()
        raise
    finally:
        if timer is not None:
            timer.cancel()
        process.wait()
    listener.join(5.0)
    return lines, "".join(errors)[-600:]


def one_fit(problem: Problem, name: str, seed: int, limit: float, best: float) -> dict[str, Any]:
    """One run of one peer, its improvements near the best known cost judged by the common simulation."""
    lines, errors = run_process(["fit", problem.name, name, str(seed), str(limit), repr(best * (1.0 + _STOP))], limit)
    steps = [line for line in lines if "x" in line]
    end = next((line["end"] for line in lines if "end" in line), "limit")
    ready = next((line for line in lines if "ready" in line), None)
    if ready is None or (not steps and end != "limit"):
        return {"error": errors or "ended without a word"}
    cost = judge(problem)
    for step in steps:
        if step["cost"] <= best * 1.1 or step is steps[-1]:
            step["judged"] = cost(np.array(step["x"]))
    last = max((line for line in lines if "evaluations" in line), key=lambda line: line["evaluations"], default=None)
    return {
        "steps": [{k: v for k, v in step.items() if k not in ("x", "mb")} for step in steps],
        "x": steps[-1]["x"] if steps else None,
        "evaluations": last["evaluations"] if last else 0,
        "s": last["s"] if end != "limit" and last else limit,
        "end": end,
        "peak_mb": max(line["mb"] for line in lines if "mb" in line),
        "first_simulation_s": ready["first_simulation_s"],
        "stderr": errors if not steps else "",
    }


def fits(results: Results, chosen: argparse.Namespace) -> None:
    """All runs that the file does not hold yet: seed by seed, so that an early stop leaves a fair picture."""
    for name in chosen.problems:
        if name not in results.data["best"]:
            print(f"{name}: best known cost", flush=True)
            results.put("best", name, best_known(make_problem(name), 60.0))
    for seed in range(1, chosen.seeds + 1):
        for name in chosen.problems:
            problem, best = make_problem(name), results.data["best"][name]["cost"]
            for peer, fit in FITS.items():
                key = f"{name}|{peer}|{seed}"
                slow = fit.simulator not in FAST
                most = 1 if not fit.repeats else chosen.slow_seeds if slow and chosen.slow_seeds else chosen.seeds
                if key in results.data["runs"] or seed > most or (chosen.peers and peer not in chosen.peers):
                    continue
                reason = missing(fit.needs) or fit.refuses(name)
                run = {"reason": reason} if reason else one_fit(problem, peer, seed, chosen.limit, best)
                if reason and seed > 1:
                    continue
                results.put("runs", key, run)
                if run.get("steps") and run["steps"][-1]["judged"] < results.data["best"][name]["cost"]:
                    found = {"cost": run["steps"][-1]["judged"], "x": run["x"], "from": peer}
                    results.put("best", name, found)
                print(f"{name:<9} seed {seed:<3} {peer:<55} {report.outcome(run, best * (1.0 + SHARE))}", flush=True)


def speeds(results: Results, simulators: list[str]) -> None:
    """The speed measurements that the file does not hold yet."""
    for name in simulators:
        for case in CASES:
            if f"{case}|{name}" not in results.data["speed"]:
                lines, errors = run_process(["speed", case, name], None)
                results.put("speed", f"{case}|{name}", lines[-1] if lines else {"reason": errors})
                print(f"speed     {case:<12} {name}", flush=True)
        if name not in results.data["box"]:
            lines, errors = run_process(["box", name], None)
            results.put("box", name, lines[-1] if lines else {"reason": errors})
            print(f"speed     search box   {name}", flush=True)


def main() -> None:
    """See the head of the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20, help="runs of every peer (20)")
    parser.add_argument(
        "--slow-seeds", type=int, help="runs of the peers whose simulation is slow (default: as --seeds)"
    )
    parser.add_argument("--limit", type=float, default=300.0, help="s per run, after which it has not arrived (300)")
    parser.add_argument("--problems", nargs="+", choices=NAMES, default=list(NAMES))
    parser.add_argument("--peers", nargs="+", choices=list(FITS), help="only these fits")
    parser.add_argument("--simulators", nargs="+", choices=list(SIMULATORS), help="only these speeds")
    parser.add_argument("--no-fits", action="store_true", help="speeds only")
    parser.add_argument("--no-speed", action="store_true", help="fits only")
    parser.add_argument("--json", type=Path, default=Path("benchmarks.json"), help="results (benchmarks.json)")
    parser.add_argument("--resume", action="store_true", help="go on with what the file holds")
    parser.add_argument("--report", action="store_true", help="only write the report of what the file holds")
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="folder of the report (docs)")
    chosen = parser.parse_args()
    if chosen.json.exists() and not (chosen.resume or chosen.report):
        parser.error(f"{chosen.json} exists: give --resume to go on, or another --json")
    results = Results(chosen.json, chosen.resume or chosen.report)
    if not chosen.report:
        for key, value in about(chosen.seeds, chosen.limit).items():
            results.put("about", key, value)
        if not chosen.no_speed:
            speeds(results, chosen.simulators or list(SIMULATORS))
        if not chosen.no_fits:
            fits(results, chosen)
    print(report.write(results.data, chosen.docs))


if __name__ == "__main__":
    main()
