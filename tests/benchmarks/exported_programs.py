"""How far exported programs are from linid, and how fast: python -m tests.benchmarks.exported_programs [--emps]

The stand's four modes (4 s each at 1 kHz; a square wave 3 s) with nine effects, and with --emps the EMPS recordings
(needs LINID_SHARED). Python, C, Octave and Modelica take whole recordings; the FMU goes at communication points, with
inputs held and along the line or the parabola through the last ones, at 1 kHz and at 8 kHz. Written are tables in
Markdown.
"""

from __future__ import annotations

import importlib.util
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

import linid
from linid.export.registry import find_target
from linid.export.target import Exported
from linid.physics.effects.registry import find_effect
from linid.recording.input_course import input_course
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.export.axis import EIGHT, result_of
from tests.export.compiler import CC
from tests.export.modelica_package import Package, SampledBlock
from tests.simulation.axis_with_effects import SAMPLES

MODES = ("slow_ramp_1", "sine_current_1", "square_current_1", "sine_position_1")
ROOT = Path(__file__).resolve().parents[2]
FIRST = 4.0  # s, of the EMPS recordings
RATES = (1, 8)  # kHz, of communication
SHARE = 0.2  # of the sample effects of `tests/simulation`
# Relative, of the mass. At rest the sign of a speed of 1e-19 m/s may halve a step, which makes picometres; an axis in
# open loop that loses step makes anything of these: what counts are the samples before.
MOVED = 1e-13


def amplitude(effect: str, name: str) -> bool:
    """Whether a parameter is a size of its effect."""
    return name in find_effect(effect).amplitudes


def stand() -> Iterator[tuple[Exported, Recording]]:
    """The generated stand with nine effects, and its modes."""
    known = yaml.safe_load((ROOT / "data/stand/truth.yaml").read_text(encoding="utf-8"))["parameters"]
    known |= {
        name: SHARE * size for effect in EIGHT for name, size in SAMPLES[effect].items() if amplitude(effect, name)
    }
    model = Exported(result_of(EIGHT, kind="theta", values=known, substeps=2), "stand", 1e-3 / 2)
    campaign = linid.read(ROOT / "data/stand/campaign.yaml")
    for recording in campaign.recordings:
        if recording.name in MODES:
            yield model, recording


def emps() -> Iterator[tuple[Exported, Recording]]:
    """A force model with nine effects, of about the size of EMPS, and its recordings."""
    from tests.identification.test_real_axes import emps as read

    known = {"force_constant": 35.15, "mass": 95.1, "coulomb_force": 20.0, "static_force": 22.0}
    known |= {"viscous_friction": 203.5, "bristle_stiffness": 1e6, "bristle_damping": 1e3}
    for recording in (read("DATA_EMPS"), read("DATA_EMPS_PULSES")):
        n = int(np.argmax(recording.t > recording.t[0] + FIRST))
        assert recording.drive_input is not None
        recording = replace(recording, t=recording.t[:n], y=recording.y[:n], drive_input=recording.drive_input[:n])
        step = recording.duration / (n - 1) / 2
        yield Exported(result_of(EIGHT, kind="force", values=known), "emps", step), recording


def by_linid(model: Exported, recording: Recording, moved: float = 0.0) -> tuple[np.ndarray, np.ndarray, bool]:
    """Position (n,) in m, coefficients (n - 1, 4, 4), and whether inputs step; moved: share of the mass."""
    inputs = pack_inputs([recording])
    start = np.array([[[recording.y[0], 0.0, math.nan]]])
    vector = model.vector[None, :].copy()
    vector[0, model.model.slot("mass")] *= 1.0 + moved
    y, _, _ = Simulator(model.model, inputs, 2).run(
        (1.0 + moved) * model.vector[None, :], whole_recordings(inputs), start
    )
    return y[0], inputs.coefficients, bool(inputs.steps[0])


def told(model: Exported, recording: Recording, y: np.ndarray) -> int:
    """Samples for which the model itself says where the axis is: until a mass that is off by `MOVED` makes 1 um."""
    off = np.abs(by_linid(model, recording, MOVED)[0] - y) > 1e-6
    return int(np.argmax(off)) if off.any() else y.size


def written(model: Exported, target: str, folder: Path) -> None:
    """The files of a target."""
    for name, content in find_target(target).files(model).items():
        (folder / name).write_bytes(content)


