"""Isaac Lab: the joint as URDF, its friction as an actuator configuration."""

from __future__ import annotations

from linid.export.joint import Joint, comment_lines, joint_of, lacks_of_joint, model_of_joint, thrust_unit, urdf
from linid.export.simpler import number
from linid.export.target import Exported, Target
from linid.identification.result import FitResult

NAME = "isaac"


def configuration(exported: Exported, joint: Joint) -> str:
    """The Python text of an actuator configuration with which Isaac Lab overrides what the URDF says."""
    rotary = exported.result.axis == "rotary"
    force, per_speed = ("N m", "N m s/rad") if rotary else ("N", "N s/m")
    notes = "\n".join(comment_lines(exported, lacks(exported)))
    return "\n".join(
        [
            f'"""{notes}',
            "",
            "For Isaac Lab 2.3 or later with Isaac Sim 5 or later: import axis.urdf and use AXIS_CFG.",
            '"""',
            "",
            "from isaaclab.actuators import ImplicitActuatorCfg",
            "",
            "# The joint's effort per q-current (amplitude) or other input.",
            f"THRUST_PER_INPUT = {number(joint.thrust)}  # {thrust_unit(exported.result)}",
            "",
            "AXIS_CFG = ImplicitActuatorCfg(",
            '    joint_names_expr=["axis"],',
            "    stiffness=0.0,  # no position loop: the effort is the motor's",
            "    damping=0.0,  # of the loop; friction stands below",
            "    armature=0.0,  # the identified mass or inertia is the mover's in axis.urdf",
            f"    friction={number(joint.static)},  # {force}, at breakaway",
            f"    dynamic_friction={number(joint.dynamic)},  # {force}, in motion",
            f"    viscous_friction={number(joint.viscous)},  # {per_speed}",
            ")",
            "",
        ]
    )


def lacks(exported: Exported) -> tuple[str, ...]:
    """What Isaac's joints cannot hold of a model, a sentence each."""
    return lacks_of_joint(exported, breakaway=True)


def files(exported: Exported) -> dict[str, bytes]:
    """axis.urdf without friction, and axis_cfg.py with it; raises UsageError for a model without mass."""
    joint = joint_of(exported, NAME, breakaway=True)
    bare = Joint(joint.mass, 0.0, 0.0, 0.0, joint.thrust)
    return {
        "axis.urdf": urdf(exported, bare, ("friction stands in axis_cfg.py.",)).encode(),
        "axis_cfg.py": configuration(exported, joint).encode(),
    }


def simplified(exported: Exported) -> FitResult:
    """The model that these files equal; raises UsageError for a model without mass."""
    return model_of_joint(exported, joint_of(exported, NAME, breakaway=True))


TARGET = Target(
    name=NAME,
    purpose="Isaac Lab: URDF and an actuator configuration with static, dynamic and viscous friction.",
    files=files,
    simplified=simplified,
    lacks=lacks,
)
