"""ROS 2: URDF with the joint's interfaces for ros2_control, and its parameters as YAML."""

from __future__ import annotations

from linid.export.joint import Joint, comment_lines, joint_of, lacks_of_joint, model_of_joint, thrust_unit, urdf
from linid.export.simpler import number
from linid.export.target import Exported, Target
from linid.identification.result import FitResult

NAME = "ros2"
# What a simulated ros2_control joint takes and tells; the hardware's plugin is the user's.
_INTERFACES = (
    '  <ros2_control name="axis" type="system">',
    "    <hardware>",
    "      <plugin>mock_components/GenericSystem</plugin>",
    "    </hardware>",
    '    <joint name="axis">',
    '      <command_interface name="effort"/>',
    '      <state_interface name="position"/>',
    '      <state_interface name="velocity"/>',
    '      <state_interface name="effort"/>',
    "    </joint>",
    "  </ros2_control>",
)


def parameters(exported: Exported, joint: Joint) -> str:
    """Node parameters in YAML: what a feed-forward or a friction observer of one's own reads."""
    lines = [f"# {line}" for line in comment_lines(exported, lacks(exported))]
    rotary = exported.result.axis == "rotary"
    units = ("kg m^2", "N m", "N m s/rad") if rotary else ("kg", "N", "N s/m")
    rows = (
        ("mass" if not rotary else "inertia", joint.mass, units[0]),
        ("coulomb_friction", joint.dynamic, units[1]),
        ("viscous_friction", joint.viscous, units[2]),
        ("effort_per_input", joint.thrust, thrust_unit(exported.result)),
    )
    lines += ["/**:", "  ros__parameters:", "    axis:", "      joint: axis"]
    return "\n".join([*lines, *(f"      {name}: {number(x)}  # {unit}" for name, x, unit in rows)]) + "\n"


def lacks(exported: Exported) -> tuple[str, ...]:
    """What a URDF joint cannot hold of a model, a sentence each."""
    return lacks_of_joint(exported, breakaway=False)


def files(exported: Exported) -> dict[str, bytes]:
    """axis.urdf and axis.yaml; raises UsageError for a model without mass."""
    joint = joint_of(exported, NAME, breakaway=False)
    text = urdf(exported, joint, lacks(exported), _INTERFACES)
    return {"axis.urdf": text.encode(), "axis.yaml": parameters(exported, joint).encode()}


def simplified(exported: Exported) -> FitResult:
    """The model that axis.urdf equals; raises UsageError for a model without mass."""
    return model_of_joint(exported, joint_of(exported, NAME, breakaway=False))


TARGET = Target(
    name=NAME,
    purpose="ROS 2: URDF with ros2_control's effort interface, and the joint's parameters as YAML.",
    files=files,
    simplified=simplified,
    lacks=lacks,
)
