"""Every effect in the compiled simulation: against the reference, its order, off means off, equal bits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.model import EFFECT_START, Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.reference import simulate_reference
from linid.simulation.run import Simulator, whole_recordings
from tests.simulation.axis_with_effects import (
    AXIS,
    NAMES,
    SAMPLES,
    campaign_with,
    simulate,
    start_of_run,
    synchronous_run,
)

RUN = synchronous_run()
START = start_of_run()
# A play jumps, and what has play hits its ends; the others are smooth as far as the base model is.
HITTING = "drive_train_backlash"
SMOOTH = tuple(name for name in NAMES if name not in ("backlash", HITTING))
every_effect = pytest.mark.parametrize("name", NAMES)


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_there_is_a_sample_of_every_effect() -> None:
    assert set(SAMPLES) == set(NAMES)
    for name, values in SAMPLES.items():
        assert set(values) == {p.name for p in find_effect(name).parameters_of("sine")}


@every_effect
def test_against_the_reference(name: str) -> None:
    """Driven run with reversals: the effect moves the axis by far more than the two simulations differ."""
    reference, _ = simulate_reference(
        "sine", AXIS | SAMPLES[name], RUN, START, effects=(name,), rtol=1e-10, max_step=2e-3
    )
    effect = rms(reference - simulate((), RUN, START, 16))
    error = rms(simulate((name,), RUN, START, 16) - reference)
    fine, coarse = (1e-6, 2e-5) if name == HITTING else (5e-8, 2e-6)
    share = 2e-3 if name == "breakaway_change" else 1e-3  # it acts where the axis reverses, and nowhere else
    assert error < fine and error < share * effect, (error, effect)
    assert rms(simulate((name,), RUN, START, 2) - reference) < coarse


def test_all_effects_together_against_the_reference() -> None:
    values = dict(AXIS)
    for sample in SAMPLES.values():
        values |= sample
    short = synchronous_run(0.4)
    reference, _ = simulate_reference("sine", values, short, START, effects=NAMES, rtol=1e-9)
    assert rms(simulate(NAMES, short, START, 16) - reference) < 1e-6


@pytest.mark.parametrize("name", SMOOTH)
def test_order_is_kept(name: str) -> None:
    fine = simulate((name,), RUN, START, 256)
    counts = np.array([2, 4, 8, 16, 32])
    errors = [rms(simulate((name,), RUN, START, int(n)) - fine) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope >= 1.9, (slope, errors)


@every_effect
def test_zero_amplitude_is_the_base_model(name: str) -> None:
    """The guarded terms act, but do nothing: to rounding, or where an effect on friction or with states of its own has
    the bristle followed even in fast sliding, to what halving the steps changes."""
    zero = dict.fromkeys(find_effect(name).amplitudes, 0.0)
    base, coarse = simulate((), RUN, START, 8), simulate((), RUN, START, 4)
    gap = np.max(np.abs(simulate((name,), RUN, START, 8, values=zero) - base))
    terms = find_effect(name).terms
    followed = bool({"friction", "level", "load", "advance"} & set(terms))
    assert gap < (np.max(np.abs(coarse - base)) if followed else 1e-12)


def vectors(model: Model) -> np.ndarray:
    """The sample parameters of all effects, whether they act or not."""
    values = dict(AXIS)
    for sample in SAMPLES.values():
        values |= sample
    full = Model(model.kind, NAMES)
    return np.array([full.vector(values), full.vector({**values, "mass": 0.9, "commutation_offset": -0.2})])


def runs(model: Model, params: np.ndarray, *, specialised: bool = False, jobs: int = 1) -> np.ndarray:
    wheel = Recording("wheel", RUN.t[:200], np.zeros(200), kind="free_wheel", number=1)
    simulator = Simulator(model, pack_inputs([RUN, wheel]), 2, jobs, specialised)
    starts = np.tile([START[0], 0.2, math.nan], (params.shape[0], 2, 1))
    return simulator.run(params, whole_recordings(simulator.inputs), starts)[0]


def test_off_means_off() -> None:
    """A bit that is off leaves the base model's bits, whatever the effect's parameters are; on, it changes them."""
    model = Model("sine")
    params = vectors(model)
    bare = params.copy()
    bare[:, EFFECT_START:] = 0.0
    base = runs(model, bare)
    assert np.array_equal(runs(model, params), base)
    for name in NAMES:
        assert not np.array_equal(runs(Model("sine", (name,)), params), base), name


@pytest.mark.parametrize(
    "effects",
    [pytest.param(NAMES, marks=pytest.mark.slow, id="all"), ("thermal_derating", "cable_force", "input_delay")],
)
def test_specialised_kernel_gives_the_same_bits(effects: tuple[str, ...]) -> None:
    model = Model("sine", effects)
    params = vectors(model)
    guarded = runs(model, params)
    assert np.array_equal(guarded, runs(model, params, specialised=True))
    assert np.array_equal(guarded, runs(model, params, jobs=2))
    assert np.all(np.isfinite(guarded))


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4))
def test_specialised_kernels_of_some_effects_give_the_same_bits(first: int) -> None:
    """Every effect once on among others that are off; a kernel takes seconds to compile, hence four for all."""
    model = Model("sine", NAMES[first::4])
    params = vectors(model)
    assert np.array_equal(runs(model, params), runs(model, params, specialised=True))


@every_effect
def test_finite_at_all_bounds(name: str) -> None:
    """No corner of the search box may stop the simulation with an error; it runs or ends as nan from there on."""
    effect = find_effect(name)
    known = AXIS | {p.name: SAMPLES[name].get(p.name, p.default) for p in effect.parameters}
    for parameter in effect.parameters:
        for value in (parameter.lower, parameter.upper):
            y = simulate((name,), RUN, START, values=known | {parameter.name: value})
            bad = np.flatnonzero(~np.isfinite(y))
            assert np.all(np.isfinite(y[: bad[0] if bad.size else None]))
            assert bad.size == 0 or np.all(np.isnan(y[bad[0] :]))
            assert np.isfinite(y[0])


def test_prediction_windows_start_from_the_hidden_states_along_the_motion() -> None:
    """Predictions restarted with their hidden states stay near the run that they are cut from; cold ones do not."""
    effects = ("thermal_derating", "flexible_load", "cable_force")
    values = AXIS | {k: v for name in effects for k, v in SAMPLES[name].items()}
    y = simulate(effects, RUN, (START[0], 0.0, math.nan), 16)
    model = Model("sine", effects)
    part = Ahead(model, (replace(RUN, y=y),), 8, 1, project=False, skip_jumps=False, guided=False)
    params = model.vector(values)[None, :]
    # The first windows hang on the bristle as the axis is let go, which takes them as long as the smoothing reaches.
    later = np.repeat(part.segments.first * RUN.period > 0.1, part.segments.count)
    warm = rms((part.simulate(params) - part.measured)[0, later])
    along = part.simulator.along(params, part.motion.y, part.motion.v, part.motion.standstill, np.full((1, 1), np.nan))
    starts = along.starts(part.flat_first, part.motion.y, part.motion.v, part.simulator.inputs)[:, :, :3]
    cold = rms((part.simulator.run(params, part.segments, starts)[0] - part.measured)[0, later])
    assert warm < 0.1 * cold, (warm, cold)


@pytest.mark.parametrize("name", ["cable_force", "backlash"])
@pytest.mark.parametrize("speed", [0.0, 1e-4, -1e-4, 0.5, -0.5])
def test_an_axis_that_has_just_set_off_starts_from_the_states_of_rest(name: str, speed: float) -> None:
    """The first speed of an axis that stood is noise, whose sign says nothing of where hysteresis or play are."""
    model = Model("sine", (name,))
    params = model.vector(AXIS | SAMPLES[name])[None, :]
    y = START[0] + speed * RUN.t
    v = np.full(RUN.t.size, speed)
    simulator = Simulator(model, pack_inputs((RUN,)), 8, 1)
    along = simulator.along(params, y, v, np.zeros(RUN.t.size, dtype=np.bool_), np.full((1, 1), np.nan))
    assert along.states[0, 0, 0] == (0.0 if abs(speed) < 0.1 else math.copysign(1.0, speed))


@every_effect
def test_force_balance_along_the_motion_reaches_the_floor(name: str) -> None:
    """At true parameters the weak form leaves little; without the effect it leaves much more."""
    recordings = tuple(campaign_with((name,))[i] for i in (0, 1, 2, 4))
    model, base = Model("sine", (name,)), Model("sine")
    values = AXIS | SAMPLES[name]
    none = np.zeros((1, 0))
    full = Acceleration(model, recordings, 1).residuals(model.vector(values)[None, :], none)[0]
    without = Acceleration(base, recordings, 1).residuals(base.vector(values)[None, :], none)[0]
    assert rms(full) < 0.35 * rms(without), (rms(full), rms(without))


@pytest.mark.parametrize("delay", [0.01, -2e-3])
def test_a_delay_is_a_shift_of_the_input(delay: float) -> None:
    """By whole samples it is the recording with its input moved, held at the first or last sample."""
    t = np.arange(0.0, 0.2, 1e-3)
    drive = 0.1 + 0.1 * np.sin(30.0 * t)
    moved = np.interp(t - delay, t, drive)
    start = (0.0, 0.3, 1e-4)
    logged = Recording("logged", t, np.zeros_like(t), drive_input=drive)
    late = simulate(("input_delay",), logged, start, 4, values={"input_delay": delay}, kind="force")
    expected = simulate((), replace(logged, drive_input=moved), start, 4, kind="force")
    undelayed = simulate((), logged, start, 4, kind="force")
    # The spline through the moved samples rounds the corner where the input is held.
    assert rms(late - expected) < 0.02 * rms(late - undelayed)


def test_records_and_running_time_reach_the_effects() -> None:
    """Effects of one recording act in that alone; the campaign's running time drifts on."""
    numbered = [replace(RUN, name=f"r{k}", number=k, elapsed=float(k)) for k in (4, 5)]
    payload = [simulate(("payload_change",), r, START) for r in numbered]
    base = simulate((), RUN, START)
    assert np.array_equal(payload[0], base) and rms(payload[1] - base) > 1e-4
    drift = [simulate(("friction_drift",), r, START) for r in numbered]
    assert rms(drift[0] - drift[1]) > 1e-7


