"""Inputs between their samples: held and straight ones in closed form, steps of a generated stand, no step in noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.physics.model import Model
from linid.recording import Recording, cubic_spline_coefficients, read_campaign
from linid.recording.input_course import input_coefficients, input_course
from linid.recording.jump_instants import jump_instants
from linid.recording.jumps import find_jumps, logged_instants, step_courses, step_sizes
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.stand.description import AxisDescription, load_axis_description
from linid.stand.generate import GeneratedCampaign, generate, resample_noise

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
DT = 1e-3
INSTANT = 0.06  # of a sampling interval: what noise of 0.2 um leaves of a step of 30 N on 0.6 kg
BY_THE_LOG = 0.25  # intervals, to which its samples tell all steps together
FOLLOWED = 1e-3  # m: of poles 14 mm apart, what a step's instant and its speed leave in a second
NEARER = 3.0  # times, at least, that the run of a square wave is nearer than through a spline


def impulses(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of the inputs over each interval, and of what they have integrated to within it."""
    powers = np.arange(4)
    speed = np.sum(coefficients * DT ** (powers + 1) / (powers + 1), axis=-1)
    return speed, np.sum(coefficients * DT ** (powers + 2) / ((powers + 1) * (powers + 2)), axis=-1)


@given(st.integers(0, 10**6), st.floats(0.0, 1.0))
@settings(max_examples=20, deadline=None)
def test_a_held_input_gives_the_speed_and_the_way_of_its_steps(seed: int, instant: float) -> None:
    u = np.random.default_rng(seed).normal(size=(2, 30))
    held = Recording("r", np.arange(30) * DT, np.arange(30.0), between_samples="hold", jump_at=instant)
    speed, way = impulses(input_coefficients(held, u))
    rest = 1.0 - instant
    np.testing.assert_allclose(speed, DT * (instant * u[:, :-1] + rest * u[:, 1:]), atol=1e-12)
    late = u[:, :-1] * (0.5 - rest**2 / 2.0) + u[:, 1:] * rest**2 / 2.0
    np.testing.assert_allclose(way, DT**2 * late, atol=1e-14)


def test_a_mass_under_held_forces_moves_as_uniform_acceleration_says() -> None:
    """Positions at the samples are those of a parabola per interval, by the simulation itself."""
    u = np.repeat(np.random.default_rng(3).normal(size=12), 5)
    t, mass, gain = np.arange(u.size) * DT, 0.6, 40.0
    held = Recording("r", t, 0.0 * t, drive_input=u, between_samples="hold")
    model = Model("force")
    frictionless = {"coulomb_force": 1e-12, "static_force": 1e-12, "stribeck_velocity": 1.0, "stribeck_exponent": 2.0}
    frictionless |= {"bristle_stiffness": 1.0, "bristle_damping": 0.0, "viscous_friction": 0.0}
    vector = model.vector(frictionless | {"mass": mass, "force_constant": gain})[None, :]
    simulator = Simulator(model, pack_inputs([held]), 2)
    y, v, _ = simulator.run(vector, whole_recordings(simulator.inputs), np.array([[[0.0, 5.0, 0.0]]]), velocity=True)
    a = gain / mass * u[:-1]
    speed = 5.0 + np.concatenate([[0.0], np.cumsum(a * DT)])
    np.testing.assert_allclose(v[0], speed, atol=1e-9)
    np.testing.assert_allclose(y[0], np.concatenate([[0.0], np.cumsum(speed[:-1] * DT + a * DT**2 / 2.0)]), atol=1e-11)


def test_a_resting_axis_swings_on_its_bristle_once_a_small_force_steps() -> None:
    """A spring and a damper hold it: x(t) = u / k (1 - exp(-d t) (cos(w t) + d / w sin(w t))), from the step on. Its
    bristle starts in balance with the force at the first sample, whenever within the first interval the step comes."""
    mass, spring, damper, gain, instant = 0.6, 1.0e4, 40.0, 0.01, 0.3
    u = np.concatenate([[0.0], np.ones(79)])
    t = np.arange(u.size) * DT
    held = Recording("r", t, 0.0 * t, drive_input=u, between_samples="hold", jump_at=instant)
    model = Model("force")
    bristle = {"coulomb_force": 50.0, "static_force": 50.0, "stribeck_velocity": 1.0, "stribeck_exponent": 2.0}
    bristle |= {"bristle_stiffness": spring, "bristle_damping": damper, "viscous_friction": 0.0}
    vector = model.vector(bristle | {"mass": mass, "force_constant": gain})[None, :]
    simulator = Simulator(model, pack_inputs([held]), 8)
    y = simulator.run(vector, whole_recordings(simulator.inputs), np.array([[[0.0, 0.0, np.nan]]]))[0][0]
    decay = damper / (2.0 * mass)
    swing, passed = np.sqrt(spring / mass - decay**2), np.maximum(t - instant * DT, 0.0)
    still = np.exp(-decay * passed) * (np.cos(swing * passed) + decay / swing * np.sin(swing * passed))
    np.testing.assert_allclose(y, gain / spring * (1.0 - still), atol=2e-3 * gain / spring)


