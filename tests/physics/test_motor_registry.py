"""The registry of motors: those of other packages, each in one file, and malformed ones."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from linid.errors import ConfigError, UsageError
from linid.physics.model import Model
from linid.physics.motors import force, sine, theta
from linid.physics.motors.motor import Derived, Motor, check_motor
from linid.physics.motors.names import driven_motors
from linid.physics.motors.registry import BUILT_IN, MOTORS, collect

PACKAGE = Path(__file__).parent / "example_motor_package"


def plain(y, i_1, i_2, i_3, force_constant):
    return force_constant * i_1


@pytest.mark.parametrize(
    ("motor", "fact"),
    [
        (replace(force.MOTOR, name="no name"), "identifier"),
        (replace(force.MOTOR, inputs=2), "2 inputs"),
        (replace(force.MOTOR, thrust=plain), "not compiled"),
        (replace(force.MOTOR, thrust=None), "either"),
        (replace(force.MOTOR, thrust=theta.MOTOR.constant), "expected 5"),
        (replace(force.MOTOR, amplitudes=sine.MOTOR.amplitudes, thrust=None), "not three inputs"),
        (replace(force.MOTOR, parameters=theta.MOTOR.parameters[1:]), "first parameter"),
        (replace(force.MOTOR, parameters=force.MOTOR.parameters * 2), "same name"),
        (replace(force.MOTOR, parameters=(replace(force.MOTOR.parameters[0], default=1e9),)), "outside its bounds"),
        (replace(force.MOTOR, derived=(Derived("a", "a", "1", abs, ("nome",)),)), "follows from nome"),
        (replace(force.MOTOR, constant=theta.MOTOR.constant), "no `amplitudes`"),
        (replace(theta.MOTOR, shape=theta.MOTOR.shape[:1]), "are not force_constant"),
        (replace(sine.MOTOR, amplitudes=theta.MOTOR.amplitudes), "takes 3 arguments, expected 1: out"),
    ],
)
def test_a_malformed_motor_is_refused(motor: Motor, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        check_motor(motor, "here")


@pytest.mark.parametrize(
    ("name", "value", "fact"),
    [
        ("sine", "linid.physics.motors.sine:MOTOR", "a motor 'sine' already"),
        ("other", "linid.physics.motors.sine:MOTOR", "Call the entry point like its motor"),
        ("broken", "no_such_module:MOTOR", "cannot be loaded"),
        ("broken", "math:pi", "found float"),
    ],
)
def test_what_a_package_brings_is_checked(name: str, value: str, fact: str) -> None:
    built_in = BUILT_IN if name == "sine" else BUILT_IN[:2]
    with pytest.raises(ConfigError, match=fact):
        collect(built_in, [EntryPoint(name, value, "linid.motors")])


def test_motors_of_packages_follow_those_of_linid() -> None:
    point = EntryPoint("sine", "linid.physics.motors.sine:MOTOR", "linid.motors")
    assert list(collect(BUILT_IN[:2], [point])) == ["friction", "force", "sine"]


def test_names_are_known_without_loading_the_motors() -> None:
    assert set(driven_motors()) == {name for name, motor in MOTORS.items() if motor.inputs}
    code = "import sys; from linid.physics.motors.names import driven_motors as d; d(); print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "False"


def test_only_a_motor_whose_field_repeats_has_windings() -> None:
    assert Model("theta", (), "star").winding == "star"
    with pytest.raises(UsageError, match="cannot be driven by voltages"):
        Model("force", (), "star")


# Recordings by the slow simulation with the motors' terms in plain Python, fits by the public interface.
END_TO_END = """
import json, sys
import numpy as np
import linid
from linid.physics.model import Model
from linid.simulation.inputs import pack_inputs
from linid.simulation.reference import simulate_reference
from linid.simulation.run import Simulator, whole_recordings

friction = dict(coulomb_force=1.72, static_force=3.198, stribeck_velocity=2.993e-3, stribeck_exponent=2.0,
    bristle_stiffness=1.169e4, bristle_damping=92.14, viscous_friction=2.517, mass=0.588)
