"""The exported C against the simulation that it was translated from: whole recordings, and step by step."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linid.export.target import Exported
from linid.export.targets.c.target import TARGET
from linid.recording.recording import Recording
from tests.export.axis import EIGHT, LOOSE, LOOSE_VALUES, OWN, OWN_VALUES, PRESSED, PRESSED_VALUES, exported, simulated
from tests.export.compiler import compiled, needs_compiler
from tests.simulation.axis_with_effects import NAMES, start_of_run, synchronous_run

pytestmark = needs_compiler
SAME = 1e-11  # m: rounding, as reversals carry it on


def sources(model: Exported, folder: Path) -> list[Path]:
    """The written files."""
    files = TARGET.files(model)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in files if name.endswith(".c")]


def run(program: Path, model: Exported, recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outputs (n, 4) of the test program, and reading and speed (n,) of linid."""
    y, v, inputs = simulated(model, recording)
    start = (*start_of_run()[:2], float("nan"))
    head = [recording.t.size, inputs.dts[0], recording.t[0], model.result.substeps, int(inputs.steps[0]), *start]
    head += [float(recording.number), recording.elapsed, 0.0]
    text = "\n".join([*map(str, head), *(float(x).hex() for x in inputs.coefficients.ravel())])
    done = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True)
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=float), y, v


@pytest.mark.parametrize(
    ("effects", "more"),
    [
        ((), {}),
        (NAMES, {}),
        ((*EIGHT, OWN), {"values": OWN_VALUES}),
        ((LOOSE,), {"values": LOOSE_VALUES}),
        ((PRESSED,), {"values": PRESSED_VALUES}),
        ((), {"law": "maxwell_slip"}),
        ((), {"law": "elasto_plastic"}),
    ],
    ids=[
        "bare",
        "all effects",
        "nine effects and an own term",
        "of acceleration",
        "of the Stribeck curve",
        "maxwell slip",
        "elasto-plastic",
    ],
)
def test_a_recording_runs_as_linid_runs_it(effects: tuple[str, ...], more: dict[str, object], tmp_path: Path) -> None:
    model = exported(effects, **more)
    program = compiled(sources(model, tmp_path), tmp_path / "program")
    found, y, v = run(program, model, synchronous_run())
    assert np.ptp(y) > 0.05  # m: it moves
    assert np.abs(found[:, 0] - y).max() < SAME and np.abs(found[:, 1] - v).max() < 1e3 * SAME


STEPS = """
#include "axis_model.h"
#include <stdio.h>
#include <stdlib.h>
int main(int count, char **words)
{
    axis_model_model m;
    double u[3], out[4], h;
    int first = 1;
    (void)count;
    axis_model_defaults(&m);
    m.s[S_record] = 5.0;
    m.s[S_elapsed] = 4.0;
    m.order = atoi(words[1]);
    h = atof(words[2]);
    while (scanf("%lf %lf %lf", u, u + 1, u + 2) == 3) {
        if (first)
            axis_model_begin(&m, 0.0, atof(words[3]), 0.0, u);
        first = 0;
        axis_model_outputs(&m, out);
        printf("%.17g\\n", out[0]);
        axis_model_step(&m, u, h);
    }
    return 0;
}
"""


def test_steps_that_hold_their_inputs_run_as_linid_holds_them(tmp_path: Path) -> None:
    recording = replace(synchronous_run(), between_samples="hold")
    step = float(recording.t[1] - recording.t[0])
    model = exported((*EIGHT, "input_delay"))
    model = replace(model, step=step / model.result.substeps)
    y = simulated(model, recording)[0]
    (tmp_path / "steps.c").write_text(STEPS, encoding="utf-8")
    source = next(path for path in sources(model, tmp_path) if not path.stem.endswith("test"))
    program = compiled([source, tmp_path / "steps.c"], tmp_path / "steps")
    assert recording.phase_currents is not None
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in recording.phase_currents.T)
    arguments = ["0", repr(step), repr(start_of_run()[0])]
    done = subprocess.run([str(program), *arguments], input=text, capture_output=True, text=True, check=True)
    found = np.array(done.stdout.split(), dtype=float)
    assert np.abs(found - y).max() < 1e3 * SAME  # instants are added up, which rounds them
