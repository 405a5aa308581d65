"""Speed, as ratios within one run: `python -m tests.benchmarks [--json FILE] [--quick]`.

Nothing here passes or fails. Run it on an otherwise idle machine; every time is the least of several repeats.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from linid.identification.optimise.time_step import choose_substeps
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.identification.stand import stand

ROOT = Path(__file__).parents[2]


def least(function: Callable[[], object], repeats: int) -> float:
    """Least wall time in s of several calls."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return min(times)


def exact_recording(name: str) -> Recording:
    campaign = stand()
    recording = next(r for r in campaign.recordings if r.name == name)
    return replace(recording, phase_currents=campaign.exact[name].currents.copy())


def as_sine(theta: dict[str, float]) -> dict[str, float]:
    """The sine motor of the same fundamental."""
    from linid.physics.motors.theta import fundamental_force_constant

    out = {
        **theta,
        "force_constant": fundamental_force_constant(theta["force_constant"], theta["winding_length"], theta["nome"]),
    }
    for name in ("electrical_wavenumber", "winding_displacement", "commutation_offset"):
        out[name] = 2.0 * theta[name]
    return out


def simulation_times(repeats: int) -> dict[str, float]:
    """ns per internal step, theta against sine, two threads against one."""
    recording = exact_recording("sine_position_1")
    values = stand().truth
    out: dict[str, float] = {}
    for kind, parameters in (("theta", values), ("sine", as_sine(values))):
        model = Model(kind)
        simulator = Simulator(model, pack_inputs([recording]), choose_substeps(model, [recording], parameters))
        vectors = np.repeat(model.vector(parameters)[None, :], 16, axis=0)
        starts = np.tile([recording.y[0], 0.0, math.nan], (16, 1, 1))
        segments = whole_recordings(simulator.inputs)
        steps = simulator.run(vectors, segments, starts)[2]
        seconds = least(lambda s=simulator, v=vectors, b=starts, g=segments: s.run(v, g, b), repeats)
        out[f"{kind}: ms per 4 s simulation"] = seconds / 16 * 1e3
        out[f"{kind}: ns per internal step"] = seconds / steps * 1e9
        if kind == "theta":
            two = replace(simulator, jobs=2)
            both = least(lambda s=two, v=vectors, b=starts, g=segments: s.run(v, g, b), repeats)
            out["two threads: times one thread's speed"] = seconds / both
    out["theta / sine"] = out["theta: ms per 4 s simulation"] / out["sine: ms per 4 s simulation"]
    return out


def command(arguments: list[str]) -> dict[str, float]:
    """Wall time and peak memory of one command in its own process."""
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "linid.cli.main", *arguments], capture_output=True, check=False)
    seconds = time.perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    return {"s": seconds, "peak MB of the largest so far": peak, "exit code": float(done.returncode)}


def commands() -> dict[str, dict[str, float]]:
    """Whole commands, process start to files, without figures; the second run of each (warm cache)."""
    campaign = str(ROOT / "data" / "stand" / "campaign.yaml")
    wheels = [str(ROOT / "data" / "stand" / f"freewheel_{k}.csv") for k in range(1, 7)]
    masses = [f"--added-mass=freewheel_{k}.csv={m}" for k, m in zip(range(1, 7), (0, 0, 0.5, 0.5, 1, 1), strict=True)]
    out = {"linid --help": command(["--help"])}
    with tempfile.TemporaryDirectory() as folder:
        common = ["--jobs", "2", "--no-figures", "--overwrite", "--quiet", "--out"]
        for label, arguments in (
            ("fit-friction, six 1.5 s free wheels", ["fit-friction", *wheels, *masses, *common, f"{folder}/friction"]),
            ("fit-motor theta, one campaign", ["fit-motor", "--model=theta", campaign, *common, f"{folder}/theta"]),
        ):
            command(arguments)
            out[label] = command(arguments)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    parser.add_argument("--quick", action="store_true", help="fewer repeats, no whole commands")
    options = parser.parse_args()
    repeats = 2 if options.quick else 7
    figures: dict[str, object] = {"simulation": simulation_times(repeats)}
    if not options.quick:
        figures |= {"commands": commands()}
    for title, rows in figures.items():
        print(title)
        for name, value in rows.items():  # type: ignore[attr-defined]
            text = ", ".join(f"{k} {v:.4g}" for k, v in value.items()) if isinstance(value, dict) else f"{value:.4g}"
            print(f"  {name:<45} {text}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
