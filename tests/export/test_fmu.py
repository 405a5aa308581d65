"""The FMUs by FMPy: valid, of sources that compile elsewhere, and running as linid does."""

from __future__ import annotations

import io
import math
import shutil
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid.export.targets.fmu import unit
from linid.export.targets.fmu.description import exponents
from linid.export.targets.fmu.target import TARGET
from linid.recording.recording import Recording
from tests.export.axis import EIGHT, OWN, OWN_VALUES, exported, simulated
from tests.export.compiler import compiled, needs_compiler
from tests.simulation.axis_with_effects import start_of_run, synchronous_run

fmpy = pytest.importorskip("fmpy", reason='needs the extra: pip install "linid[fmu]"')
pytestmark = needs_compiler

MODEL = exported((*EIGHT, OWN), values=OWN_VALUES)
PHASES = ("current_u", "current_v", "current_w")
VERSIONS = pytest.mark.parametrize("version", [2, 3])


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Paths of the units by version, with internal steps as long as those of linid at 1 kHz."""
    folder = tmp_path_factory.mktemp("units")
    model = replace(MODEL, step=1e-3 / MODEL.result.substeps)
    for name, content in TARGET.files(model).items():
        (folder / name).write_bytes(content)
    return {version: folder / f"{MODEL.name}_fmi{version}.fmu" for version in (2, 3)}


def run(path: Path, recording: Recording, order: int, **more: Any) -> np.ndarray:
    """Position (n,) in m of a unit with the recording's currents at its communication points."""
    step = float(recording.t[1] - recording.t[0])
    table = np.zeros(recording.t.size, dtype=[(name, float) for name in ("time", *PHASES)])
    table["time"] = recording.t
    assert recording.phase_currents is not None
    for name, values in zip(PHASES, recording.phase_currents, strict=True):
        table[name] = values
    start = {"start_position": start_of_run()[0], "record": float(recording.number), "elapsed": recording.elapsed}
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=float(recording.t[-1]),
        step_size=step,
        output_interval=step,
        input=table,
        start_values=start | {"input_order": float(order)},
        output=["position"],
        **more,
    )
    return np.asarray(found["position"])


@VERSIONS
def test_a_unit_is_valid_without_a_word(units: dict[int, Path], version: int) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(units[version])) == []


@VERSIONS
def test_a_unit_that_holds_its_inputs_runs_as_linid_holds_them(units: dict[int, Path], version: int) -> None:
    recording = replace(synchronous_run(), between_samples="hold")
    y = simulated(MODEL, recording)[0]
    assert np.abs(run(units[version], recording, 0) - y).max() < 1e-6  # m: what must hold


def test_going_on_along_a_line_comes_closer_to_smooth_inputs_than_holding(units: dict[int, Path]) -> None:
    y = simulated(MODEL, synchronous_run())[0]
    held, line = (np.abs(run(units[3], synchronous_run(), order) - y).max() for order in (0, 1))
    assert line < 0.5 * held


@VERSIONS
def test_every_parameter_has_unit_and_start_and_can_be_tuned(units: dict[int, Path], version: int) -> None:
    description = fmpy.read_model_description(str(units[version]))
    variables = {one.name: one for one in description.modelVariables}
    for name, value in MODEL.values.items():
        one = variables[name]
        assert (one.causality, one.variability, float(one.start)) == ("parameter", "tunable", value)
        assert one.unit and one.description
    assert [one.name for one in description.modelVariables if one.causality == "input"] == list(PHASES)
    outputs = [one.name for one in description.modelVariables if one.causality == "output"]
    assert outputs == ["position", "speed", "friction_force", "thrust"]
    archive = zipfile.ZipFile(units[version])
    assert {"sources/axis_model.c", "sources/axis_model.h", f"sources/fmi{version}.c"} <= set(archive.namelist())
    ElementTree.fromstring(archive.read("modelDescription.xml"))


