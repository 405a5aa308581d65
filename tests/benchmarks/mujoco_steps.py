"""How far MuJoCo's runs of an exported axis are from linid's, by integrator and step: python -m
tests.benchmarks.mujoco_steps

The axis has seven effects (cogging, constant force, cable with hysteresis, drag, delay, swinging load, gravity's wave)
and reverses six times in 2 s; written is a table in Markdown.
"""

from __future__ import annotations

import math
import re
import sys

import numpy as np

from linid.export.targets.mujoco import TARGET
from linid.export.targets.mujoco.run_axis import run
from tests.export.axes import HELD, axis, exported, made

INTEGRATORS = ("Euler", "RK4", "implicitfast")
STEPS = (4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5)  # s


def at_step(text: str, integrator: str, step: float) -> str:
    """The file with another integrator and step, and room for the delay at that step."""
    delay = float(re.search(r' delay="([^"]*)"', text)[1])  # type: ignore[index]
    text = re.sub(r'timestep="[^"]*" integrator="[^"]*"', f'timestep="{step}" integrator="{integrator}"', text)
    return re.sub(r'nsample="\d+"', f'nsample="{math.ceil(delay / step) + 2}"', text)


def main() -> None:
    """Print the table: the largest distance in um, of a stroke that stands above it."""
    import mujoco

    model = axis({name: values for name, values in HELD.items() if name != "thermal_derating"})
    (recording,) = made(model, 1.3)
    text = TARGET.files(exported(model, recording))["axis.xml"].decode()
    lines = [f"MuJoCo {mujoco.__version__}, stroke {1e3 * np.ptp(recording.y):.0f} mm, largest distance in um", ""]
    lines += ["| step, us | " + " | ".join(INTEGRATORS) + " |", "|---" * (1 + len(INTEGRATORS)) + "|"]
    for step in STEPS:
        row = []
        for integrator in INTEGRATORS:
            simple = mujoco.MjModel.from_xml_string(at_step(text, integrator, step))
            y, _ = run(simple, recording.t, [recording.drive_input])
            row.append(f"{1e6 * np.max(np.abs(y - recording.y)):.3g}")
        lines.append(f"| {1e6 * step:g} | " + " | ".join(row) + " |")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
