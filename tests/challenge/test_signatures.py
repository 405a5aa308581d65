"""How each hidden effect must show in the plant's motion and readings."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from linid.challenge.axes import draw_axis, scales
from linid.challenge.catalogue import ENTRIES, draw_effect
from linid.challenge.hidden_axis import varied
from linid.challenge.kernel import layout
from linid.challenge.plant import HiddenRun, simulate
from linid.stand.description import AxisDescription
from tests.challenge.conftest import effect, everywhere, listed, mode_of


def pair(axis: AxisDescription, name: str, where: str, factor: float = 2.0) -> tuple[HiddenRun, HiddenRun]:
    mode = mode_of(axis, where)
    return simulate(axis, mode), simulate(axis, mode, [everywhere(effect(name, axis, factor), axis)])


def missing(run: HiddenRun) -> np.ndarray:
    """What the base model misses, in N."""
    return run.mass * (run.acceleration - run.base_acceleration)


def test_scopes_are_kept(axis: AxisDescription) -> None:
    for name, entry in ENTRIES.items():
        hidden = everywhere(effect(name, axis, 2.0), axis)
        if name == "external_disturbance":
            hidden = replace(hidden, shape={"start": 0.1, "length": 0.1})
        mode = mode_of(axis, "freewheel_1")
        plain = simulate(axis, mode)
        if "centre" in hidden.shape:  # a place, which free wheels need not pass
            hidden = replace(hidden, shape={**hidden.shape, "centre": float(np.mean(plain.y))})
        run = simulate(axis, mode, [hidden])
        changed = not np.array_equal(plain.reading, run.reading)
        assert changed == (entry.scope != "driven"), name
        assert not run.currents.any()


def test_current_offset_moves_no_closed_axis_and_shows_in_the_currents(axis: AxisDescription) -> None:
    plain, run = pair(axis, "current_offset", "moves_1")
    assert np.array_equal(plain.y, run.y)
    shift = run.currents - plain.currents
    assert np.ptp(shift, axis=1).max() < 1e-12 and np.abs(shift).max() > 0
    # Seen through the field, a constant offset is a force that goes round with the electrical angle.
    assert np.std(missing(run)) > 0


@pytest.mark.parametrize("name", ["cogging", "force_ripple", "phase_gain_imbalance"])
def test_what_belongs_to_the_pole_pitch_repeats_with_it(axis: AxisDescription, name: str) -> None:
    hidden = effect(name, axis)
    shape = {**hidden.shape, "swell": 0.0} if name == "cogging" else hidden.shape
    mode = mode_of(axis, "sine_position_1")
    run = simulate(axis, mode, [replace(hidden, shape=shape)])
    scale = run.thrust if name != "cogging" else np.ones_like(run.thrust)
    good = np.abs(scale) > 0.3 * np.abs(scale).max()
    motor = axis.motor
    double = 2 if motor.kind == "theta" else 1
    angle = motor.electrical_wavenumber_per_m * double * run.y[good]
    design = np.stack([f(k * angle) for k in (2, 4, 6, 8) for f in (np.sin, np.cos)] + [np.ones(good.sum())], 1)
    ratio = missing(run)[good] / scale[good]
    left = ratio - design @ np.linalg.lstsq(design, ratio, rcond=None)[0]
    assert np.var(left) < 0.03 * np.var(ratio)


def test_constant_force_is_constant(axis: AxisDescription) -> None:
    _, run = pair(axis, "constant_force", "moves_1")
    assert missing(run) == pytest.approx(effect("constant_force", axis, 2.0).amplitude, rel=1e-6)


def test_asymmetric_friction_depends_on_direction(axis: AxisDescription) -> None:
    _, run = pair(axis, "asymmetric_friction", "moves_1")
    sliding = np.abs(run.v) > 0.1
    expected = -effect("asymmetric_friction", axis, 2.0).amplitude * axis.friction.coulomb_force_n
    # More friction one way and as much less the other way: the same force both ways.
    assert np.median(missing(run)[sliding & (run.v > 0)]) == pytest.approx(expected, rel=0.02)
    assert np.median(missing(run)[sliding & (run.v < 0)]) == pytest.approx(expected, rel=0.02)


def test_cable_force_pulls_back_saturates_and_has_hysteresis(axis: AxisDescription) -> None:
    hidden = replace(
        effect("cable_force", axis, 2.0),
        shape={**effect("cable_force", axis).shape, "neutral": axis.stroke.upper_m / 2, "length": 0.05},
    )
    run = simulate(axis, mode_of(axis, "sine_position_1"), [hidden])
    y, force = run.y - axis.stroke.upper_m / 2, missing(run)
    assert np.corrcoef(y, force)[0, 1] < -0.8
    assert np.abs(force).max() <= abs(hidden.amplitude) * (1 + hidden.shape["hysteresis"]) * 1.01
    near = np.abs(y) < 0.01
    assert force[near & (run.v > 0.1)].mean() < force[near & (run.v < -0.1)].mean()


def test_position_dependent_friction_brakes_at_its_place(axis: AxisDescription) -> None:
    shape = {"centre": axis.stroke.upper_m / 2, "width": 0.01}
    hidden = replace(effect("position_dependent_friction", axis), shape=shape)
    run = simulate(axis, mode_of(axis, "sine_position_1"), [hidden])
    power = missing(run) * np.sign(run.v)
    sliding = np.abs(run.v) > 0.1
    far = np.abs(run.y - hidden.shape["centre"]) > 3 * hidden.shape["width"]
    near = np.abs(run.y - hidden.shape["centre"]) < 0.3 * hidden.shape["width"]
    assert (sliding & far).any() and (sliding & near).any()
    assert np.abs(power[sliding & far]).max() < 0.01 * np.abs(power[sliding & near]).min()
    assert power[sliding & near].max() < 0


def test_quadratic_drag_grows_faster_than_speed(axis: AxisDescription) -> None:
    _, run = pair(axis, "quadratic_drag", "freewheel_2")
    moving = np.abs(run.v) > 0.05
    slope = np.polyfit(np.log(np.abs(run.v[moving])), np.log(np.abs(missing(run)[moving])), 1)[0]
    assert 1.75 < slope < 2.25 and (missing(run) * run.v < 1e-12).all()


def test_input_delay_lets_the_force_follow_late(axis: AxisDescription) -> None:
    hidden = effect("input_delay", axis, 4.0)
    run = simulate(axis, mode_of(axis, "square_current_1"), [hidden])
    base = run.thrust - missing(run)  # what the base model takes for the motor force
    lags = np.arange(0, 8)
    fits = [np.corrcoef(base[: len(base) - 8], run.thrust[k : len(base) - 8 + k])[0, 1] for k in lags]
    late = 1e3 * hidden.amplitude * (1 + hidden.shape["lag_share"])
    assert abs(int(np.argmax(fits)) - late) <= 1


def test_force_saturation_costs_thrust_at_high_current_only(axis: AxisDescription) -> None:
    _, run = pair(axis, "force_saturation", "sine_current_2", 3.0)
    size = np.abs(run.states[:, layout.IQ])
    loss = -missing(run) / np.where(run.thrust == 0, np.inf, run.thrust)
    high, low = loss[size > 0.9 * size.max()], loss[(size > 0.2 * size.max()) & (size < 0.3 * size.max())]
    assert np.median(high) > 5 * np.median(low) > 0


def test_thermal_derating_grows_with_time_under_current(axis: AxisDescription) -> None:
    _, run = pair(axis, "thermal_derating", "sine_current_2")
    loss = -missing(run) / np.where(np.abs(run.thrust) < 0.2 * np.abs(run.thrust).max(), np.inf, run.thrust)
    parts = [part[part != 0] for part in np.array_split(loss[1200:], 3)]
    means = [part.mean() for part in parts]
    assert 0 < means[0] < means[1] < means[2]


def test_end_effect_costs_thrust_far_from_the_middle(axis: AxisDescription) -> None:
    mode = mode_of(axis, "sine_position_1")
    middle = axis.stroke.upper_m / 2
    edge = 0.7 * float(np.abs(simulate(axis, mode).y - middle).max())
    shape = {"low": middle - edge, "high": middle + edge, "width": 0.05 * edge}
    run = simulate(axis, mode, [replace(effect("end_effect", axis), shape=shape)])
    far = np.abs(run.y - middle)
    assert np.abs(missing(run)[far > 0.8 * far.max()]).max() > 20 * np.abs(missing(run)[far < 0.1 * far.max()]).max()


def test_flexible_load_rings_at_its_frequency(axis: AxisDescription) -> None:
    hidden = replace(effect("flexible_load", axis), shape={"frequency": 40.0, "damping": 0.01})
    run = simulate(axis, mode_of(axis, "square_current_1"), [hidden])
    ring = run.states[:, layout.PLAIN_STATES + layout.LOAD]
    spectrum = np.abs(np.fft.rfft((ring - ring.mean()) * np.hanning(ring.size)))
    frequency = np.fft.rfftfreq(ring.size, 1e-3)
    high = frequency > 20
    # On the free forcer the load rings sqrt(total/forcer) faster than clamped.
    expected = 40.0 * np.sqrt(1 / (1 - hidden.amplitude))
    assert frequency[high][np.argmax(spectrum[high])] == pytest.approx(expected, abs=1.5)


def test_encoder_error_shows_in_the_reading_with_its_period(axis: AxisDescription) -> None:
    hidden = effect("encoder_periodic_error", axis)
    run = simulate(axis, mode_of(axis, "freewheel_1"), [hidden])
    plain = simulate(axis, mode_of(axis, "freewheel_1"))
    assert np.array_equal(run.y, plain.y)
    error = run.reading - run.y
    assert np.abs(error).max() == pytest.approx(hidden.amplitude, rel=0.01)
    angle = 2 * np.pi * run.y / hidden.shape["period"]
    first = np.abs(np.mean(error * np.abs(run.v) * np.exp(-1j * angle)))
    third = np.abs(np.mean(error * np.abs(run.v) * np.exp(-3j * angle)))
    assert first > 10 * third


def test_external_disturbance_pushes_at_its_moment_in_its_recording(axis: AxisDescription) -> None:
    hidden = effect("external_disturbance", axis)
    assert len(hidden.recordings) == 1
    run = simulate(axis, mode_of(axis, hidden.recordings[0]), [hidden])
    inside = (run.t > hidden.shape["start"]) & (run.t < hidden.shape["start"] + hidden.shape["length"])
    assert np.abs(missing(run)[~inside]).max() < 1e-9
    assert np.abs(missing(run)[inside]).max() == pytest.approx(abs(hidden.amplitude), rel=1e-3)
    other = next(m for m in axis.campaign if m.name not in hidden.recordings)
    assert np.array_equal(simulate(axis, other, [hidden]).y, simulate(axis, other).y)


def test_friction_drift_grows_and_saturates(axis: AxisDescription) -> None:
    hidden = replace(effect("friction_drift", axis), shape={"time_constant": 0.5})
    run = simulate(axis, mode_of(axis, "sine_position_1"), [hidden])
    drag = -missing(run) * np.sign(run.v) / axis.friction.coulomb_force_n
    sliding = (np.abs(run.v) > 0.2) & (np.abs(run.v) < 0.4)
    shares = [np.median(drag[sliding & (run.t > a) & (run.t < b)]) for a, b in ((0.2, 0.6), (2.0, 3.0), (3.0, 4.0))]
    assert abs(shares[0]) < 0.8 * abs(shares[1])
    assert shares[1] == pytest.approx(shares[2], rel=0.1)


def test_payload_change_adds_mass_in_its_recordings(axis: AxisDescription) -> None:
    hidden = effect("payload_change", axis)
    splits = {m.name: m.split for m in axis.campaign}
    assert sorted(splits[name] for name in hidden.recordings) == ["fit", "fit", "held_out"]
    run = simulate(axis, mode_of(axis, hidden.recordings[0]), [hidden])
    assert missing(run) == pytest.approx(-hidden.amplitude * run.acceleration, abs=1e-9)


def test_eddy_current_drag_is_largest_at_its_critical_speed(axis: AxisDescription) -> None:
    hidden = replace(effect("eddy_current_drag", axis), shape={"critical_speed": 0.15})
    run = simulate(axis, mode_of(axis, "sine_position_1"), [hidden])
    drag, speed = -missing(run) * np.sign(run.v), np.abs(run.v)
    assert speed.max() > 0.25
    assert speed[np.argmax(drag)] == pytest.approx(0.15, abs=0.015)
    assert drag.max() == pytest.approx(hidden.amplitude, rel=0.01) and drag[speed > 1e-3].min() > 0


def test_dwell_stiction_holds_after_a_rest_and_is_worn_off(axis: AxisDescription) -> None:
    hidden = effect("dwell_stiction", axis)
    run = simulate(axis, mode_of(axis, "moves_1"), [hidden])
    grown = run.states[:, layout.PLAIN_STATES + layout.DWELT]
    sliding = np.abs(run.v) > 0.2
    assert grown[0] == 1.0 and grown[sliding].max() < 0.2 and grown.min() >= 0
    # What is missed brakes, and is felt at the breakaways alone.
    work = missing(run) * np.sign(run.v)
    assert np.abs(work[sliding]).mean() < 0.1 * -work[np.abs(run.v) > 1e-4].min()


def test_pole_pitch_error_costs_thrust_by_its_square(axis: AxisDescription) -> None:
    losses = []
    for amplitude in (2e-4, 4e-4):
        hidden = replace(effect("pole_pitch_error", axis), amplitude=amplitude)
        run = simulate(axis, mode_of(axis, "sine_position_1"), [hidden])
        strong = np.abs(run.thrust) > 0.5 * np.abs(run.thrust).max()
        losses.append(float(np.mean(-missing(run)[strong] / run.thrust[strong])))
    assert 0 < losses[0] < losses[1]
    # Four times as much for twice the error, but for the little that uneven windings lose in proportion.
    assert 3.2 < losses[1] / losses[0] < 4.8


def test_backlash_lets_the_reading_wait_after_a_reversal(axis: AxisDescription) -> None:
    hidden = replace(effect("backlash", axis), amplitude=1e-3)
    mode = mode_of(axis, "sine_current_2")
    plain, run = simulate(axis, mode), simulate(axis, mode, [hidden])
    assert np.array_equal(plain.y, run.y)  # no loop closes over the encoder here
    error = run.reading - run.y
    assert np.abs(error).max() <= 0.5e-3 * (1 + 1e-9)
    ends = np.flatnonzero(np.diff(np.sign(run.v)) != 0)
    ends = ends[ends > 1500][:-1]
    for first, last in pairwise(ends):
        if abs(run.y[last] - run.y[first]) > 5e-3:
            # Taken up at the end of a swing: half the play behind.
            assert error[last] == pytest.approx(-0.5e-3 * np.sign(run.y[last] - run.y[first]), rel=0.01)


def test_gravity_turns_with_the_shaft() -> None:
    turning = varied(
        draw_axis("axis", np.random.default_rng(3)),
        np.random.default_rng(1),
        kind="q_rotary",
        law="lugre",
        rate=1000.0,
        resolution=None,
    )
    hidden = effect("gravity", turning)
    run = simulate(turning, mode_of(turning, "sine_position_1"), [hidden])
    angle = run.y / turning.radius_m
    assert np.ptp(angle) > np.pi
    design = np.stack([f(k * angle) for k in (1, 2) for f in (np.sin, np.cos)], 1)
    found = np.linalg.lstsq(design, missing(run), rcond=None)[0]
    assert missing(run) == pytest.approx(design @ found, abs=1e-6 * abs(hidden.amplitude))
    assert np.hypot(*found[:2]) == pytest.approx(abs(hidden.amplitude), rel=1e-6)


def test_a_play_in_the_drive_train_swings_softly_within_and_stiffly_beyond(axis: AxisDescription) -> None:
    hidden = effect("drive_train_backlash", axis, 4.0)
    run = simulate(axis, mode_of(axis, "square_current_1"), [hidden])
    x = np.abs(run.states[:, layout.PLAIN_STATES + layout.GEAR])
    half = hidden.shape["half_play"]
    assert x.max() > half and np.std(missing(run)) > 0
    mass = hidden.amplitude * axis.mass_kg
    stiffness = mass * (2 * np.pi * hidden.shape["contact_frequency"]) ** 2
    # Deep in contact the load is carried as by a spring behind the play.
    assert stiffness * (x.max() - half) < 3 * mass * np.abs(run.acceleration).max()


def test_friction_level_change_rules_its_recordings_only(axis: AxisDescription) -> None:
    hidden = effect("friction_level_change", axis)
    splits = {mode.name: mode.split for mode in axis.campaign}
    assert sorted(splits[name] for name in hidden.recordings) == ["fit"] * 3 + ["held_out"] * 2
    other = next(mode for mode in axis.campaign if mode.name not in hidden.recordings)
    assert np.array_equal(simulate(axis, other).y, simulate(axis, other, [hidden]).y)
    mode = mode_of(axis, "sine_position_1")
    run = simulate(axis, mode, [replace(hidden, recordings=(mode.name,))])
    sliding = np.abs(run.v) > 0.1
    ratio = missing(run)[sliding] / (-np.sign(run.v[sliding]) * axis.friction.coulomb_force_n)
    assert np.median(ratio) == pytest.approx(hidden.amplitude, rel=0.02)


def test_several_pushes_meet_recordings_of_both_splits(axis: AxisDescription) -> None:
    listed_modes = listed(axis)
    splits = {mode.name: mode.split for mode in axis.campaign}
    for seed in range(10):
        random = np.random.default_rng(seed)
        hidden = draw_effect("external_disturbance", random, scales(axis), listed_modes, several=True)
        assert 2 <= len(hidden.pushes) <= 5 and {push[0] for push in hidden.pushes} == set(hidden.recordings)
        assert {splits[name] for name in hidden.recordings} == {"fit", "held_out"}
    name, size, start, length = hidden.pushes[0]
    run = simulate(axis, mode_of(axis, name), [hidden])
    mine = [push for push in hidden.pushes if push[0] == name]
    during = np.any([(run.t > s) & (run.t < s + d) for _, _, s, d in mine], axis=0)
    assert np.abs(missing(run)[~during]).max() < 1e-6
    if len(mine) == 1:
        peak = missing(run)[np.argmin(np.abs(run.t - start - length / 2))]
        assert peak == pytest.approx(size * hidden.amplitude, rel=0.01)
