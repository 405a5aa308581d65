"""Seconds and memory against the size of the task: `python -m tests.benchmarks.growth --out FOLDER [--resume]`.

Every point runs in a process of its own on one thread; its time is processor time, which a busy machine hardly changes.
Writes growth.json, growth.png and growth.md (the table). All points together take about 20 minutes.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from linid.identification.guess.first_values import guess_effects
from linid.identification.objectives.choose import make_parts
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.settings import FitSettings
from linid.identification.space.bounds import build_space
from linid.physics.model import Model
from linid.recording import Recording, read_recording
from linid.recording.recording import in_order
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.benchmarks.growth_report import Point, write_report

Array = NDArray[np.float64]

# SI values of the axis whose motion is recorded.
TRUTH = {
    "force_constant": 30.0,
    "coulomb_force": 12.0,
    "static_force": 16.0,
    "stribeck_velocity": 0.01,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 4e5,
    "bristle_damping": 900.0,
    "viscous_friction": 25.0,
    "mass": 5.0,
}
FIXED = {"force_constant": TRUTH["force_constant"]}
PERIOD = 1e-3  # s
NOISE = 1e-6  # m
PIECE = 1000  # samples of each of many recordings
EFFECTS = (
    "constant_force",
    "asymmetric_friction",
    "quadratic_drag",
    "friction_drift",
    "dwell_stiction",
    "cable_force",
    "encoder_periodic_error",
    "position_dependent_friction",
)
HALF_DECADES = tuple(round(k * 10.0**n) for n in range(3, 8) for k in (1, 3))[:-1]
SIZES = {
    "read": HALF_DECADES,
    "evaluate": HALF_DECADES,
    "fit": HALF_DECADES[:7],
    "recordings": (1, 3, 10, 30, 100, 300, 1000),
    "population": (10, 30, 100, 300, 1000, 3000, 10000, 30000, 100000),
    "effects": tuple(range(len(EFFECTS) + 1)),
    "parameters": (2, 4, 9, 18, 36),
}
QUICK = {
    "read": (1000, 3000),
    "evaluate": (1000, 3000),
    "fit": (),
    "recordings": (1, 3),
    "population": (10, 30),
    "effects": (0, 1),
    "parameters": (2, 4),
}
_REPEATED = 0.3  # s, below which a time is the least of five


def make_recording(samples: int) -> Recording:
    """The axis driven by four sines of its q-current, at 1 kHz, with the encoder's noise."""
    t = PERIOD * np.arange(samples)
    current = sum(a * np.sin(2.0 * np.pi * f * t + f) for a, f in ((0.6, 0.31), (0.5, 0.73), (0.4, 1.9), (0.3, 4.3)))
    still = Recording("run", t, np.zeros(samples), drive_input=np.asarray(current))
    model = Model("force")
    simulator = Simulator(model, pack_inputs([still]))
    start = np.array([[[0.0, 0.0, np.nan]]])
    y = simulator.run(model.vector(TRUTH)[None, :], whole_recordings(simulator.inputs), start)[0][0]
    noise = NOISE * np.random.default_rng(1).standard_normal(samples)
    return replace(still, y=y + noise)


def write_data(samples: int, folder: Path) -> None:
    """run.csv: time, position, current and three spare columns; run.npz: the same without them."""
    import pandas as pd

    r = make_recording(samples)
    assert r.drive_input is not None
    np.savez(folder / "run.npz", t=r.t, y=r.y, current=r.drive_input)
    with (folder / "run.csv").open("w", encoding="utf-8") as file:
        file.write("Time (ms),Position (mm),Iq (A),Spare 1 (V),Spare 2 (V),Spare 3 (V)\n")
        for a in range(0, samples, 100_000):
            part = slice(a, a + 100_000)
            columns = [1e3 * r.t[part], 1e3 * r.y[part], r.drive_input[part]]
            table = np.column_stack([*columns, *(3 * [np.round(r.drive_input[part], 3)])])
            pd.DataFrame(table).to_csv(file, header=False, index=False, float_format="%.6f")


def load_data(folder: Path) -> Recording:
    """The recording of run.npz."""
    with np.load(folder / "run.npz") as data:
        return Recording("run", data["t"], data["y"], drive_input=data["current"])