def test_several_pushes_add_up() -> None:
    """Each acts in its own recording; those of one recording add their forces, whatever part holds them."""
    one, two = (SAMPLES["external_disturbance"] | {"disturbance_start_1": start} for start in (0.31, 0.4))
    push = find_effect("external_disturbance")
    first = {k: v for k, v in one.items() if k.endswith("_1")}
    second = {k: v for k, v in two.items() if k.endswith("_1")} | {"disturbance_force_1": -2.0}
    arguments = (0.42, 0.1, 0.2, 0.0, 0.0, 0.0, 5.0, 1.0)

    def force(values: dict[str, float], record: float = 5.0) -> float:
        parameters = [values.get(p.name, p.default) for p in push.parameters]
        return float(push.force(*arguments[:6], record, *arguments[7:], *parameters))

    both = first | push.moved(second, 4)
    assert push.free_part(first) == 2 and push.free_part(both) == 2 and push.free_part(both | push.moved(first, 2)) == 3
    assert force(both) == pytest.approx(force(first) + force(second), rel=1e-12) and force(first) * force(second) < 0.0
    elsewhere = first | push.moved(second | {"disturbance_recording_1": 6.0}, 2)
    assert (force(elsewhere), force(elsewhere, 6.0), force(elsewhere, 7.0)) == (force(first), force(second), 0.0)
    assert [n for n in range(9) if push.acts_in(elsewhere, n)] == [5, 6]
    assert push.acts_in(elsewhere | {"disturbance_force_2": 0.0}, 5)
    assert not push.acts_in(elsewhere | {"disturbance_force_2": 0.0}, 6)
    held = push.held(elsewhere)
    assert set(held) == {"disturbance_recording_1", "disturbance_recording_2"} | {
        p.name for k in (3, 4, 5, 6) for p in push.part(k)
    }
    assert push.free_part({f"disturbance_recording_{k}": 1.0 for k in range(1, 7)}) == 0
    reference, _ = simulate_reference("sine", AXIS | both, RUN, START, effects=(push.name,), rtol=1e-10, max_step=2e-3)
    assert rms(simulate((push.name,), RUN, START, 16, values=both) - reference) < 5e-8