@pytest.mark.parametrize("noise", [0.0, 2e-7])
def test_an_axis_that_is_pushed_from_rest_starts_at_rest(noise: float) -> None:
    """y = a (t - lag)^2 / 2 from the lag on: no polynomial across that bend tells that the first speed is zero."""
    t, lag, pushed = np.arange(200) * DT, 0.3 * DT, 40.0
    y = 0.4 + 0.5 * pushed * np.maximum(t - lag, 0.0) ** 2 + noise * np.random.default_rng(5).standard_normal(t.size)
    stepping = np.concatenate([[0.0], np.full(t.size - 1, 0.5)])
    for inputs in ({"drive_input": stepping}, {"phase_currents": np.outer([1.0, -0.5, -0.5], stepping)}):
        motion = Recording("r", t, y, **inputs).motion  # type: ignore[arg-type]
        assert motion.v[0] == 0.0 and motion.standstill[0] and not motion.standstill[1]
        assert abs(motion.v[4] - pushed * (t[4] - lag)) < 4.0 * max(noise, 1e-9) / DT
    coasting = Recording("r", t, 0.4 + pushed * DT * t + 0.5 * pushed * t**2, drive_input=stepping)
    assert coasting.motion.v[0] == pytest.approx(pushed * DT, rel=1e-6)
    assert Recording("r", t, y).motion.v[0] != 0.0  # nothing is known of a step


def test_straight_lines_meet_the_samples() -> None:
    u = np.random.default_rng(4).normal(size=(1, 50))
    straight = Recording("r", np.arange(50) * DT, np.arange(50.0), drive_input=u[0], between_samples="linear")
    course = input_course(straight)
    assert course is not None
    between = np.linspace(0.0, 49 * DT, 400)
    np.testing.assert_allclose(course(between)[0], np.interp(between, straight.t, u[0]), atol=1e-12)


@given(st.integers(0, 10**6), st.floats(5.0, 60.0), st.floats(1e-4, 0.3))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_smooth_rough_and_noisy_inputs_stay_splines(seed: int, frequency: float, noise: float) -> None:
    """Waves, multisines and noise are no steps, however fast three phases turn.

    Always of the same examples: where few samples beside it tell how rough an input is, chance passes for a step (5 of
    9000 such inputs).
    """
    random = np.random.default_rng(seed)
    t = np.arange(600) * DT
    waves = np.stack([np.sin(2 * np.pi * frequency * t + 2 * np.pi / 3 * j) for j in range(3)])
    waves = waves * (1.0 + 0.5 * np.sin(9.0 * t)) + noise * random.normal(size=(3, t.size))
    tones = np.array([np.sin(2 * np.pi * f * t + p) for f, p in random.uniform(1.0, 300.0, size=(8, 2))])
    for inputs in (waves, tones.sum(axis=0)[None, :], random.normal(size=(1, 600))):
        assert find_jumps(inputs) == ()
        whole = Recording("r", t, t)
        assert np.array_equal(input_coefficients(whole, inputs), cubic_spline_coefficients(t[-1] / 599, inputs))


def square_wave(amplitude: float) -> GeneratedCampaign:
    """A square wave whose edges fall anywhere within the sampling intervals; amplitude: A."""
    described = load_axis_description(CONFIGS / "stand_axis.yaml").model_dump()
    mode = {"name": "square", "mode": "square_current", "split": "fit", "duration_s": 1.0, "start_position_m": 0.39}
    described["campaign"] = [mode | {"amplitude_a": amplitude, "frequency_hz": 7.0}]
    return generate(AxisDescription.model_validate(described), seed=1)


@pytest.fixture(scope="module")
def square() -> GeneratedCampaign:
    """A gentle one."""
    return square_wave(0.2)


@pytest.fixture(scope="module")
def pushed() -> GeneratedCampaign:
    """One that pushes the axis off so hard that its first step stands out."""
    return square_wave(0.5)


def instants(one: Recording) -> np.ndarray:
    """When the currents of a recording stepped, in s, as its motion tells."""
    assert one.phase_currents is not None
    jumps = find_jumps(one.phase_currents)
    courses = step_courses(one.phase_currents, jumps)
    logged = logged_instants(one.phase_currents, jumps, courses)
    found = jump_instants(one, jumps, step_sizes(jumps, courses), logged)
    return np.array([one.t[jump.first] for jump in jumps]) + DT * found


def edges_of(square: GeneratedCampaign) -> np.ndarray:
    """When the current of a wave of 7 Hz steps, in s: the drive commands at its edges, the current lags 0.3 ms."""
    loop = square.description.drive.loop_period_s
    edges = (np.arange(1, 15) - 0.5) / (2 * 7.0)  # the wave begins in the middle of its first level, from rest
    return np.asarray(np.ceil(edges / loop - 1e-6) * loop + square.description.drive.current_time_constant_s)


