"""The exported Python module against the simulation that it was translated from."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from linid.export.target import Exported
from linid.export.targets.python import TARGET
from linid.physics.laws.registry import LAWS
from tests.export.axis import EIGHT, LOOSE, LOOSE_VALUES, OWN, OWN_VALUES, PRESSED, PRESSED_VALUES, exported, simulated
from tests.simulation.axis_with_effects import NAMES, start_of_run, synchronous_run

# Both compute the same in the same order; libraries may round the last digit otherwise, which reversals carry on.
SAME = 1e-11  # m: rounding, as reversals carry it on


def module_of(model: Exported, folder: Path) -> ModuleType:
    """The exported module, imported."""
    ((name, content),) = TARGET.files(model).items()
    path = folder / name
    path.write_bytes(content)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # dataclasses look for it there
    spec.loader.exec_module(module)
    return module


def compared(model: Exported, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n,) in m of the module and of linid."""
    module, recording = module_of(model, folder), synchronous_run()
    y, _, inputs = simulated(model, recording)
    axis = module.Axis(record=float(recording.number), elapsed=recording.elapsed)
    start = start_of_run()[:2]
    found = module.simulate(axis, recording.t, recording.phase_currents, *start, coefficients=inputs.coefficients)
    return found.y, y


@pytest.mark.parametrize(
    ("effects", "law"),
    [(NAMES, "lugre"), (EIGHT, "lugre"), *(((), law) for law in LAWS)],
    ids=lambda one: str(len(one)) if isinstance(one, tuple) else one,
)
def test_the_module_runs_as_linid_does(effects: tuple[str, ...], law: str, tmp_path: Path) -> None:
    found, y = compared(exported(effects, law=law), tmp_path)
    assert np.ptp(y) > 0.05  # m: it moves
    assert np.abs(found - y).max() < SAME


@pytest.mark.parametrize(
    ("own", "values"),
    [(OWN, OWN_VALUES), (LOOSE, LOOSE_VALUES), (PRESSED, PRESSED_VALUES)],
    ids=["plain", "acceleration", "Stribeck curve"],
)
def test_own_terms_run_as_linid_does(own: str, values: dict[str, float], tmp_path: Path) -> None:
    with_own, plain = exported((own, "cogging"), values=values), exported(("cogging",))
    found, y = compared(with_own, tmp_path)
    assert np.abs(found - y).max() < SAME
    assert np.abs(y - simulated(plain, synchronous_run())[0]).max() > 1e-4  # m: they matter


@pytest.mark.parametrize("nome", [0.5, 0.95])
def test_the_theta_model_runs_as_linid_does(nome: float, tmp_path: Path) -> None:
    values = {"winding_length": 0.7, "nome": nome, "electrical_wavenumber": 100.0, "winding_displacement": 1.047}
    values |= {"commutation_offset": 0.15, "force_constant": 10.0}
    found, y = compared(exported(("cogging",), kind="theta", values=values), tmp_path)
    assert np.abs(found - y).max() < SAME


def test_its_own_splines_are_those_of_linid(tmp_path: Path) -> None:
    model = exported()
    module, recording = module_of(model, tmp_path), synchronous_run()
    inputs = simulated(model, recording)[2]
    found = module.spline(recording.t, recording.phase_currents)
    assert np.allclose(found[:, :3], inputs.coefficients[:, :3], rtol=1e-7, atol=1e-7)


def test_friction_and_thrust_balance_the_acceleration(tmp_path: Path) -> None:
    module, recording = module_of(exported(substeps=8), tmp_path), synchronous_run()
    axis = module.Axis()
    run = module.simulate(axis, recording.t, recording.phase_currents, *start_of_run()[:2])
    sliding = np.abs(run.v) > 0.05  # m/s, where the acceleration is smooth from sample to sample
    acceleration = np.gradient(run.v, recording.t)
    missing = run.thrust - run.friction - axis.mass * acceleration
    assert np.sqrt(np.mean(missing[sliding] ** 2)) < 0.01 * np.sqrt(np.mean((run.thrust**2)[sliding]))


def test_it_needs_numpy_alone_and_names_unknown_parameters(tmp_path: Path) -> None:
    ((name, content),) = TARGET.files(exported(EIGHT)).items()
    (tmp_path / name).write_bytes(content)
    code = (
        "import sys, axis_model, numpy as np; t = np.arange(101) / 1e3;"
        "run = axis_model.simulate(axis_model.Axis(mass=2.0), t, np.zeros((3, 101)), 0.0, 0.3);"
        "print(run.v[-1] < 0.3, sorted(m for m in ('numba', 'scipy', 'linid') if m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.strip() == "True []", done.stderr
    with pytest.raises(TypeError, match="no parameter colour"):
        module_of(exported(), tmp_path).Axis(colour=1.0)
