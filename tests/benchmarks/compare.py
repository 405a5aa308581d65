"""Two commits' speed as ratios with their noise: `python -m tests.benchmarks.compare COMMIT_A COMMIT_B`.

Both are checked out into temporary git worktrees, and the benchmarks below, those of the present checkout, run on
them alternately (A, B, A, B, ...), each round in processes of its own. A ratio is the median time of B over that of
A; its 95 % interval comes from the bootstrap over rounds. --commands adds fit-friction and fit-motor end to end.

Only what all commits share is called: Simulator, pack_inputs, Model, and whole commands.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
# A difference that is smaller than this is of no interest, however surely it is there: layout of memory alone makes it.
NEGLIGIBLE = 0.02
LEAST = 8  # rounds; the bootstrap of a median of fewer is too sure of itself
_DRAWS = 4000


@dataclass(frozen=True)
class Comparison:
    """ratio: median time of B over that of A; low, high: its 95 % interval; verdict: of B against A."""

    ratio: float
    low: float
    high: float
    verdict: str


def compare(times_a: Sequence[float], times_b: Sequence[float], seed: int = 1) -> Comparison:
    """Compare the times in s of alternating rounds, (n,) each; rounds are drawn as pairs, since a busy spell of the
    machine hits neighbours alike. Raises ValueError for fewer than LEAST rounds."""
    a, b = np.asarray(times_a, dtype=float), np.asarray(times_b, dtype=float)
    if a.size != b.size or a.size < LEAST:
        raise ValueError(f"{a.size} and {b.size} rounds: at least {LEAST} of each are needed")
    rows = np.random.default_rng(seed).integers(0, a.size, (_DRAWS, a.size))
    ratios = np.median(b[rows], axis=1) / np.median(a[rows], axis=1)
    low, high = (float(q) for q in np.quantile(ratios, (0.025, 0.975)))
    verdict = "no difference to see"
    if high < 1.0 - NEGLIGIBLE:
        verdict = "faster"
    elif low > 1.0 + NEGLIGIBLE:
        verdict = "slower"
    return Comparison(float(np.median(b) / np.median(a)), low, high, verdict)


def measure() -> dict[str, float]:
    """Processor times in s of the quick benchmarks with the linid on the path; what it lacks is left out."""
    out: dict[str, float] = {}
    for kind in ("friction", "force", "sine", "theta"):
        try:
            for label, seconds in _simulation(kind).items():
                out[f"{kind}: {label}"] = seconds
        except Exception as error:  # whatever an older commit lacks
            print(f"{kind}: left out: {type(error).__name__}: {error}", file=sys.stderr)
    return out


def _simulation(kind: str) -> dict[str, float]:
    """One candidate and 16 over a generated motion of 2 s (no file, no stand: these may differ between commits)."""
    from linid.physics.model import Model
    from linid.recording.recording import Recording
    from linid.simulation.inputs import pack_inputs
    from linid.simulation.run import Simulator, whole_recordings

    t = np.arange(2000) * 1e-3
    y = 0.05 * np.sin(2.0 * np.pi * 1.5 * t)
    noise = 3e-3 * np.random.default_rng(1).standard_normal((3, t.size))
    phases = 200.0 * y + np.array([[-2.1], [0.0], [2.1]])
    currents = 0.3 * np.sin(phases) * np.cos(2.0 * np.pi * 1.5 * t) + noise
    driven = (
        {} if kind == "friction" else {"drive_input": currents[1]} if kind == "force" else {"phase_currents": currents}
    )
    recording = Recording(name="made", t=t, y=y, kind="free_wheel" if kind == "friction" else "motor", **driven)
    model = Model(kind)
    values = {
        "coulomb_force": 1.7,
        "static_force": 3.2,
        "stribeck_velocity": 3e-3,
        "stribeck_exponent": 2.0,
        "bristle_stiffness": 1.2e4,
        "bristle_damping": 90.0,
        "viscous_friction": 2.5,
        "mass": 0.6,
        "force_constant": 8.0 if kind == "theta" else 30.0,
        "electrical_wavenumber": 111.0 if kind == "theta" else 222.0,
        "winding_displacement": 1.047 if kind == "theta" else 2.094,
        "commutation_offset": 0.7,
        "winding_length": 0.69,
        "nome": 0.49,
    }
    simulator = Simulator(model, pack_inputs([recording]), 2)
    vector = model.vector(values)
    start = np.array([y[0], 0.8, 0.0])
    out = {}
    for label, count, repeats in (("one simulation", 1, 40), ("16 candidates", 16, 10)):
        params, starts = np.tile(vector, (count, 1)), np.tile(start, (count, 1, 1))
        segments = whole_recordings(simulator.inputs)
        simulator.run(params, segments, starts)
        times = []
        for _ in range(repeats):
            begin = time.process_time()
            simulator.run(params, segments, starts)
            times.append(time.process_time() - begin)
        out[label] = min(times)
    return out


def command_times(tree: Path, environment: dict[str, str]) -> dict[str, float]:
    """Wall time in s of whole commands on the present checkout's recordings; those that fail are left out."""
    stand = ROOT / "data" / "stand"
    wheels = [str(stand / f"freewheel_{k}.csv") for k in (1, 2, 4, 5)]
    masses = [f"--added-mass=freewheel_{k}.csv={m}" for k, m in ((1, 0), (2, 0), (4, 0.5), (5, 1))]
    out: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        common = ["--jobs", "1", "--no-figures", "--overwrite", "--quiet", "--out"]
        for label, arguments in (
            ("linid --help", ["--help"]),
            ("fit-friction, four free wheels", ["fit-friction", *wheels, *masses, *common, f"{folder}/friction"]),
            (
                "fit-motor theta, the stand",
                ["fit-motor", "--model=theta", str(stand / "campaign.yaml"), *common, f"{folder}/theta"],
            ),
        ):
            begin = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-m", "linid.cli.main", *arguments],
                cwd=tree,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            seconds = time.perf_counter() - begin
            if done.returncode in (0, 5):  # 5: finished without convergence
                out[label] = seconds
            else:
                print(f"{label}: left out: {done.stderr.strip()[-300:]}", file=sys.stderr)
    return out