truth = dict(
    trapezoid=dict(force_constant=25.0, electrical_wavenumber=222.0, winding_displacement=2.0, commutation_offset=0.4,
        ramp=0.6),
    saturating=dict(force_constant=25.0, knee=3.0),
)
t = np.arange(0.0, 0.8, 1e-3)
random = np.random.default_rng(7)
out = {}
for kind, own in truth.items():
    values = {**friction, **own}
    given = {name: values[name] for name in friction}
    recordings, errors = [], []
    for number, (pace, size) in enumerate(((9.0, 0.5), (13.0, 0.9), (23.0, 1.5), (11.0, 0.7), (17.0, 1.2)), 1):
        wave = size * np.sin(pace * t) * np.cos(2.1 * t)
        if kind == "saturating":
            made = dict(drive_input=wave, input_unit="A")
        else:  # unbalanced currents, so that the third harmonic shows
            made = dict(phase_currents=np.stack([wave, 0.6 * np.roll(wave, 90), -0.8 * wave]))
        empty = linid.Recording(f"r{number}", t, np.zeros_like(t), number=number, **made)
        start = (0.01 * number, 0.0, 0.0)
        exact = simulate_reference(kind, values, empty, start, rtol=1e-8, max_step=1e-3)[0]
        simulator = Simulator(Model(kind), pack_inputs([empty]), 4)
        ours = simulator.run(simulator.model.vector(values)[None], whole_recordings(simulator.inputs),
            np.array([[start]]))[0][0]
        errors.append(float(np.max(np.abs(ours - exact))))
        measured = exact + 1e-6 * random.standard_normal(t.size)
        split = "fit" if number < 4 else "held_out"
        recordings.append(linid.Recording(f"r{number}", t, measured, number=number, split=split, **made))
    campaign = linid.Campaign.of(recordings, known={"mass": values["mass"]})
    fit = linid.fit(campaign, kind, seed=1)
    gaps = linid.validate(fit, campaign.held_out, among=campaign)
    out[kind] = dict(
        errors=errors,
        found={name: [fit[name].value, *fit[name].interval, own[name]] for name in own},
        derived=[e.name for e in fit.result.derived],
        gaps=[[gap.ahead, gap.ahead_floor] for gap in gaps],
    )
print(json.dumps(out))
"""


@pytest.mark.slow
def test_a_package_brings_motors_each_in_one_file(tmp_path: Path) -> None:
    """Found by their entry points (no pip: a folder with dist-info on the path), compiled, simulated, fitted, named."""
    root = Path(__file__).parents[2]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(PACKAGE), str(root), os.environ.get("PYTHONPATH", "")]),
        "LINID_CACHE_DIR": str(tmp_path),
    }
    called = {"env": environment, "capture_output": True, "text": True, "timeout": 500}
    done = subprocess.run([sys.executable, "-c", END_TO_END], **called)  # type: ignore[call-overload]
    assert done.returncode == 0, done.stderr[-2000:]
    answer = json.loads(done.stdout)
    for kind, found in answer.items():
        assert max(found["errors"]) < 1e-6, kind
        for name, (value, low, high, true) in found["found"].items():
            assert value == pytest.approx(true, rel=0.02), (kind, name)
            assert low - 0.5 * (high - low) < true < high + 0.5 * (high - low), (kind, name)
        # 30 um at most of strokes of some cm: near reversals a prediction hangs on the friction more than on the motor.
        assert all(ahead < 5.0 * floor for ahead, floor in found["gaps"]), kind
    assert answer["trapezoid"]["derived"] == [
        "pole_pitch",
        "phase_spacing",
        "ramp_length",
        "fundamental_force_constant",
        "sine_force_error",
    ]
    helped = subprocess.run([sys.executable, "-m", "linid", "fit-motor", "--help"], **called)  # type: ignore[call-overload]
    assert "[sine|theta|force|saturating|trapezoid]" in helped.stdout
