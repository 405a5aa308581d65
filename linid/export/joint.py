"""The axis as a joint of a robot description: mass, Coulomb and viscous friction, what URDF, Isaac and ROS 2 have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from linid.export.simpler import (
    coulomb_and_viscous,
    fundamental_phases,
    held_values,
    left_out,
    mean_friction,
    need_mass,
    number,
    smooth_drag,
    speeds_of,
    stribeck_curve,
    thrust_per_current,
)
from linid.export.target import reshaped

if TYPE_CHECKING:
    from linid.export.target import Exported
    from linid.identification.result import FitResult

# A breakaway force that falls at once: m/s in which it does in the model that stands for it.
_AT_ONCE = 1e-4
_BODY = 1.0  # kg of a link that only turns, which its joint does not feel


@dataclass(frozen=True)
class Joint:
    """What the joint has. mass: kg (rotary: inertia, kg m^2); static, dynamic: friction at breakaway and in motion, N
    (N m); viscous: N s/m (N m s/rad); thrust: force per q-current or input, N/A (N m/A), 0 without motor.
    """

    mass: float
    static: float
    dynamic: float
    viscous: float
    thrust: float


def joint_of(exported: Exported, target: str, *, breakaway: bool) -> Joint:
    """The joint nearest to a model at the speeds that occur; breakaway: whether it has a static friction of its own.

    Raises UsageError for a model without mass, or with a motor that is no constant times its current.
    """
    need_mass(exported, target)
    values, v = held_values(exported), speeds_of(exported)
    factor, more = mean_friction(exported)
    friction = factor * (stribeck_curve(values, v) + more) + values["viscous_friction"] * v
    dynamic, viscous = coulomb_and_viscous(friction + smooth_drag(values, exported.model.effects, v), v)
    static = max(factor * (values["static_force"] + more), dynamic) if breakaway else dynamic
    return Joint(values["mass"], static, dynamic, viscous, thrust_per_current(exported))


def model_of_joint(exported: Exported, joint: Joint) -> FitResult:
    """The model that a joint equals: no effects, a steady friction, the first harmonic of the motor's field."""
    result, values = exported.result, {}
    if exported.model.phases:
        result, values = replace(result, model="sine"), fundamental_phases(exported)
    values |= {
        "coulomb_force": max(joint.dynamic, 1e-9),
        "static_force": max(joint.static, 1e-9),
        "stribeck_velocity": _AT_ONCE,
        "stribeck_exponent": 2.0,
        "viscous_friction": joint.viscous,
    }
    return reshaped(result, effects=(), law="coulomb", values=values)


def lacks_of_joint(exported: Exported, *, breakaway: bool) -> tuple[str, ...]:
    """What a joint cannot hold of a model, a sentence each."""
    friction = "breakaway, Coulomb" if breakaway else "Coulomb"
    found = [f"Friction is {friction} and viscous: no presliding, no Stribeck curve; fitted over the speeds."]
    if exported.model.driven_by.inputs:
        found.append("The joint takes a force: multiply the q-current (or the one input) by the thrust per current.")
    for name in exported.model.effects:
        if name in ("quadratic_drag", "eddy_current_drag"):
            found.append(f"{name} is held as far as viscous friction can.")
        else:
            found.append(left_out(exported, name))
    return tuple(found)


def comment_lines(exported: Exported, lacking: tuple[str, ...]) -> list[str]:
    """What stands at the top of every file: units, what is not held, where the loss is."""
    unit = "rad, N m, kg m^2, s" if exported.result.axis == "rotary" else "m, N, kg, s"
    lines = [f"{exported.name}: {unit}.", *(f"Not held whole: {line}" for line in lacking)]
    return [*lines, "What that costs on held-out recordings: README.txt and loss.json beside this file."]


def thrust_unit(result: FitResult) -> str:
    """The unit of the thrust per q-current or other input."""
    force = "N m" if result.axis == "rotary" else "N"
    return f"{force}/A" if result.input_unit == "A" else f"{force} per {result.input_unit}"


def urdf(exported: Exported, joint: Joint, lacking: tuple[str, ...], more: tuple[str, ...] = ()) -> str:
    """URDF of a base and a mover on one joint without limits. more: lines inside the robot, after the joint."""
    rotary = exported.result.axis == "rotary"
    kind = "continuous" if rotary else "prismatic"
    weight, inertia = (_BODY, joint.mass) if rotary else (joint.mass, joint.mass)
    moments = " ".join(f'i{one}="{number(inertia)}"' for one in ("xx", "yy", "zz"))
    stroke = "" if rotary else 'lower="-1e3" upper="1e3" '  # the format wants limits; these are none
    limit = f'<limit {stroke}effort="1e6" velocity="1e3"/>'
    comment = comment_lines(exported, lacking)
    if joint.thrust:
        thrust = f"{number(joint.thrust)} {thrust_unit(exported.result)}"
        comment.append(f"Force of the motor per q-current (amplitude) or other input: {thrust}.")
    lines = [
        '<?xml version="1.0"?>',
        *(f"<!-- {line.replace('--', '-')} -->" for line in comment),
        f"<robot name={quoteattr(exported.name)}>",
        '  <link name="base"/>',
        '  <link name="mover">',
        "    <inertial>",
        f'      <mass value="{number(weight)}"/>',
        f'      <inertia {moments} ixy="0" ixz="0" iyz="0"/>',
        "    </inertial>",
        "  </link>",
        f'  <joint name="axis" type="{kind}">',
        '    <parent link="base"/>',
        '    <child link="mover"/>',
        '    <axis xyz="1 0 0"/>',
        f"    {limit}",
        f'    <dynamics damping="{number(joint.viscous)}" friction="{number(joint.dynamic)}"/>',
        "  </joint>",
        *more,
        "</robot>",
    ]
    return "\n".join(lines) + "\n"
