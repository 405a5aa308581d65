"""URDF: one joint with damping and friction."""

from __future__ import annotations

from linid.export.joint import joint_of, lacks_of_joint, model_of_joint, urdf
from linid.export.target import Exported, Target
from linid.identification.result import FitResult

NAME = "urdf"


def lacks(exported: Exported) -> tuple[str, ...]:
    """What URDF cannot hold of a model, a sentence each."""
    return lacks_of_joint(exported, breakaway=False)


def files(exported: Exported) -> dict[str, bytes]:
    """axis.urdf; raises UsageError for a model without mass."""
    joint = joint_of(exported, NAME, breakaway=False)
    return {"axis.urdf": urdf(exported, joint, lacks(exported)).encode()}


def simplified(exported: Exported) -> FitResult:
    """The model that axis.urdf equals; raises UsageError for a model without mass."""
    return model_of_joint(exported, joint_of(exported, NAME, breakaway=False))


TARGET = Target(
    name=NAME,
    purpose="URDF, which most robot simulators read: one joint with mass, Coulomb friction and damping.",
    files=files,
    simplified=simplified,
    lacks=lacks,
)
