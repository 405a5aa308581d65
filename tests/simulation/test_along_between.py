"""The bristle between samples of a measured motion, of all intervals at once: as a closed form has it one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.arrays import Array
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.along_between import PIECES, UNEVEN
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator

DT = 1e-3
FRICTION = {"coulomb_force": 2.0, "static_force": 3.2, "stribeck_velocity": 5e-3, "bristle_stiffness": 2e4}


def after(w: float, way: tuple[float, float, float], level: float, exponent: float, load: float = 0.0) -> float:
    """The bristle after an interval: w' = v - sigma_0 |v| w / g (4, 42) at the mean speed, or at those of pieces; load:
    N that are added to g."""
    travel, v, v_next = way
    pieces = PIECES if abs(v_next - v) > UNEVEN * abs(travel / DT) else 1
    done = 0.0
    for piece in range(pieces):
        s = (piece + 1) / pieces
        reached = s * s * (3.0 - 2.0 * s) * travel + DT * s * (1.0 - s) * ((1.0 - s) * v - s * v_next)
        part, done = (reached if piece < pieces - 1 else travel) - done, reached
        ratio = abs(part) * pieces / DT / FRICTION["stribeck_velocity"]
        static, coulomb = FRICTION["static_force"], FRICTION["coulomb_force"]
        curve = coulomb + (static - coulomb) * math.exp(-(ratio**exponent))
        rest = math.copysign((level * curve + load) / FRICTION["bristle_stiffness"], part)
        w = rest + (w - rest) * math.exp(-abs(part / rest))
    return w


START = 0.3 * FRICTION["coulomb_force"] / FRICTION["bristle_stiffness"]  # m


def moved(seed: int, count: int, speed: float) -> tuple[Array, Array]:
    """Positions and speeds of so many samples, with reversals and speeds that change by much."""
    v = speed * np.random.default_rng(seed).normal(size=count)
    return np.concatenate([[0.0], np.cumsum(0.5 * DT * (v[1:] + v[:-1]))]), v


def followed(model: Model, values: dict[str, float], recording: Recording, v: Array) -> Array:
    """The bristle along a recording as the simulation follows it."""
    simulator, none = Simulator(model, pack_inputs([recording]), 1), np.zeros(v.size, dtype=bool)
    along = simulator.along(model.vector(FRICTION | values)[None], recording.y, v, none, np.array([[START]]))
    return along.bristle[0]


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(2, 60),
    exponent=st.sampled_from([2.0, 1.3, 0.6]),
    more=st.sampled_from([0.0, 0.4, -0.3]),
    speed=st.sampled_from([1e-4, 1e-2, 1.0]),
)
@settings(deadline=None, max_examples=60)
def test_every_interval_is_the_closed_form(seed: int, count: int, exponent: float, more: float, speed: float) -> None:
    """Any number of samples; an effect makes more or less of friction."""
    y, v = moved(seed, count, speed)
    recording = Recording("r", DT * np.arange(count), y, kind="free_wheel", number=2)
    values = {"stribeck_exponent": exponent, "friction_change": more, "friction_change_recordings": 2.0}
    expected = [START]
    for k in range(count - 1):
        expected.append(after(expected[-1], (y[k + 1] - y[k], v[k], v[k + 1]), 1.0 + more, exponent))
    found = followed(Model("friction", ("friction_level_change",)), values, recording, v)
    assert found == pytest.approx(np.array(expected), rel=1e-11, abs=1e-18)


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(4, 60),
    drawn=st.tuples(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0)),
    weak=st.sampled_from([1.0, 0.5]),
)
@settings(deadline=None, max_examples=60)
def test_friction_that_the_motor_adds_is_in_the_closed_form(
    seed: int, count: int, drawn: tuple[float, float], weak: float
) -> None:
    """g + mu |F| in the middle between samples: an input that rises evenly, a thrust that an effect makes less."""
    y, v = moved(seed, count, 1e-2)
    rising = np.linspace(*drawn, count)
    recording = Recording("r", DT * np.arange(count), y, drive_input=rising, kind="motor", number=2)
    values = {"stribeck_exponent": 2.0, "mass": 1.0, "force_constant": 3.0, "load_friction": 0.2}
    values["constant_change"] = weak - 1.0
    expected = [START]
    for k in range(count - 1):
        load = 0.2 * abs(weak * 3.0 * 0.5 * (rising[k] + rising[k + 1]))
        expected.append(after(expected[-1], (y[k + 1] - y[k], v[k], v[k + 1]), 1.0, 2.0, load))
    found = followed(Model("force", ("force_constant_change", "load_dependent_friction")), values, recording, v)
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-15)


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(4, 600),
    drawn=st.tuples(st.floats(-3.0, 3.0), st.floats(-30.0, 30.0)),
    weak=st.sampled_from([0.0, 0.5, -0.3]),
)
@settings(deadline=None, max_examples=60)
def test_friction_that_an_own_term_adds_is_in_the_closed_form(
    seed: int, count: int, drawn: tuple[float, float], weak: float
) -> None:
    """g + c + d y in the middle between samples, of which a twentieth of Coulomb's is left at least; on all of it, the
    factor that an effect makes."""
    y, v = moved(seed, count, 1e-2)
    recording = Recording("r", DT * np.arange(count), y, kind="free_wheel", number=2)
    values = {"stribeck_exponent": 2.0, "grip_c": drawn[0], "grip_d": drawn[1]}
    values |= {"friction_change": weak, "friction_change_recordings": 2.0}
    expected = [START]
    for k in range(count - 1):
        load = max(drawn[0] + drawn[1] * 0.5 * (y[k] + y[k + 1]), -0.95 * FRICTION["coulomb_force"])
        way = y[k + 1] - y[k], v[k], v[k + 1]
        expected.append(after(expected[-1], way, 1.0 + weak, 2.0, (1.0 + weak) * load))
    own = "grip: -(c + d * y) * sign(v)"
    found = followed(Model("friction", ("friction_level_change", own)), values, recording, v)
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-15)
