"""What effects cost under a drive, and what a feed-forward saves: closed forms, and intervals that hold the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.compensation import compensation
from linid.diagnosis.compensation_data import Compensation
from linid.diagnosis.drive_courses import moves, usual_drive
from linid.diagnosis.parameter_draws import DRAWS, draws_of
from linid.export.target import reshaped
from linid.identification.result import FitResult
from linid.interface.compensation import exported_feed_forward
from linid.physics.model import Model
from linid.recording import Recording
from linid.simulation.controller import Controller
from tests.diagnosis.machine import MASS, VISCOUS, K, result

T = np.arange(1501) * 1e-3
KV, KP = 60.0, 20.0  # velocity loop of 300 rad/s
SPEED, PUSH = 0.2, 3.0  # m/s, N
NO_FRICTION = {"coulomb_force": 1e-12, "static_force": 1e-12, "bristle_stiffness": 1.0, "bristle_damping": 0.0}
PROPORTIONAL = Controller(
    position_gain_per_s=KV,
    velocity_gain_a_s_per_m=KP,
    velocity_integral_time_s=None,
    current_limit_a=1e6,
    current_time_constant_s=0.0,
    cycle_time_s=2.5e-4,
)
COGGING = {"cogging_wavenumber": 200.0, "cogging_order_1": 1.0, "cogging_sine_1": 2.0}
FRICTION = {"bristle_stiffness": 1e4, "bristle_damping": 100.0, "coulomb_force": 1.5, "static_force": 2.0}


def axis(effects: tuple[str, ...] = (), **values: float) -> FitResult:
    return reshaped(result(), effects=effects, values=values)


def driven(reference: np.ndarray | None, y: np.ndarray | None = None) -> Recording:
    y = np.zeros_like(T) + SPEED * T if y is None else y
    current = 0.5 * np.sin(20.0 * T)
    return Recording("run", T, y, drive_input=current, reference=reference, split="held_out", number=1)


RAMP = driven(SPEED * T)
TO_AND_FRO = driven(0.05 * np.sin(2.0 * np.pi * T) ** 3, 0.05 * np.sin(2.0 * np.pi * T) ** 3)


def compensated(
    before: FitResult, after: FitResult, recording: Recording, controller: Controller | None, seed: int = 1
) -> Compensation:
    told = compensation(before, after, [recording], exported_feed_forward([recording]), controller, seed=seed)
    assert not told.refused
    return told


def test_a_steady_force_costs_what_the_gains_say() -> None:
    """Without integral part a force F needs a following error of F / (K Kp Kv)."""
    after = axis(("constant_force",), **NO_FRICTION, constant_force=-PUSH)
    told = compensated(axis(**NO_FRICTION), after, RAMP, PROPORTIONAL)
    per_force = 1.0 / (K * KP * KV)
    assert told.without.rms.value == pytest.approx((VISCOUS * SPEED + PUSH) * per_force, rel=1e-5)
    assert told.without.largest.value == pytest.approx((VISCOUS * SPEED + PUSH) * per_force, rel=1e-4)
    assert told.base.rms.value == pytest.approx(PUSH * per_force, rel=1e-5)
    assert told.full.rms.value < 1e-5 * told.without.rms.value
    (one,) = told.effects
    assert one.cost.value == pytest.approx(PUSH * per_force, rel=1e-5)
    assert one.held and one.saved.value == pytest.approx(PUSH * per_force, rel=1e-5)
    assert told.draws == 0 and np.isnan(one.cost.low)  # nothing tells a covariance


def test_with_the_drive_cycle_a_perfect_feed_forward_leaves_nothing() -> None:
    """The force of a cycle is that of its beginning: half a cycle of the current's rate is off, of first order."""
    model = axis(**NO_FRICTION)
    cycles = np.array([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    left = []
    for cycle in cycles:
        drive = PROPORTIONAL.model_copy(update={"cycle_time_s": float(cycle)})
        told = compensated(model, model, TO_AND_FRO, drive)
        left.append(told.full.rms.value / told.without.rms.value)
    assert np.polyfit(np.log(cycles), np.log(left), 1)[0] == pytest.approx(1.0, abs=0.1)
    assert left[-1] < 0.01


def test_cogging_is_saved_and_what_no_force_mends_is_said() -> None:
    effects = ("cogging", "input_delay", "encoder_periodic_error")
    unmended = {"input_delay": 1e-3, "encoder_period": 7e-3, "encoder_sine_1": 1e-6}
    told = compensated(axis(**FRICTION), axis(effects, **FRICTION, **COGGING, **unmended), TO_AND_FRO, None)
    by_name = {one.effect: one for one in told.effects}
    cogging = by_name["cogging"]
    assert cogging.cost.value > 1e-7  # errors add as squares, and friction's is far larger
    assert cogging.saved.value > 0.7 * (told.base.rms.value - told.full.rms.value) > 1e-6
    for name, word in (("input_delay", "lag"), ("encoder_periodic_error", "reading")):
        assert not by_name[name].held and np.isnan(by_name[name].saved.value) and word in by_name[name].reason


def uncertain(truth: FitResult, seed: int, shrunk: float = 1.0) -> FitResult:
    """What a fit could have found: estimates off by their own covariance. shrunk: factor on what it says of it."""
    names = ("mass", "viscous_friction", "cogging_sine_1", "coulomb_force")
    deviation = np.array([0.03, 0.1, 0.15, 0.08]) * [abs(truth.value(name)) for name in names]
    shift = deviation * np.random.default_rng(seed).standard_normal(len(names))
    values = {e.name: e.value for e in truth.estimates}
    values |= {name: values[name] + d for name, d in zip(names, shift, strict=True)}
    found = reshaped(truth, values=values)
    return replace(found, fitted=names, covariance=np.diag((shrunk * deviation) ** 2))


@pytest.mark.parametrize(("shrunk", "least", "most"), [(1.0, 10, 12), (0.1, 0, 6)])
def test_the_interval_holds_the_true_axis_under_the_estimated_feed_forward(
    shrunk: float, least: int, most: int
) -> None:
    """Nineteen in twenty of what other estimates would give; with a covariance too small by far it does not."""
    truth, base = axis(("cogging",), **FRICTION, **COGGING), axis(**FRICTION)
    held = 0
    for seed in range(12):
        found = uncertain(truth, seed, shrunk)
        told = compensated(base, found, TO_AND_FRO, PROPORTIONAL, seed=seed)
        assert told.draws == DRAWS and told.seed == seed
        real = compensated(found, truth, TO_AND_FRO, PROPORTIONAL).base.rms.value
        held += told.full.rms.low <= real <= told.full.rms.high
    assert least <= held <= most


def test_draws_have_the_covariance_and_stay_within_bounds() -> None:
    truth = axis(("cogging",), **FRICTION, **COGGING)
    names = ("mass", "viscous_friction")
    covariance = np.array([[0.01, 0.018], [0.018, 0.04]])
    model = Model("force", ("cogging",))
    rows = []
    for seed in range(40):
        drawn = draws_of(replace(truth, fitted=names, covariance=covariance), model, 0.0, seed)
        rows += [[one[name] for name in names] for one in drawn]
    np.testing.assert_allclose(np.cov(np.array(rows).T), covariance, rtol=0.12)
    wide = draws_of(replace(truth, fitted=("mass",), covariance=np.array([[1e4]])), model, 0.0, 1)
    (mass,) = [p for p in model.parameters if p.name == "mass"]
    assert all(mass.lower <= one["mass"] <= mass.upper for one in wide)


def test_waves_of_unknown_length_keep_their_size_where_the_recordings_are() -> None:
    """Known to a twentieth about y = 0.5 m, but turned by a radian there, counted from zero: lines do not follow."""
    order, wavenumber, middle, size = 2.0, 200.0, 0.5, 2.0
    model = Model("force", ("cogging",))
    phase = order * wavenumber * middle + 0.3
    values = {"cogging_wavenumber": wavenumber, "cogging_order_1": order}
    values |= {"cogging_sine_1": size * np.cos(phase), "cogging_cosine_1": size * np.sin(phase)}
    names = ("cogging_wavenumber", "cogging_sine_1", "cogging_cosine_1")
    # By hand: S = A cos p, C = A sin p, where p = p_0 - n k y_0 keeps the wave at the middle as k moves.
    turn = -order * middle
    moves_of = np.array(
        [
            [1.0, -size * np.sin(phase) * turn, size * np.cos(phase) * turn],
            [0.0, np.cos(phase), np.sin(phase)],
            [0.0, -size * np.sin(phase), size * np.cos(phase)],
        ]
    )
    covariance = moves_of.T @ np.diag([1.0**2, 0.1**2, 0.05**2]) @ moves_of
    found = replace(axis(("cogging",), **values), fitted=names, covariance=covariance)

    def at_middle(one: dict[str, float]) -> complex:
        angle = order * one["cogging_wavenumber"] * middle
        return complex(complex(one["cogging_cosine_1"], one["cogging_sine_1"]) * np.exp(-1j * angle))

    whole = {e.name: e.value for e in found.estimates}
    ratios = [at_middle(one) / at_middle(whole) for one in draws_of(found, model, middle, 3)]
    assert np.std(np.abs(ratios)) == pytest.approx(0.05, rel=0.3)
    assert np.std(np.angle(ratios)) == pytest.approx(0.05, rel=0.3)
    astray = [abs(at_middle(one) / at_middle(whole)) for one in draws_of(found, model, 0.0, 3)]
    assert np.std(astray) > 0.2


def test_only_ratios_count_where_no_recording_tells_the_mass() -> None:
    """All forces and the mass divided by the mass: the same following errors."""
    effects = ("cogging",)
    whole = axis(effects, **FRICTION, **COGGING)
    forces = ("mass", "force_constant", "coulomb_force", "static_force", "viscous_friction", "cogging_sine_1")
    forces += ("bristle_stiffness", "bristle_damping")
    values = {e.name: e.value for e in whole.estimates}
    per_mass = reshaped(whole, values=values | {name: values[name] / MASS for name in forces})
    one = compensated(axis(**FRICTION), whole, TO_AND_FRO, None)
    other = compensated(axis(**FRICTION), replace(per_mass, per_mass=True), TO_AND_FRO, None)
    assert other.full.rms.value == pytest.approx(one.full.rms.value, rel=1e-6)
    assert other.effects[0].cost.value == pytest.approx(one.effects[0].cost.value, rel=1e-6)


def test_the_default_drive_has_the_same_loops_on_every_axis() -> None:
    values = {e.name: e.value for e in result().estimates}
    heavy = usual_drive(Model("force"), values | {"mass": 50.0, "force_constant": -80.0})
    assert heavy.velocity_gain_a_s_per_m * 80.0 / 50.0 == pytest.approx(
        usual_drive(Model("force"), values).velocity_gain_a_s_per_m * K / MASS
    )


@pytest.mark.parametrize(("speed", "acceleration"), [(0.5, 100.0), (5.0, 10.0), (0.01, 0.5)])
def test_moves_keep_to_travel_speed_and_acceleration(speed: float, acceleration: float) -> None:
    t, y = moves(-0.1, 0.3, speed, acceleration)
    v = np.gradient(y, t)
    a = np.gradient(v, t)
    assert y.min() >= -0.1 and y.max() <= 0.3 and t[-1] < 9.0
    assert max(np.abs(v).max() / speed, np.abs(a).max() / acceleration) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("model", "recording", "controller", "word"),
    [
        (reshaped(replace(result(), model="friction")), RAMP, None, "no motor"),
        (replace(result(), input_unit="V"), RAMP, PROPORTIONAL, "in V"),
        (result(), replace(RAMP, kind="free_wheel"), None, "no driven recording"),
        (result(), RAMP, PROPORTIONAL.model_copy(update={"velocity_gain_a_s_per_m": 1e6}), "does not follow"),
    ],
)
def test_where_there_is_no_figure_the_reason_is_said(
    model: FitResult, recording: Recording, controller: Controller | None, word: str
) -> None:
    told = compensation(model, model, [recording], exported_feed_forward([recording]), controller)
    assert word in told.refused and told.controller is None and not told.effects