def instance(path: Path, folder: Path, version: int) -> Any:
    """An instance of an unpacked unit, initialised."""
    fmpy.extract(str(path), str(folder))
    description = fmpy.read_model_description(str(path))
    unit_ = fmpy.instantiate_fmu(str(folder), description, fmi_type="CoSimulation")
    if version == 2:
        unit_.setupExperiment(startTime=0.0)
    unit_.enterInitializationMode()
    unit_.exitInitializationMode()
    return unit_, {one.name: one.valueReference for one in description.modelVariables}


@VERSIONS
def test_a_state_can_be_kept_and_taken_back(units: dict[int, Path], version: int, tmp_path: Path) -> None:
    unit_, numbers = instance(units[version], tmp_path, version)
    get = unit_.getReal if version == 2 else unit_.getFloat64
    put = unit_.setReal if version == 2 else unit_.setFloat64
    keep = unit_.getFMUstate if version == 2 else unit_.getFMUState
    back = unit_.setFMUstate if version == 2 else unit_.setFMUState

    def go(first: int, last: int) -> list[float]:
        for k in range(first, last):
            put([numbers["current_u"]], [math.sin(0.05 * k)])
            unit_.doStep(k * 1e-3, 1e-3)
        return list(get([numbers[name] for name in ("position", "speed", "friction_force")]))

    go(0, 50)
    state = keep()
    wanted = go(50, 100)
    back(state)
    assert go(50, 100) == wanted
    put([numbers["mass"]], [2.0])  # tuned while it runs
    back(state)
    assert go(50, 100) == wanted
    put([numbers["force_constant"]], [0.0])
    other = go(100, 150)
    assert other != wanted and get([numbers["thrust"]])[0] == 0.0
    unit_.terminate()
    unit_.freeInstance()


def test_ten_instances_run_at_once(units: dict[int, Path], tmp_path: Path) -> None:
    alone = run(units[3], synchronous_run(), 1)
    fmpy.extract(str(units[3]), str(tmp_path))
    description = fmpy.read_model_description(str(tmp_path))
    # FMPy changes the process' working directory while it loads a library: one instance after the other.
    instances = [fmpy.instantiate_fmu(str(tmp_path), description, fmi_type="CoSimulation") for _ in range(10)]

    def one(instance_: Any) -> np.ndarray:
        return run(tmp_path, synchronous_run(), 1, model_description=description, fmu_instance=instance_)

    with ThreadPoolExecutor(10) as threads:
        assert all(np.array_equal(found, alone) for found in threads.map(one, instances))
    for instance_ in instances:
        instance_.freeInstance()


@VERSIONS
def test_the_sources_compile_elsewhere_without_a_warning(version: int, units: dict[int, Path], tmp_path: Path) -> None:
    archive = zipfile.ZipFile(units[version])
    archive.extractall(tmp_path)
    sources = sorted((tmp_path / "sources").glob("*.c"))
    compiled(sources, tmp_path / "again.so", "-shared", "-fPIC", "-Wno-unused-parameter")
    if shutil.which("cmake") is None:
        return
    from fmpy.build import build_platform_binary

    shutil.rmtree(tmp_path / "binaries")
    build_platform_binary(tmp_path)
    name, ending = unit.platform_of(version)
    assert (tmp_path / "binaries" / name / f"axis_model{ending}").is_file()


def test_without_a_compiler_the_sources_remain(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(name: str) -> Callable[[], str] | None:
        return None

    monkeypatch.setattr(unit.shutil, "which", nothing)
    (content, _) = TARGET.files(exported()).values()
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert "sources/fmi2.c" in names and not [name for name in names if name.startswith("binaries")]


@pytest.mark.parametrize(
    ("text", "powers"),
    [("N s^2/m^2", (1, -1, 0, 0, 0)), ("N/A", (1, 1, -2, -1, 0)), ("1/A^2", (0, 0, 0, -2, 0)), ("digits", None)],
)
def test_units_are_taken_apart(text: str, powers: tuple[int, ...] | None) -> None:
    assert exponents(text) == powers