class Checkout:
    """A commit in a worktree of its own, with a kernel cache of its own."""

    def __init__(self, commit: str, folder: Path) -> None:
        self.commit, self.tree = commit, folder / "tree"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", str(self.tree), commit], cwd=ROOT, check=True)
        self.environment = {
            **os.environ,
            "PYTHONPATH": str(self.tree),
            "LINID_CACHE_DIR": str(folder / "cache"),
            "OPENBLAS_NUM_THREADS": "1",
        }

    def round(self, commands: bool) -> dict[str, float]:
        """All benchmarks once; this file is run by its path, so that it comes from the present checkout while `linid`
        comes from the commit's."""
        done = subprocess.run(
            [sys.executable, str(Path(__file__).resolve()), "--measure", str(self.tree)],
            cwd=self.tree,
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        times: dict[str, float] = json.loads(done.stdout)
        if commands:
            times |= command_times(self.tree, self.environment)
        return times

    def remove(self) -> None:
        """Delete the worktree."""
        subprocess.run(["git", "worktree", "remove", "--force", str(self.tree)], cwd=ROOT, check=False)


def run(commits: tuple[str, str], rounds: int, commands: bool) -> dict[str, tuple[list[float], list[float]]]:
    """Times in s of both commits per benchmark that both have, alternating; a first round of each fills the caches."""
    with tempfile.TemporaryDirectory() as folder:
        checkouts: list[Checkout] = []
        try:
            for number, commit in enumerate(commits):
                place = Path(folder) / str(number)
                place.mkdir()
                checkouts.append(Checkout(commit, place))
            collected: list[list[dict[str, float]]] = [[], []]
            for k in range(rounds + 1):
                for side, checkout in enumerate(checkouts):
                    times = checkout.round(commands)
                    if k > 0:
                        collected[side].append(times)
                print(f"\rround {k} of {rounds}", end="", file=sys.stderr, flush=True)
            print(file=sys.stderr)
        finally:
            for checkout in checkouts:
                checkout.remove()
    everywhere = set.intersection(*(set(times) for side in collected for times in side))
    names = [name for name in collected[0][0] if name in everywhere]
    return {name: tuple([times[name] for times in side] for side in collected) for name in names}  # type: ignore[misc]


def table(times: dict[str, tuple[list[float], list[float]]], commits: tuple[str, str]) -> str:
    """Markdown table of all comparisons."""
    lines = [
        f"| benchmark | {commits[0]}, s | {commits[1]}, s | ratio | 95 % interval | {commits[1]} is |",
        "|---|---|---|---|---|---|",
    ]
    for name, (a, b) in times.items():
        found = compare(a, b)
        lines.append(
            f"| {name} | {np.median(a):.4g} | {np.median(b):.4g} | {found.ratio:.3f} | {found.low:.3f} to "
            f"{found.high:.3f} | {found.verdict} |"
        )
    return "\n".join(lines)


def main() -> None:
    """See the head of the file."""
    if sys.argv[1:2] == ["--measure"]:
        import linid

        tree = Path(sys.argv[2]).resolve()
        if tree not in Path(linid.__file__).resolve().parents:
            raise SystemExit(f"linid comes from {linid.__file__}, not from {tree}")
        print(json.dumps(measure()))
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit_a")
    parser.add_argument("commit_b")
    parser.add_argument("--rounds", type=int, default=15, help="alternating rounds (15)")
    parser.add_argument("--commands", action="store_true", help="fit-friction and fit-motor end to end too")
    parser.add_argument("--json", type=Path, help="also write all times to this file")
    chosen = parser.parse_args()
    if chosen.rounds < LEAST:
        parser.error(f"--rounds: at least {LEAST}")
    commits = (chosen.commit_a, chosen.commit_b)
    times = run(commits, chosen.rounds, chosen.commands)
    if chosen.json:
        chosen.json.write_text(json.dumps(times, indent=1), encoding="utf-8")
    print(table(times, commits))


if __name__ == "__main__":
    main()
