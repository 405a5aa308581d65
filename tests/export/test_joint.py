"""URDF, Isaac and ROS 2: what their joints do, integrated apart from linid and by MuJoCo's own reading of the URDF."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from linid.errors import UsageError
from linid.export.joint import joint_of
from linid.export.target import Target
from linid.export.targets import isaac, ros2, urdf
from linid.identification.result import FitResult
from linid.recording.recording import Recording
from tests.export.axes import FRICTION, HELD, LOST, axis, exported, free_run, made

STEP = 2.5e-5  # s, of the independent integration
# Share of the gap between a model without effects and the whole one, by which two ways to run a form may differ.
SAME_LOSS = 0.05
# Of the error without it, that may be left where an effect is held in its mean.
LEFT_IN_MEAN = 0.6
LATE_FREE = {name: values for name, values in HELD.items() if name not in ("thermal_derating", "gravity")}
TARGETS = (urdf.TARGET, isaac.TARGET, ros2.TARGET)


def numbers_of(target: Target, model: FitResult, *recordings: Recording) -> SimpleNamespace:
    """Mass, static, dynamic and viscous friction and thrust as a reader of the target's files finds them."""
    files = {name: content.decode() for name, content in target.files(exported(model, *recordings)).items()}
    robot = ElementTree.fromstring(files["axis.urdf"])
    dynamics = robot.find("joint/dynamics").attrib
    mass = float(robot.find("link/inertial/inertia").attrib["ixx"])
    friction, damping = float(dynamics["friction"]), float(dynamics["damping"])
    if target is isaac.TARGET:
        assert (friction, damping) == (0.0, 0.0)
        found = configured(files["axis_cfg.py"])
        return SimpleNamespace(
            mass=mass, static=found.friction, dynamic=found.dynamic_friction, viscous=found.viscous_friction
        )
    if target is ros2.TARGET:
        read = yaml.safe_load(files["axis.yaml"])["/**"]["ros__parameters"]["axis"]
        assert (read["coulomb_friction"], read["viscous_friction"], read["mass"]) == (friction, damping, mass)
        assert robot.find("ros2_control/joint/command_interface").attrib["name"] == "effort"
    return SimpleNamespace(mass=mass, static=friction, dynamic=friction, viscous=damping)


def configured(text: str) -> SimpleNamespace:
    """The actuator configuration that a text of Python makes, with a class of that name that keeps what it gets."""
    package, module = ModuleType("isaaclab"), ModuleType("isaaclab.actuators")
    module.ImplicitActuatorCfg = SimpleNamespace  # type: ignore[attr-defined]
    names: dict[str, object] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "isaaclab", package)
        patch.setitem(sys.modules, "isaaclab.actuators", module)
        exec(compile(text, "axis_cfg.py", "exec"), names)
    assert names["THRUST_PER_INPUT"] == FRICTION["force_constant"]
    return names["AXIS_CFG"]  # type: ignore[return-value]


def integrated(joint: SimpleNamespace, recording: Recording, thrust: float) -> np.ndarray:
    """Positions (n,) in m of a mass with dry and viscous friction: Moreau's scheme, whose friction is set-valued."""
    middles = recording.t[0] + STEP * (np.arange(round(recording.duration / STEP)) + 0.5)
    force = thrust * np.interp(middles, recording.t, recording.drive_input)
    y = v = 0.0
    out = np.empty(middles.size + 1)
    out[0] = 0.0
    for k, push in enumerate(force):
        if v == 0.0 and abs(push) <= joint.static:
            out[k + 1] = y
            continue
        free = v + STEP * push / joint.mass
        v = np.sign(free) * max(abs(free) - STEP * joint.dynamic / joint.mass, 0.0)
        v /= 1.0 + STEP * joint.viscous / joint.mass
        y += STEP * v
        out[k + 1] = y
    return out[:: round(recording.period / STEP)]


def share(errors: list[np.ndarray], base: list[np.ndarray]) -> float:
    return 1.0 - float(np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(base))))


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_the_loss_that_linid_states_is_that_of_the_joint_integrated_apart(target: Target) -> None:
    model = axis(LATE_FREE, LOST)
    recordings = made(model, 1.0, 1.5)
    joint, form = numbers_of(target, model, *recordings), target.simplified(exported(model, *recordings))
    base = [free_run(axis(), one) - one.y for one in recordings]
    said = share([free_run(form, one) - one.y for one in recordings], base)
    alone = share([integrated(joint, one, FRICTION["force_constant"]) - one.y for one in recordings], base)
    assert len(model.effects) > 8 and alone == pytest.approx(said, abs=SAME_LOSS)