def cut(recording: Recording, count: int) -> list[Recording]:
    """The first `count` pieces of a recording as recordings of their own, each from time 0."""
    assert recording.drive_input is not None
    out = []
    for k in range(count):
        part = slice(k * PIECE, (k + 1) * PIECE)
        out.append(
            replace(
                recording,
                name=f"run_{k + 1}",
                t=recording.t[:PIECE].copy(),
                y=recording.y[part].copy(),
                drive_input=recording.drive_input[part].copy(),
            )
        )
    return list(in_order(out))


def make_problem(recordings: list[Recording], effects: tuple[str, ...] = ()) -> tuple[Problem, Array]:
    """The problem of `linid fit-friction` with all windows, and search coordinates (p,) to begin with."""
    settings = FitSettings()
    model = Model("force", effects)
    first, fixed = TRUTH, FIXED
    if effects:
        (first, *_), preset = guess_effects(model, recordings, TRUTH, FIXED, (), settings)
        fixed = {**preset, **FIXED}
    space = build_space(model, recordings, first, fixed, {}, False)
    return Problem(space, make_parts(model, recordings, settings, 2)), space.encode(first)


def processor_seconds(function: Callable[[], object]) -> float:
    """Processor time of a call in s: of the only one, or the least of five short ones."""
    times: list[float] = []
    while not times or (times[0] < _REPEATED and len(times) < 5):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times)


def jacobian_seconds(problem: Problem, cost: Cost, point: Array) -> float:
    """Processor time in s of a Jacobian, by a linearisation that has told nothing yet: what it has told it keeps."""
    line = Linearisation(problem, cost)
    line.reweight(point)
    return processor_seconds(lambda: Linearisation(problem, cost, weights=line.weights).tangent(point).rotated)


def ready_cost(problem: Problem, point: Array) -> Cost:
    """The problem's cost, with what its first evaluation prepares for all others."""
    cost = Cost(problem)
    cost(point)
    return cost


def candidates(problem: Problem, count: int) -> Array:
    """Random search coordinates (count, p)."""
    return np.random.default_rng(2).random((count, len(problem.space.parameters)))


def read_point(size: int, folder: Path) -> dict[str, float]:
    return {"read": processor_seconds(lambda: read_recording(folder / "run.csv"))}


def evaluate_point(size: int, folder: Path) -> dict[str, float]:
    recording = load_data(folder)
    problem, point = make_problem([recording])
    cost = ready_cost(problem, point)
    population = candidates(problem, 8)
    return {"one candidate": processor_seconds(lambda: cost(population)) / len(population)}


def fit_point(size: int, folder: Path) -> dict[str, float]:
    from linid.cli.main import cli

    with tempfile.TemporaryDirectory() as out, redirect_stdout(io.StringIO()):
        options = ["--known", f"force_constant={FIXED['force_constant']}", "--no-figures", "--quiet", "--overwrite"]
        cli(["fit-friction", str(folder / "run.csv"), *options, "--out", out], standalone_mode=False)
    return {"linid fit-friction": time.process_time()}  # since the process began


def recordings_point(size: int, folder: Path) -> dict[str, float]:
    paths = [folder / f"run_{k + 1}.csv" for k in range(size)]
    reading = processor_seconds(lambda: [read_recording(path) for path in paths])
    problem, point = make_problem(list(in_order([read_recording(path) for path in paths])))
    cost = ready_cost(problem, point)
    return {"read": reading, "one candidate": processor_seconds(lambda: cost(point))}


def population_point(size: int, folder: Path) -> dict[str, float]:
    problem, point = make_problem([load_data(folder)])
    cost, population = ready_cost(problem, point), candidates(problem, size)
    return {"population": processor_seconds(lambda: cost(population))}


def effects_point(size: int, folder: Path) -> dict[str, float]:
    problem, point = make_problem([load_data(folder)], EFFECTS[:size])
    cost = ready_cost(problem, point)
    return {
        "parameters": float(len(point)),
        "one candidate": processor_seconds(lambda: cost(point)),
        "Jacobian": jacobian_seconds(problem, cost, point),
    }


def parameters_point(size: int, folder: Path) -> dict[str, float]:
    """All effects act, the first `size` parameters are searched and the others held."""
    problem, point = make_problem([load_data(folder)], EFFECTS)
    space = problem.space
    values = dict(zip(space.names, space.vectors(point)[0][[space.model.slot(n) for n in space.names]], strict=True))
    few = space.holding({name: values[name] for name in space.names[size:]})
    problem = replace(problem, space=few)
    return {"Jacobian": jacobian_seconds(problem, Cost(problem), few.encode(values))}


