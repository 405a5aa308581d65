"""Friction laws of the hidden plant against closed forms, and axes that log one current."""

from __future__ import annotations

import numpy as np
import pytest

from linid.challenge.axes import draw_axis
from linid.challenge.hidden_axis import AXES, AxisKind, HiddenAxis, Law, thrust_per_ampere, truth, varied
from linid.challenge.kernel import layout
from linid.challenge.kernel.friction import slip, slipped
from linid.challenge.plant import build_plant, simulate
from tests.challenge.conftest import mode_of


def axis_of(law: Law, kind: AxisKind = "phase", **more: object) -> HiddenAxis:
    drawn = varied(
        draw_axis("axis", np.random.default_rng(3)),
        np.random.default_rng(7),
        kind=kind,
        law=law,
        rate=1000.0,
        resolution=None,
    )
    return drawn.model_copy(update=more)


def test_maxwells_elements_follow_masings_rules() -> None:
    axis = axis_of("maxwell")
    plant = build_plant(axis, axis.campaign[0], (), index=0, powered=True)
    assert plant.shares.sum() == pytest.approx(1) and plant.stiffness.sum() == pytest.approx(plant.sigma_0)
    g = 3.0
    furthest = float(np.max(plant.shares * g / plant.stiffness))

    def virgin(x: float) -> float:
        return float(np.sum(np.minimum(plant.stiffness * x, plant.shares * g)))

    slips, place = np.zeros(layout.ELEMENTS), 0.0

    def walk(end: float) -> float:
        nonlocal place
        for step in np.diff(np.linspace(place, end, 200)):
            slip.py_func(slips, step, g, plant)
        place = end
        return float(slipped.py_func(slips, 0.0, g, plant)[0])

    turn = 0.8 * furthest
    for x in (0.2 * furthest, 0.5 * furthest, turn):
        assert walk(x) == pytest.approx(virgin(x))
    top = virgin(turn)
    for x in (0.4 * furthest, -0.3 * furthest):  # the branch after a reversal is the virgin curve at twice the scale
        assert walk(x) == pytest.approx(top - 2 * virgin((turn - x) / 2))
    # Back at the turning point the loop closes, and beyond the last element the whole force resists.
    assert walk(turn) == pytest.approx(top)
    assert walk(3 * furthest) == pytest.approx(g)


@pytest.mark.parametrize("bend", [1.0, 2.0])
def test_dahls_force_is_its_closed_form(bend: float) -> None:
    axis = axis_of("dahl", bend=bend)
    run = simulate(axis, mode_of(axis, "slow_ramp_1"))
    turned = np.flatnonzero(run.v[5:] * run.v[5] <= 0)
    rows = slice(5, 3 + int(turned[0]) if turned.size else None)  # until the first reversal
    travel = np.abs(run.y[rows] - run.y[0]) * axis.friction.bristle_stiffness_n_per_m / axis.friction.coulomb_force_n
    force = np.abs(run.states[rows, layout.W]) * axis.friction.bristle_stiffness_n_per_m
    share = 1 - np.exp(-travel) if bend == 1.0 else travel / (1 + travel)
    assert travel.max() > 0.1
    assert force == pytest.approx(axis.friction.coulomb_force_n * share, rel=1e-4, abs=1e-6)


def test_dahls_law_with_exponent_one_is_lugres_without_stribeck_and_damping() -> None:
    axis = axis_of("dahl", bend=1.0)
    mode = mode_of(axis, "sine_position_1")
    other = axis.model_copy(update={"law": "lugre"})
    assert simulate(axis, mode).y == pytest.approx(simulate(other, mode).y, abs=1e-10)


@pytest.mark.parametrize("law", ["maxwell", "dahl", "elasto_plastic", "coulomb"])
def test_other_laws_slide_like_lugres_and_keep_their_energy(law: Law) -> None:
    axis = axis_of(law)
    run = simulate(axis, mode_of(axis, "sine_position_2"))
    assert run.acceleration == pytest.approx(run.base_acceleration, abs=1e-9)
    sliding = np.abs(run.v) > 0.2
    resist = run.thrust - run.mass * run.acceleration
    expected = np.sign(run.v) * axis.friction.coulomb_force_n + axis.friction.viscous_friction_n_s_per_m * run.v
    far = sliding & (np.abs(run.v) > 8 * axis.friction.stribeck_velocity_m_per_s)
    assert np.median(np.abs(resist[far] - expected[far])) < 0.02 * axis.friction.coulomb_force_n
    stored = 0.5 * run.mass * run.v**2
    if law in ("dahl", "elasto_plastic"):
        stored = stored + 0.5 * axis.friction.bristle_stiffness_n_per_m * run.states[:, layout.W] ** 2
    work, loss = run.states[:, layout.WORK], run.states[:, layout.LOSS]
    assert np.abs(stored - work + loss).max() < 1e-5 * np.ptp(work)


def test_halving_the_step_moves_maxwells_axis_by_less_than_its_encoder_sees() -> None:
    axis = axis_of("maxwell")
    for name in ("square_current_1", "moves_2", "freewheel_2"):
        mode = mode_of(axis, name)
        runs = [simulate(axis, mode, substeps=k) for k in (axis.substeps, 2 * axis.substeps)]
        assert np.abs(runs[0].y - runs[1].y).max() < axis.measurement.position_resolution_m


@pytest.mark.parametrize("kind", AXES)
def test_keys_state_the_parameters_in_the_axis_own_units(kind: AxisKind) -> None:
    axis = axis_of("lugre", kind)
    known = truth(axis)
    run = simulate(axis, mode_of(axis, "sine_position_1"))
    if kind == "phase":
        assert run.currents.shape[0] == 3 and "commutation_offset" in known
        return
    assert run.currents.shape[0] == 1 and known["force_constant"] > 0
    radius = axis.radius_m if kind == "q_rotary" else 1.0
    # m y'' + R = K i_q in metres, J phi'' + M = K i_q in radians: the same thrust from the same current.
    assert run.thrust * radius == pytest.approx(known["force_constant"] * run.currents[0], rel=1e-9, abs=1e-9)
    assert known["mass"] == pytest.approx(axis.mass_kg * radius**2)
    assert known["coulomb_force"] / known["mass"] == pytest.approx(
        axis.friction.coulomb_force_n / axis.mass_kg / radius
    )
    if kind == "q_rotary":
        pairs = axis.motor.electrical_wavenumber_per_m * axis.radius_m
        assert pairs == pytest.approx(round(pairs)) and 2 <= round(pairs) <= 6
    assert thrust_per_ampere(axis) == pytest.approx(thrust_per_ampere(draw_axis("axis", np.random.default_rng(3))))