def test_friction_under_load_takes_its_share_of_the_thrust() -> None:
    """Steady: sigma_2 v = F - F_C - mu F, of the thrust after saturation; at rest F must beat F_S + mu F."""
    t = np.arange(0.0, 2.5, 1e-3)
    # A wide Stribeck curve: in a narrow one, the creep of the ramp lowers the breakaway.
    known = {"force_constant": 10.0, "load_friction": 0.3, "stribeck_velocity": 0.1}
    known |= {"saturation": 0.2, "saturation_knee": 1.0}
    for effects, thrust in (
        (("load_dependent_friction",), 8.0),
        (("load_dependent_friction", "force_saturation"), 8.0 / (1.0 + 0.2 * 0.8**2)),
    ):
        logged = Recording("steady", t, np.zeros_like(t), drive_input=np.full_like(t, 0.8))
        y = simulate(effects, logged, (0.0, 0.5, math.nan), 2, values=known, kind="force")
        speed = (0.7 * thrust - AXIS["coulomb_force"]) / AXIS["viscous_friction"]
        found = (y[-1] - y[-101]) / 0.1
        assert found == pytest.approx(speed, rel=1e-4)
    holding = AXIS["static_force"] / 0.7
    for share, moves in ((0.95, False), (1.05, True)):
        ramp = 0.1 * share * holding * np.minimum(t / 1.0, 1.0)
        y = simulate(
            effects[:1], Recording("ramp", t, 0.0 * t, drive_input=ramp), (0.0, 0.0, 0.0), 2, values=known, kind="force"
        )
        assert (y[-1] > 0.1) == moves and (moves or y[-1] - y[-500] < 1e-5)


def test_effects_are_listed_once() -> None:
    assert len({effect.name for effect in EFFECTS}) == len(EFFECTS)