def test_the_motion_tells_when_the_current_stepped(square: GeneratedCampaign) -> None:
    one = square.recordings[0]
    found = instants(one)
    np.testing.assert_allclose(found[found > 0.01], edges_of(square), atol=INSTANT * DT)
    assert np.allclose(instants(replace(one, jump_at=0.25)) / DT % 1.0, 0.25)


def logged_early(one: Recording, samples: int) -> Recording:
    """The same motion, which begins so many samples after what its currents say."""
    currents = np.array(one.phase_currents)
    return replace(one, phase_currents=np.concatenate([currents[:, samples:], currents[:, -samples:]], axis=1))


@pytest.mark.parametrize("samples", [1, 2, 3, 7])
def test_steps_of_a_motor_that_acts_late_are_where_the_log_has_them(square: GeneratedCampaign, samples: int) -> None:
    """All by the same: what scatters from step to step the motion tells as before."""
    found = instants(logged_early(square.recordings[0], samples))
    off = found[-14:] - (edges_of(square) - samples * DT)
    assert float(np.std(off)) < INSTANT * DT
    assert abs(float(np.mean(off))) < BY_THE_LOG * DT


def test_a_delay_is_not_counted_twice_at_steps(square: GeneratedCampaign) -> None:
    """Two samples late, and told so: predictions 0.1 s ahead miss little more than where currents and motion are in
    step."""
    model, late = Model("theta", ("input_delay",)), 2
    known = {p.name for p in model.parameters}

    def missed(recording: Recording, delay: float) -> float:
        values = {**square.truth, "input_delay": delay}
        vector = model.vector({name: value for name, value in values.items() if name in known})[None, :]
        part = Ahead(model, (recording,), 8, 1, project=False, skip_jumps=False, guided=False)
        ends = (part.simulate(vector)[0] - part.measured)[part.segments.out_offsets[1:] - 1]
        return float(np.sqrt(np.mean(ends[1:] ** 2)))  # the first begins before what is known of the currents

    one = square.recordings[0]
    assert missed(logged_early(one, late), late * DT) < 2.0 * missed(one, 0.0)


def test_later_steps_tell_when_the_first_one_came(pushed: GeneratedCampaign) -> None:
    """Its own motion alone, over which friction builds up, puts it a tenth of an interval too early."""
    lag = pushed.description.drive.current_time_constant_s
    for seed in range(1, 4):
        assert abs(instants(resample_noise(pushed, seed).recordings[0])[0] - lag) < INSTANT * DT


def test_a_square_wave_is_followed_where_a_spline_drifts(square: GeneratedCampaign) -> None:
    exact = square.exact["square"]
    one = replace(square.recordings[0], phase_currents=exact.currents)
    model = Model("theta")
    known = {p.name for p in model.parameters}
    vector = model.vector({name: value for name, value in square.truth.items() if name in known})[None, :]

    def furthest(recording: Recording) -> float:
        simulator = Simulator(model, pack_inputs([recording]), 8)
        start = np.array([[[exact.y[0], 0.0, 0.0]]])
        y = simulator.run(vector, whole_recordings(simulator.inputs), start)[0]
        return float(np.abs(y[0] - exact.y).max())

    assert furthest(one) * NEARER < furthest(replace(one, between_samples="spline"))


def test_a_free_run_from_rest_follows_a_square_wave(pushed: GeneratedCampaign) -> None:
    """From the measured start, by what the recording tells of its steps: the field's phase is never lost. Through a
    start whose bristle is bent by a step that has not come yet it was lost within 0.2 s."""
    exact = pushed.exact["square"]
    one = replace(pushed.recordings[0], phase_currents=exact.currents)
    model = Model("theta")
    known = {p.name for p in model.parameters}
    vector = model.vector({name: value for name, value in pushed.truth.items() if name in known})[None, :]
    run = FreeRun(model, (one,), 8, 1)
    y = run.simulate(vector, np.zeros((1, run.nuisances)))[0][0]
    assert np.abs(y - exact.y).max() < FOLLOWED


def test_a_mapping_states_what_inputs_do(tmp_path: Path) -> None:
    t = np.arange(60) * DT
    rows = "\n".join(f"{1e3 * a:.3f},{1e3 * np.sin(9 * a):.6f},{np.cos(40 * a):.6f}" for a in t)
    (tmp_path / "r.csv").write_text("Time (ms),Position (mm),q Current (A)\n" + rows + "\n")
    for extra, kind, instant in (
        ("between_samples: hold, jump_at: 0.5", "hold", 0.5),
        ("period: 1 ms", "detected", None),
    ):
        channels = f"channels: {{time: 'Time', position: 'Position', current_q: 'q Current', {extra}}}"
        channels = channels.replace("time: 'Time', ", "") if "period" in extra else channels
        (tmp_path / "c.yaml").write_text(f"{channels}\nrecordings: [{{file: r.csv, kind: motor}}]\n")
        recording = read_campaign(tmp_path / "c.yaml").recordings[0]
        assert (recording.between_samples, recording.jump_at) == (kind, instant)
