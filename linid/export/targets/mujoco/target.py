"""The target `mujoco`."""

from __future__ import annotations

from importlib.resources import files as resources

from linid.export.target import Exported, Target
from linid.export.targets.mujoco.form import form, lacks, own_waves
from linid.export.targets.mujoco.mjcf import Notes, mjcf

# What one winding cannot hold of three.
BY_VOLTAGE = (
    "The windings are one of the q-axis: the d-current and its coupling are left out.",
    "Delay and derating of the current are left out.",
)


def files(exported: Exported) -> dict[str, bytes]:
    """axis.xml, the same with windings where they are known, and the script that runs them along a record; raises
    UsageError as `form` does.
    """
    from linid.physics.model import Model

    simple = form(exported)
    values = {e.name: e.value for e in simple.estimates}
    script = resources("linid.export.targets.mujoco").joinpath("run_axis.py").read_bytes()

    def text(winding: str, lacking: tuple[str, ...]) -> bytes:
        model = Model(simple.model, simple.effects, winding)
        return mjcf(model, values, Notes(exported.name, simple.axis, lacking, own_waves(exported))).encode()

    out = {"axis.xml": text("", lacks(exported)), "run_axis.py": script}
    if simple.winding:
        out["axis_by_voltage.xml"] = text(simple.winding, (*lacks(exported), *BY_VOLTAGE))
    return out


TARGET = Target(
    name="mujoco",
    purpose="MuJoCo (3.7 or later): MJCF with dcmotor actuators for thrust, LuGre friction, cogging and heat.",
    files=files,
    simplified=form,
    lacks=lacks,
)
