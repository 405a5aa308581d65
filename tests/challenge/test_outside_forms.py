"""Each cause outside the library against its closed form, along the plant's own motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.challenge.entries import HiddenEffect
from linid.challenge.kernel import layout
from linid.challenge.kernel.outside import BAND, LEAST_REST, REST_SPEED
from linid.challenge.outside import ARGUMENTS, CAUSES
from linid.challenge.plant import HiddenRun, begun, simulate
from linid.stand.description import AxisDescription
from tests.challenge.conftest import effect, mode_of

Array = np.ndarray


def along(axis: AxisDescription, name: str, where: str, **shape: float) -> tuple[HiddenEffect, HiddenRun, Array]:
    """A cause, the run of a recording with it, and the force in N that the base misses."""
    hidden = effect(name, axis, 2.0)
    hidden = replace(hidden, shape={**hidden.shape, **shape})
    run = simulate(axis, mode_of(axis, where), [hidden])
    return hidden, run, run.mass * (run.acceleration - run.base_acceleration)


def place(y: Array, shape: dict[str, float]) -> Array:
    return np.asarray(np.exp(-0.5 * ((y - shape["centre"]) / shape["width"]) ** 2))


def middle(axis: AxisDescription) -> dict[str, float]:
    return {"centre": axis.stroke.upper_m / 2, "width": 0.02}


def test_gated_vibration_swings_in_time_above_its_speed(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "gated_vibration", "sine_position_1")
    s = hidden.shape
    wave = np.sin(2 * np.pi * s["frequency"] * run.t + s["phase"])
    gate = 0.5 + 0.5 * np.tanh((np.abs(run.v) - s["speed"]) / s["speed_width"])
    assert gate.min() < 0.05 and gate.max() > 0.5
    assert force == pytest.approx(hidden.amplitude * gate * wave, abs=1e-6 * hidden.amplitude)


def test_soft_rail_costs_force_at_its_place_under_thrust(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "soft_rail", "sine_position_1", **middle(axis))
    push = (run.thrust / hidden.shape["force"]) ** 3
    expected = -hidden.amplitude * place(run.y, hidden.shape) * push / (1 + np.abs(push))
    assert np.abs(expected).max() > 0 and force == pytest.approx(expected, abs=1e-6 * hidden.amplitude)


def test_place_damping_and_place_magnet_act_at_their_place(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "place_damping", "sine_position_1", **middle(axis))
    assert force == pytest.approx(-hidden.amplitude * run.v * place(run.y, hidden.shape), abs=1e-6 * hidden.amplitude)
    hidden, run, force = along(axis, "place_magnet", "sine_position_1", **middle(axis))
    away = (run.y - hidden.shape["centre"]) / hidden.shape["width"]
    size = abs(hidden.amplitude)
    assert force == pytest.approx(-hidden.amplitude * away * np.exp(0.5 - 0.5 * away**2), abs=1e-6 * size)
    # Its energy is a function of the place: none is left after a swing there and back.
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(run.y))
    assert np.ptp(work) > 0.1 * size * 0.02
    potential = hidden.amplitude * hidden.shape["width"] * np.exp(0.5 - 0.5 * away**2)
    assert work == pytest.approx(potential[1:] - potential[0], abs=2e-3 * np.ptp(work))


def test_chain_ripple_has_another_period_on_the_way_back(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "chain_ripple", "sine_position_1")
    s, sliding = hidden.shape, np.abs(run.v) > 0.05
    forth = np.sin(2 * np.pi * run.y / s["forth_period"] + s["forth_phase"])
    back = np.sin(2 * np.pi * run.y / s["back_period"] + s["back_phase"])
    assert max(s["forth_period"] / s["back_period"], s["back_period"] / s["forth_period"]) >= 1.3
    expected = hidden.amplitude * np.where(run.v > 0, forth, back)
    assert force[sliding] == pytest.approx(expected[sliding], abs=1e-6 * abs(hidden.amplitude))


def test_resonance_drag_peaks_at_its_speed(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "resonance_drag", "sine_position_1", speed=0.3, speed_width=0.05)
    sliding = np.abs(run.v) > 0.05
    expected = -hidden.amplitude * np.sign(run.v) / (1 + ((np.abs(run.v) - 0.3) / 0.05) ** 2)
    assert np.abs(expected).max() > 0.99 * hidden.amplitude
    assert force[sliding] == pytest.approx(expected[sliding], abs=1e-6 * hidden.amplitude)


def test_thrust_falls_with_speed_towards_one_end_and_with_the_supply(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "feed_line_derating", "sine_position_1")
    far = 0.5 + 0.5 * np.tanh((run.y - hidden.shape["from"]) / hidden.shape["length"])
    left = 1 / (1 + hidden.amplitude * np.abs(run.v) * far)
    size = np.abs(run.thrust).max()
    assert left.min() < 0.95 and force == pytest.approx(run.thrust * (left - 1), abs=1e-6 * size)
    hidden, run, force = along(axis, "supply_ripple", "sine_current_1")
    sway = hidden.amplitude * np.sin(2 * np.pi * hidden.shape["frequency"] * run.t + hidden.shape["phase"])
    assert force == pytest.approx(run.thrust * sway, abs=1e-6 * np.abs(run.thrust).max())


def test_loose_mass_is_carried_by_large_accelerations_only(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "loose_mass", "sine_position_1", acceleration=4.0)
    felt = (run.acceleration / 4.0) ** 3
    expected = -hidden.amplitude * felt / (1 + np.abs(felt))
    # It lags by 1.5 ms.
    assert np.std(force[2:] - np.roll(expected, 2)[2:]) < 0.25 * np.std(expected)
    assert np.corrcoef(force[2:], np.roll(expected, 2)[2:])[0, 1] > 0.97


def braking(axis: AxisDescription, run: HiddenRun, force: Array) -> tuple[Array, Array]:
    """Where the axis slides fast enough for the bristle to be steady, and what friction is more there, in shares of
    Coulomb friction."""
    sliding = np.abs(run.v) > 0.1
    return sliding, -force * np.sign(run.v) / axis.friction.coulomb_force_n


def test_friction_with_thrust_period_and_campaign_time_follows_its_factor(axis: AxisDescription) -> None:
    # A long period: the bristles' damping follows the factor's slope.
    periods: dict[str, float] = {"ball_pass_friction": 0.15}
    for name in ("thrust_grip", "ball_pass_friction", "coolant_cycle"):
        own = {"period": periods[name]} if name in periods else {}
        hidden, run, force = along(axis, name, "sine_position_1", **own)
        s, a = hidden.shape, hidden.amplitude
        sliding, more = braking(axis, run, force)
        if name == "thrust_grip":
            expected = a * np.exp(-0.5 * ((np.abs(run.thrust) - s["force"]) / s["force_width"]) ** 2)
        elif name == "ball_pass_friction":
            expected = a * np.sin(2 * np.pi * run.y / s["period"] + s["phase"])
        else:
            start = begun(axis, mode_of(axis, "sine_position_1"))
            assert start == sum(mode.duration_s for mode in axis.campaign[:13])
            expected = a * np.sin(2 * np.pi * (start + run.t) / s["period"] + s["phase"])
        # The bristle follows the factor within its own length.
        assert np.std((more - expected)[sliding]) < 0.12 * max(np.std(expected[sliding]), 0.1 * a), name


def reversals(y: Array) -> Array:
    """Travel since the last reversal by a plain search: the extreme before every move back of more than BAND."""
    way, origin, extreme, out = 0.0, y[0], y[0], []
    for here in y:
        if way == 0:
            if abs(here - origin) > BAND:
                way, extreme = np.sign(here - origin), here
        elif (here - extreme) * way >= 0:
            extreme = here
        elif abs(here - extreme) > BAND:
            origin, extreme, way = extreme, here, -way
        out.append(abs(here - origin))
    return np.array(out)


def test_reversal_friction_wears_in_over_its_length(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "reversal_friction", "sine_position_1", length=0.01)
    sliding, more = braking(axis, run, force)
    travel = reversals(run.y)
    assert travel[sliding].max() > 0.05
    expected = hidden.amplitude * np.exp(-travel / 0.01)
    assert np.std((more - expected)[sliding]) < 0.1 * np.std(expected[sliding])
    # Reversals that the plant sees between two samples are seen here at the next one.
    noted = np.abs(run.y - run.states[:, layout.PLAIN_STATES + layout.ORIGIN])
    assert np.mean(np.abs(noted - travel) < BAND) > 0.99


def test_film_recovery_lowers_friction_after_a_rest_by_its_length(axis: AxisDescription) -> None:
    hidden, run, force = along(axis, "film_recovery", "moves_1", wear_length=0.02)
    sliding, more = braking(axis, run, force)
    rest, since, clock, path = np.zeros(run.t.size), np.zeros(run.t.size), 0.0, np.abs(np.diff(run.y, prepend=run.y[0]))
    last = slid = 0.0
    for k, speed in enumerate(np.abs(run.v)):
        slid += path[k]
        if speed < REST_SPEED:
            clock += 1e-3
        else:
            if clock >= LEAST_REST:
                last, slid = clock, 0.0
            clock = 0.0
        rest[k], since[k] = last, slid
    assert 0.2 < rest.max() < 1.0
    tau = hidden.shape["recovery_time"]
    expected = -hidden.amplitude * rest / (rest + tau) * np.exp(-since / 0.02)
    assert expected[sliding].min() < -0.3 * hidden.amplitude
    assert np.std((more - expected)[sliding]) < 0.15 * np.std(expected[sliding])


def test_every_cause_says_what_it_depends_on() -> None:
    assert len(CAUSES) >= 14
    for name, cause in CAUSES.items():
        assert cause.arguments and len(set(cause.arguments)) == len(cause.arguments) <= 3, name
        assert set(cause.arguments) <= set(ARGUMENTS)
    assert {argument for cause in CAUSES.values() for argument in cause.arguments} == set(ARGUMENTS)