def test_mujoco_reads_the_urdf_and_loses_as_much() -> None:
    mujoco = pytest.importorskip("mujoco", minversion="3.7", reason="needs mujoco, of the extra mujoco")
    model = axis(LATE_FREE, LOST)
    recordings = made(model, 1.0, 1.5)
    text = urdf.TARGET.files(exported(model, *recordings))["axis.urdf"].decode()
    option = (
        '<mujoco><compiler fusestatic="false"/><option timestep="1e-4" integrator="Euler" gravity="0 0 0"/></mujoco>'
    )
    simple = mujoco.MjModel.from_xml_string(text.replace("</robot>", option + "</robot>"))
    # MuJoCo's dry friction is a soft constraint, which creeps; these make it hard.
    simple.dof_solref[:], simple.dof_solimp[:, :2] = [2e-4, 1.0], [0.99, 0.999]
    form = urdf.TARGET.simplified(exported(model, *recordings))
    errors = {"said": [], "run": [], "base": []}
    for one in recordings:
        data, y = mujoco.MjData(simple), [0.0]
        for k in range(1, one.t.size):
            for part in range(10):
                i = np.interp(one.t[k - 1] + (part + 0.5) * 1e-4, one.t, one.drive_input)
                data.qfrc_applied[0] = FRICTION["force_constant"] * i
                mujoco.mj_step(simple, data)
            y.append(float(data.qpos[0]))
        for name, course in (("said", free_run(form, one)), ("run", np.array(y)), ("base", free_run(axis(), one))):
            errors[name].append(course - one.y)
    said, run = (share(errors[name], errors["base"]) for name in ("said", "run"))
    assert run == pytest.approx(said, abs=SAME_LOSS)


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_an_axis_of_the_joints_own_kind_is_found_again(target: Target) -> None:
    model = replace(axis(static_force=FRICTION["coulomb_force"]), law="coulomb")
    (recording,) = made(model, 1.3)
    joint = numbers_of(target, model, recording)
    wanted = [FRICTION[name] for name in ("mass", "coulomb_force", "coulomb_force", "viscous_friction")]
    assert [joint.mass, joint.static, joint.dynamic, joint.viscous] == pytest.approx(wanted, rel=1e-9)


def test_friction_is_fitted_where_the_axis_moves() -> None:
    model = axis({"quadratic_drag": HELD["quadratic_drag"]})
    slow, fast = (joint_of(exported(model, *made(model, size)), "urdf", breakaway=False) for size in (0.6, 2.0))
    assert fast.viscous > slow.viscous + 1.0  # 4 N s^2/m^2 of drag, at least half a metre per second faster


TIGHT = {f"friction_at_{k}": 0.6 for k in range(1, 12) if k != 6}
PLACES = {f"friction_place_{k}": 0.03 * (k - 6) for k in range(1, 12)}


@pytest.mark.parametrize(
    "effect",
    [{"position_dependent_friction": TIGHT | PLACES}, {"load_dependent_friction": {"load_friction": 0.1}}],
    ids=lambda effect: next(iter(effect)),
)
def test_friction_of_place_and_load_is_held_in_its_mean(effect: dict[str, dict[str, float]]) -> None:
    model = axis(effect)
    recordings = made(model, 1.0, 1.3)
    form, bare = (urdf.TARGET.simplified(exported(one, *recordings)) for one in (model, axis()))
    errors = [np.std([free_run(one, recording) - recording.y for recording in recordings]) for one in (form, bare)]
    assert errors[0] < LEFT_IN_MEAN * errors[1]


def test_isaac_breaks_away_where_the_model_does() -> None:
    assert numbers_of(isaac.TARGET, axis()).static == FRICTION["static_force"]


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_every_effect_is_named_and_a_model_per_kilogram_refused(target: Target) -> None:
    model = axis(HELD, LOST)
    lacking = " ".join(target.lacks(exported(model)))
    assert [name for name in model.effects if name not in lacking] == []
    comment = target.files(exported(model))
    assert all(any(line in content.decode() for content in comment.values()) for line in target.lacks(exported(model)))
    with pytest.raises(UsageError, match="mass"):
        target.files(exported(replace(model, per_mass=True)))


def test_the_thrust_per_current_is_in_every_target() -> None:
    values = {"electrical_wavenumber": 200.0, "winding_displacement": 2.0944, "commutation_offset": 0.3}
    for target in TARGETS:
        texts = "".join(content.decode() for content in target.files(exported(axis(kind="sine", **values))).values())
        assert re.search(r"\b45\.0\b[^\n]*N/A", texts)  # 3/2 of a phase's 30 N/A (44)


def test_a_rotary_axis_turns() -> None:
    text = urdf.TARGET.files(exported(replace(axis(), axis="rotary")))["axis.urdf"].decode()
    assert 'type="continuous"' in text and 'ixx="2.0"' in text and "N m" in text
