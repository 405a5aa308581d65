"""The exported MATLAB function, run by Octave, against the simulation that it was translated from."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linid.export.target import Exported
from linid.export.targets.matlab import TARGET
from tests.export.axis import EIGHT, OWN, OWN_VALUES, exported, simulated
from tests.simulation.axis_with_effects import start_of_run, synchronous_run

OCTAVE = shutil.which("octave-cli")
SAME = 1e-12  # m: rounding, as reversals carry it on
PLACE = repr(float(start_of_run()[0]))


def octave(model: Exported, folder: Path, code: str) -> np.ndarray:
    """What Octave code writes into `out`, with the model's files, times and currents in `t` and `u` beside it."""
    for name, content in TARGET.files(model).items():
        (folder / name).write_bytes(content)
    code = f"x = load('in.txt'); t = x(1, :); u = x(2:end, :); p = axis_model('parameters'); {code}"
    code += "; f = fopen('out.txt', 'w'); fprintf(f, '%.17g\\n', out); fclose(f);"
    done = subprocess.run([str(OCTAVE), "-q", "--eval", code], cwd=folder, capture_output=True, text=True)
    assert (folder / "out.txt").is_file(), done.stderr
    return np.loadtxt(folder / "out.txt")


@pytest.mark.skipif(OCTAVE is None, reason="no Octave here")
@pytest.mark.parametrize("effects", [(), (*EIGHT, "input_delay", OWN)], ids=["bare", "ten effects and an own term"])
def test_a_recording_runs_as_linid_runs_it(effects: tuple[str, ...], tmp_path: Path) -> None:
    model = exported(effects, values=OWN_VALUES if effects else None)
    recording = synchronous_run(0.4)
    y = simulated(model, recording)[0]
    np.savetxt(tmp_path / "in.txt", np.vstack([recording.t, recording.phase_currents]), fmt="%.17g")
    code = f"p.record = 5; p.elapsed = 4; r = axis_model('simulate', p, t, u, {PLACE}, 0); out = r.y"
    assert np.abs(octave(model, tmp_path, code) - y).max() < SAME


@pytest.mark.skipif(OCTAVE is None, reason="no Octave here")
def test_steps_that_hold_their_inputs_run_as_linid_holds_them(tmp_path: Path) -> None:
    recording = replace(synchronous_run(0.2), between_samples="hold")
    model = exported(EIGHT)
    model = replace(model, step=float(recording.t[1]) / model.result.substeps)
    y = simulated(model, recording)[0]
    np.savetxt(tmp_path / "in.txt", np.vstack([recording.t, recording.phase_currents]), fmt="%.17g")
    code = (
        f"p.record = 5; p.elapsed = 4; s = axis_model('start', p, u(:, 1), {PLACE}, 0); out = zeros(1, numel(t) - 1);"
        "for k = 1:(numel(t) - 1), [s, o] = axis_model('step', s, u(:, k), t(2) - t(1)); out(k) = o(1); end"
    )
    assert np.abs(octave(model, tmp_path, code) - y[1:]).max() < 1e3 * SAME  # instants are added up


def test_every_parameter_stands_in_the_structure_with_its_unit() -> None:
    model = exported((*EIGHT, OWN), values=OWN_VALUES)
    text = TARGET.files(model)["axis_model_parameters.m"].decode()
    for parameter in model.model.parameters:
        assert f"p.{parameter.name} = {model.values[parameter.name]!r}; % {parameter.unit}: " in text
