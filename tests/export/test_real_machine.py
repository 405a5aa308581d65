"""A measured machine, two motors on a flexible shaft: identified, exported and run as linid runs it."""

from __future__ import annotations

import math
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linid.api import read
from linid.export.target import Exported
from linid.export.targets.c.target import TARGET as C
from linid.export.targets.fmu.target import TARGET as FMU
from linid.identification.fit import fit
from linid.identification.settings import FitSettings, SearchSettings
from linid.recording.recording import Recording
from linid.simulation.inputs import Inputs, pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.export.compiler import compiled, needs_compiler
from tests.export.test_python import module_of
from tests.identification.test_start_states import cut
from tests.shared_data import shared

SECONDS = 1.0  # of the held-out recording
NEAR = 1e-6  # rad: what must hold
Run = tuple[Recording, np.ndarray, Inputs]


@pytest.fixture(scope="module")
def machine() -> tuple[Exported, Recording]:
    """The model, fitted to half a second, and a held-out second."""
    fitted, held = read(shared("real", "two_mass", "file_a.yaml"))
    settings = FitSettings(search=SearchSettings(generations=2))
    result = fit("force", [cut(fitted, 0.5)], settings=settings, effects=("flexible_load",), known={"mass": 1.0})
    held = cut(held, SECONDS)
    return Exported(result, "two_mass", held.period / result.substeps, recordings=(held,)), held


def by_linid(machine: tuple[Exported, Recording], between: str = "spline") -> Run:
    """The held-out second as linid simulates it: the recording, position (n,) in rad, and its inputs."""
    model, held = machine
    recording = replace(held, between_samples=between) if between == "hold" else held
    inputs = pack_inputs([recording])
    start = np.array([[[held.y[0], 0.0, math.nan]]])
    y, _, _ = Simulator(model.model, inputs, model.result.substeps).run(
        model.vector[None, :], whole_recordings(inputs), start
    )
    assert np.ptp(y[0]) > 1e-2  # rad: it moves
    return recording, y[0], inputs


def test_the_module_runs_it_as_linid_does(machine: tuple[Exported, Recording], tmp_path: Path) -> None:
    recording, y, inputs = by_linid(machine)
    module = module_of(machine[0], tmp_path)
    axis = module.Axis(record=float(recording.number), elapsed=recording.elapsed)
    assert recording.drive_input is not None
    found = module.simulate(
        axis, recording.t, recording.drive_input[None, :], y[0], 0.0, coefficients=inputs.coefficients
    )
    assert np.abs(found.y - y).max() < NEAR


@needs_compiler
def test_the_c_program_runs_it_as_linid_does(machine: tuple[Exported, Recording], tmp_path: Path) -> None:
    recording, y, inputs = by_linid(machine)
    files = C.files(machine[0])
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    program = compiled([tmp_path / name for name in files if name.endswith(".c")], tmp_path / "program")
    head = [recording.t.size, inputs.dts[0], recording.t[0], machine[0].result.substeps, int(inputs.steps[0])]
    head += [y[0], 0.0, math.nan, float(recording.number), recording.elapsed, 0.0]
    text = "\n".join([*map(str, head), *(float(x).hex() for x in inputs.coefficients.ravel())])
    done = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True)
    found = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    assert np.abs(found[:, 0] - y).max() < NEAR


@needs_compiler
def test_the_unit_runs_it_as_linid_holds_its_input(machine: tuple[Exported, Recording], tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy", reason='needs the extra: pip install "linid[fmu]"')
    recording, y, _ = by_linid(machine, "hold")
    for name, content in FMU.files(machine[0]).items():
        (tmp_path / name).write_bytes(content)
    unit = tmp_path / "two_mass_fmi3.fmu"
    (name,) = (one.name for one in fmpy.read_model_description(str(unit)).modelVariables if one.causality == "input")
    table = np.zeros(recording.t.size, dtype=[("time", float), (name, float)])
    table["time"], table[name] = recording.period * np.arange(recording.t.size), recording.drive_input
    found = fmpy.simulate_fmu(
        str(unit),
        stop_time=float(table["time"][-1]),
        step_size=recording.period,
        output_interval=recording.period,
        input=table,
        start_values={"start_position": y[0], "record": float(recording.number), "input_order": 0.0},
        output=["position"],
    )
    assert np.abs(found["position"] - y).max() < NEAR