POINTS: dict[str, Callable[[int, Path], dict[str, float]]] = {
    "read": read_point,
    "evaluate": evaluate_point,
    "fit": fit_point,
    "recordings": recordings_point,
    "population": population_point,
    "effects": effects_point,
    "parameters": parameters_point,
}
_LENGTHS = {"population": PIECE, "effects": 10 * PIECE, "parameters": 10 * PIECE}  # samples, where they do not vary


def warm_up(series: str, folder: Path) -> None:
    """Load what a series loads on first use, so that it counts for no point."""
    read_recording(folder / "run.csv")
    if series == "read":
        return
    problem, point = make_problem([load_data(folder)])
    assert Linearisation(problem, Cost(problem)).tangent(point).rotated


def peak_mb() -> float:
    """Largest resident memory of this process so far, in MB."""
    status = Path("/proc/self/status")
    if status.exists():  # what `getrusage` tells begins with the parent's
        return float(re.findall(r"VmHWM:\s+(\d+) kB", status.read_text())[0]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measure(series: str, size: int, folder: Path, small: Path) -> Point:
    """One point, in this process."""
    if series != "fit":
        warm_up(series, small)
    base = peak_mb()
    seconds = POINTS[series](size, folder)
    return Point(series, size, seconds, peak_mb(), base)


class Data:
    """Recordings of all lengths in a temporary folder, each made when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def of(self, series: str, size: int) -> Path:
        """The folder that a point reads."""
        if series == "recordings":
            return self._many(max(SIZES["recordings"]) if size > 3 else 3)
        return self.length(_LENGTHS.get(series, size))

    def length(self, samples: int) -> Path:
        """The folder with run.csv and run.npz of so many samples."""
        path = self.folder / str(samples)
        if not path.is_dir():
            path.mkdir()
            _run("--write", str(samples), str(path))
        return path

    def _many(self, count: int) -> Path:
        path = self.folder / f"pieces_{count}"
        if not path.is_dir():
            path.mkdir()
            header, *rows = (self.length(count * PIECE) / "run.csv").read_text(encoding="utf-8").splitlines()
            for k in range(count):
                text = "\n".join([header, *rows[k * PIECE : (k + 1) * PIECE]])
                (path / f"run_{k + 1}.csv").write_text(text + "\n", encoding="utf-8")
        return path


def _run(*arguments: str) -> str:
    """This module in a process of its own, on one thread."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "tests.benchmarks.growth", *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout


def grow(out: Path, sizes: dict[str, tuple[int, ...]], *, resume: bool = False) -> list[Point]:
    """Measure all points, write growth.json after each one and the report at the end.

    resume: points in growth.json are not measured again.
    """
    out.mkdir(parents=True, exist_ok=True)
    file = out / "growth.json"
    points = [Point(**row) for row in json.loads(file.read_text(encoding="utf-8"))] if resume and file.exists() else []
    done = {(point.series, point.size) for point in points}
    with tempfile.TemporaryDirectory() as folder:
        data = Data(Path(folder))
        small = data.length(PIECE)
        for series, size in sorted(((s, n) for s, row in sizes.items() for n in row), key=lambda point: point[1]):
            if (series, size) in done:
                continue
            found = _run("--point", series, str(size), str(data.of(series, size)), str(small))
            points.append(Point(**json.loads(found)))
            print(points[-1].text, flush=True)
            file.write_text(json.dumps([point.stored() for point in points], indent=1), encoding="utf-8")
    write_report(points, out)
    return points


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for the results")
    parser.add_argument("--quick", action="store_true", help="two small sizes of each series, no fit")
    parser.add_argument("--resume", action="store_true", help="skip the points that growth.json holds")
    parser.add_argument("--point", nargs=4, help=argparse.SUPPRESS)
    parser.add_argument("--write", nargs=2, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.write:
        write_data(int(chosen.write[0]), Path(chosen.write[1]))
    elif chosen.point:
        series, size, folder, small = chosen.point
        print(json.dumps(measure(series, int(size), Path(folder), Path(small)).stored()))
    elif chosen.out is None:
        parser.error("--out is missing: name the folder for the results")
    else:
        grow(chosen.out, QUICK if chosen.quick else SIZES, resume=chosen.resume)


if __name__ == "__main__":
    main()