def by_python(model: Exported, recording: Recording, folder: Path, c: np.ndarray, stepping: bool) -> np.ndarray:
    """Position (n,) in m by the exported module."""
    written(model, "python", folder)
    spec = importlib.util.spec_from_file_location(model.name, folder / f"{model.name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[model.name] = module
    spec.loader.exec_module(module)
    axis = module.Axis(record=float(recording.number), elapsed=recording.elapsed, added_mass=recording.added_mass)
    start = (float(recording.y[0]), 0.0)
    return np.asarray(module.simulate(axis, recording.t, None, *start, coefficients=c, stepping=stepping).y)


def head(recording: Recording, stepping: bool) -> list[float]:
    """What the test program of C reads first."""
    dt = recording.duration / (recording.t.size - 1)
    first = [recording.t.size, dt, recording.t[0], 2, int(stepping), recording.y[0], 0.0, math.nan]
    return [*map(float, first), float(recording.number), recording.elapsed, recording.added_mass]


def by_c(model: Exported, recording: Recording, folder: Path, c: np.ndarray, stepping: bool) -> np.ndarray:
    """Position (n,) in m by the exported C."""
    written(model, "c", folder)
    sources = [f"{model.name}.c", f"{model.name}_test.c"]
    subprocess.run([str(CC), "-std=c99", "-O2", "-o", "run", *sources, "-lm"], cwd=folder, check=True)
    numbers = [f"{int(x)}" if k in (0, 3, 4) else repr(x) for k, x in enumerate(head(recording, stepping))]
    text = "\n".join([*numbers, *(float(x).hex() for x in c.ravel())])
    done = subprocess.run([str(folder / "run")], input=text, capture_output=True, text=True, check=True)
    return np.array([line.split()[0] for line in done.stdout.splitlines()], dtype=float)


def by_octave(model: Exported, recording: Recording, folder: Path, c: np.ndarray, stepping: bool) -> np.ndarray:
    """Position (n,) in m by the exported MATLAB function in Octave."""
    written(model, "matlab", folder)
    np.savetxt(folder / "c.txt", c.ravel(), fmt="%.17g")
    np.savetxt(folder / "t.txt", recording.t, fmt="%.17g")
    name, more = model.name, (recording.number, recording.elapsed, recording.added_mass)
    code = (
        f"p = {name}('parameters'); p.record = {more[0]}; p.elapsed = {more[1]!r}; p.added_mass = {more[2]!r};"
        f"r = {name}('simulate', p, load('t.txt'), [], {float(recording.y[0])!r}, 0, load('c.txt'), {int(stepping)});"
        "f = fopen('out.txt', 'w'); fprintf(f, '%.17g\\n', r.y); fclose(f);"
    )
    subprocess.run(["octave-cli", "-q", "--eval", code], cwd=folder, capture_output=True, check=False)
    return np.loadtxt(folder / "out.txt")


def by_modelica(model: Exported, recording: Recording, folder: Path, c: np.ndarray, stepping: bool) -> np.ndarray:
    """Position (n,) in m by the exported Modelica package, run from its tree."""
    written(model, "modelica", folder)
    package = Package((folder / f"{model.name}.mo").read_text(encoding="utf-8"))
    dt = recording.duration / (recording.t.size - 1)
    start = [float(recording.y[0]), 0.0, package.constants["unknown"]]
    run = [float(recording.number), recording.elapsed, recording.added_mass]
    given = (c.ravel().tolist(), float(recording.t[0]), dt, 2, start, run, stepping)
    (out,) = package["simulate"](SampledBlock(package).now["parameters"], *given)
    return np.array(out)[:, 0]


def by_fmu(model: Exported, recording: Recording, folder: Path, order: int, rate: int) -> tuple[np.ndarray, float]:
    """Position (n,) in m at the samples by the FMU that communicates at a rate in kHz, and seconds that it took."""
    import fmpy

    course = input_course(recording)
    assert course is not None
    step = 1e-3 / rate
    count = round(recording.duration / step) + 1
    times = recording.t[0] + step * np.arange(count)
    inputs = course(times)
    path = folder / f"{model.name}_fmi3.fmu"
    if not path.exists():
        written(model, "fmu", folder)
    description = fmpy.read_model_description(str(path))
    unit = fmpy.instantiate_fmu(fmpy.extract(str(path)), description, fmi_type="CoSimulation")
    number = {one.name: one.valueReference for one in description.modelVariables}
    given = [number[one.name] for one in description.modelVariables if one.causality == "input"]
    unit.enterInitializationMode(startTime=float(times[0]))
    settings = {"start_position": recording.y[0], "record": recording.number, "elapsed": recording.elapsed}
    settings |= {"added_mass": recording.added_mass, "input_order": order}
    for name, value in settings.items():
        unit.setFloat64([number[name]], [float(value)])
    unit.setFloat64(given, inputs[:, 0])
    unit.exitInitializationMode()
    out, spent = [unit.getFloat64([number["position"]])[0]], 0.0
    for k in range(count - 1):
        unit.setFloat64(given, inputs[:, k])
        began = time.perf_counter()
        unit.doStep(float(times[k]), step)
        spent += time.perf_counter() - began
        if (k + 1) % rate == 0:
            out.append(unit.getFloat64([number["position"]])[0])
    unit.terminate()
    unit.freeInstance()
    return np.array(out), spent


def row(model: Exported, recording: Recording) -> list[str]:
    """One line of the table."""
    y, c, stepping = by_linid(model, recording)
    n = told(model, recording, y)
    cells = [recording.name, f"{n / y.size * recording.duration:.2f}", f"{1e3 * np.ptp(y[:n]):.1f}"]
    factors = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for way in (by_python, by_c, by_octave, by_modelica):
            if way is by_octave and shutil.which("octave-cli") is None:
                cells.append("-")
                continue
            cells.append(f"{1e6 * np.abs(way(model, recording, folder, c, stepping)[:n] - y[:n]).max():.1g}")
        for rate in RATES:
            found = [by_fmu(model, recording, folder, order, rate) for order in (0, 1, 2)]
            cells.append(", ".join(f"{1e6 * np.abs(one[:n] - y[: one.size][:n]).max():.3g}" for one, _ in found))
            factors.append(f"{recording.duration / min(spent for _, spent in found):.0f}")
    return cells + factors


def main() -> None:
    """Print the table: largest distances in um, for as long as the model itself tells where the axis is."""
    names = ["recording", "told for, s", "stroke, mm", "Python", "C", "Octave", "Modelica"]
    names += [f"FMU at {rate} kHz: held, line, parabola" for rate in RATES]
    names += [f"times real time at {rate} kHz" for rate in RATES]
    print("| " + " | ".join(names) + " |")
    print("|---" * len(names) + "|")
    for model, recording in emps() if "--emps" in sys.argv else stand():
        print("| " + " | ".join(row(model, recording)) + " |", flush=True)


if __name__ == "__main__":
    main()
