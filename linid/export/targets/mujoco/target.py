"""The target `mujoco`."""

from __future__ import annotations

from importlib.resources import files as resources

from linid.export.target import Exported, Target
from linid.export.targets.mujoco.form import form, lacks
from linid.export.targets.mujoco.mjcf import mjcf
from linid.physics.model import Model


def files(exported: Exported) -> dict[str, bytes]:
    """axis.xml and the script that runs it along a record; raises UsageError as `form` does."""
    simple = form(exported)
    model = Model(simple.model, simple.effects)
    values = {e.name: e.value for e in simple.estimates}
    text = mjcf(model, values, exported.name, simple.axis, lacks(exported))
    script = resources("linid.export.targets.mujoco").joinpath("run_axis.py").read_bytes()
    return {"axis.xml": text.encode(), "run_axis.py": script}


TARGET = Target(
    name="mujoco",
    purpose="MuJoCo (3.7 or later): MJCF with dcmotor actuators for thrust, LuGre friction, cogging and heat.",
    files=files,
    simplified=form,
    lacks=lacks,
)
