"""A motor driven by phase voltages: against a tight reference, its order, its power balance, its limits."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from linid.errors import UsageError
from linid.physics.electrical import SEPARATE, STAR, WEIGHTS, clarke, current_weights, phases, phi_functions
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.reference import motor_force
from linid.simulation.run import Simulator, whole_recordings
from linid.simulation.voltage_reference import DrivenByVoltage, simulate_voltage_reference
from tests.compiled_motor import constants

FRICTION = {
    "coulomb_force": 1.72,
    "static_force": 3.198,
    "stribeck_velocity": 2.993e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 11690.0,
    "bristle_damping": 92.14,
    "viscous_friction": 2.517,
    "mass": 0.588,
}
SINE = {
    "force_constant": 30.0,
    "electrical_wavenumber": 222.0,
    "winding_displacement": 2.0 * math.pi / 3.0,
    "commutation_offset": 0.4,
}
THETA = {
    "force_constant": 7.75,
    "electrical_wavenumber": 111.0,
    "winding_displacement": math.pi / 3.0,
    "commutation_offset": 0.2,
    "winding_length": 0.688,
    "nome": 0.493,
}
WINDINGS = {"phase_resistance": 5.0, "phase_inductance": 1.7e-3, "mutual_inductance": -4e-4}
MOTORS = {"sine": SINE, "theta": THETA}
START = (0.0, 0.0, 0.0)
DURATION = 2.0


def values(kind: str, **changes: float) -> dict[str, float]:
    return {**FRICTION, **MOTORS[kind], **WINDINGS, **changes}


def voltages(t: np.ndarray, kind: str) -> np.ndarray:
    """Voltages that carry the forcer to and fro: commutated along a planned path, with a common part."""
    path = 0.12 * np.sin(1.5 * np.pi * t) ** 2
    speed = np.gradient(path, t)
    angle = 222.0 * path + (SINE["commutation_offset"] if kind == "sine" else 2.0 * THETA["commutation_offset"])
    push = 0.35 * np.cos(3.0 * np.pi * t) * 5.0
    rows = [
        (push + 30.0 * speed) * np.sin(angle + (j - 2) * 2.0 * np.pi / 3.0) + 0.4 * np.sin(9.0 * t) for j in (1, 2, 3)
    ]
    return np.array(rows)


def recording(kind: str, period: float = 1e-3) -> Recording:
    t = np.arange(round(DURATION / period) + 1) * period
    return Recording("run", t, np.zeros_like(t), phase_voltages=voltages(t, kind))


@cache
def reference(kind: str, winding: str) -> DrivenByVoltage:
    return simulate_voltage_reference(kind, winding, values(kind), recording(kind), START, (0.0, 0.0, 0.0))


def simulate(
    kind: str,
    winding: str,
    substeps: int,
    one: Recording | None = None,
    settled: bool = False,
    effects: tuple[str, ...] = (),
    **changes: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and currents by the compiled simulation; settled: from the currents of the first voltages."""
    one = one or recording(kind)
    model = Model(kind, effects, winding)
    inputs = pack_inputs([one], voltages=True)
    params = model.vector(values(kind, **changes))[None, :]
    y, v, i, _ = Simulator(model, inputs, substeps).run_by_voltage(
        params, whole_recordings(inputs), np.array([[START]]), np.full((1, 1, 3), np.nan if settled else 0.0)
    )
    return y[0], v[0], i[0]


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


cases = pytest.mark.parametrize(
    ("kind", "winding"), [("sine", STAR), ("sine", SEPARATE), ("theta", STAR), ("theta", SEPARATE)]
)


def test_friction_under_load_answers_to_the_currents_that_flow() -> None:
    """Driven by the currents that the voltages bring forth, the axis moves the same way, until it falls out of step."""
    effects, friction = ("load_dependent_friction",), {"load_friction": 0.15}
    one, soon = recording("sine", 1e-4), slice(0, 2000)
    y, _, i = simulate("sine", STAR, 4, one, effects=effects, **friction)
    base = simulate("sine", STAR, 4, one)[0]
    driven = replace(one, phase_voltages=None, phase_currents=i)
    model, inputs = Model("sine", effects), pack_inputs([driven])
    params = model.vector(values("sine", **friction))[None, :]
    again = Simulator(model, inputs, 4).run(params, whole_recordings(inputs), np.array([[START]]))[0][0]
    assert np.max(np.abs(again - y)[soon]) < 1e-3 * np.max(np.abs(y - base)[soon])
    fine = simulate("sine", STAR, 16, effects=effects, **friction)[0]
    errors = [rms(simulate("sine", STAR, k, effects=effects, **friction)[0] - fine) for k in (2, 4)]
    assert errors[0] < 2e-6 and errors[1] < 0.3 * errors[0]


@cases
def test_against_the_reference(kind: str, winding: str) -> None:
    """Two seconds over eighty poles: a tenth of a milliampere and a micrometre."""
    exact = reference(kind, winding)
    assert np.ptp(exact.y) > 0.05 and np.max(np.abs(exact.v)) > 0.2
    y, _, i = simulate(kind, winding, 2)
    assert np.max(np.abs(i - exact.currents)) < 1e-4
    assert np.max(np.abs(y - exact.y)) < 1e-6


def test_strong_coupling_of_motion_and_currents() -> None:
    """A light forcer with many newtons per ampere: its back-EMF turns the currents within a fraction of a step."""
    changes = {"force_constant": 120.0, "mass": 0.1, "phase_inductance": 5e-4}
    t = np.arange(301) * 1e-3
    path = 0.02 * np.sin(5.0 * np.pi * t) ** 2
    push = 120.0 * np.gradient(path, t) + 0.2 * np.sin(10.0 * np.pi * t)
    rows = [push * np.sin(222.0 * path + SINE["commutation_offset"] + (j - 2) * 2.0 * np.pi / 3.0) for j in (1, 2, 3)]
    one = Recording("light", t, np.zeros_like(t), phase_voltages=np.array(rows))
    exact = simulate_voltage_reference("sine", STAR, values("sine", **changes), one, START, (0.0, 0.0, 0.0))
    y, _, i = simulate("sine", STAR, 2, one, **changes)
    assert np.ptp(exact.y) > 0.01
    assert np.max(np.abs(i - exact.currents)) < 2e-3
    assert np.max(np.abs(y - exact.y)) < 1e-6


def test_second_order_at_least_in_the_step() -> None:
    exact = reference("sine", STAR)
    errors = [float(np.max(np.abs(simulate("sine", STAR, n)[2] - exact.currents))) for n in (1, 2, 4)]
    assert errors[1] < errors[0] / 3.0 and errors[2] < errors[1] / 3.0, errors


@cases
def test_electrical_input_is_copper_loss_work_and_stored_energy(kind: str, winding: str) -> None:
    """To a millionth, in the reference and in the compiled run (there by quadrature of its own samples)."""
    exact = reference(kind, winding)
    rest = exact.electrical - exact.copper - exact.mechanical - exact.stored
    assert np.max(np.abs(rest)) < 1e-6 * exact.electrical[-1]
    fine = recording(kind, 5e-5)
    y, v, i = simulate(kind, winding, 2, fine)
    emf = np.array([[motor_force(kind, values(kind), x, unit) for x in y] for unit in np.eye(3)])
    assert fine.phase_voltages is not None
    resistance, inductance = WINDINGS["phase_resistance"], WINDINGS["phase_inductance"]
    mutual = WINDINGS["mutual_inductance"] if winding == SEPARATE else 0.0
    dt = fine.t[1]
    power = np.sum(fine.phase_voltages * i, axis=0) - resistance * np.sum(i**2, axis=0) - np.sum(emf * i, axis=0) * v
    matrix = (inductance - mutual) * np.eye(3) + mutual
    stored = 0.5 * np.einsum("in,ij,jn->n", i, matrix, i)
    flown = dt / 3.0 * (power[0] + 4.0 * power[1:-1:2].sum() + 2.0 * power[2:-1:2].sum() + power[-1])
    taken = float(np.sum(np.abs(np.sum(fine.phase_voltages * i, axis=0))) * dt)
    assert abs(flown - stored[-1]) < 1e-6 * taken


def test_currents_of_a_star_sum_to_zero_and_a_common_voltage_is_lost_on_it() -> None:
    one = recording("sine")
    assert one.phase_voltages is not None
    lifted = replace(one, phase_voltages=one.phase_voltages + 3.0 * np.cos(40.0 * one.t))
    first, second = simulate("sine", STAR, 2, one), simulate("sine", STAR, 2, lifted)
    assert np.max(np.abs(first[2].sum(axis=0))) < 1e-12
    assert np.max(np.abs(first[0] - second[0])) < 1e-9
    separate = simulate("sine", SEPARATE, 2, lifted)[2]
    assert np.max(np.abs(separate.sum(axis=0))) > 0.1


def test_a_locked_motor_is_a_resistance_and_an_inductance() -> None:
    """Closed form: i = U/R (1 - exp(-t R/L)), with the space vector's and the mean's own inductance."""
    t = np.arange(201) * 1e-4
    steps = np.array([[2.0], [-0.5], [1.0]]) * np.ones_like(t)
    one = Recording("locked", t, np.zeros_like(t), phase_voltages=steps)
    _, _, i = simulate("sine", SEPARATE, 1, one, mass=1e10)
    resistance, inductance, mutual = WINDINGS.values()
    space = np.array(clarke(2.0, -0.5, 1.0)) / resistance
    rise, slow = (1.0 - np.exp(-t * resistance / x) for x in (inductance - mutual, inductance + 2.0 * mutual))
    exact = np.array([phases(space[0] * a, space[1] * a, space[2] * b) for a, b in zip(rise, slow, strict=True)]).T
    assert np.max(np.abs(i - exact)) < 1e-8


def test_currents_that_are_not_given_are_those_of_the_long_run() -> None:
    one = recording("sine")
    model = Model("sine", (), STAR)
    inputs = pack_inputs([one], voltages=True)
    params = model.vector(values("sine"))[None, :]
    _, _, i, _ = Simulator(model, inputs, 2).run_by_voltage(
        params, whole_recordings(inputs), np.array([[START]]), np.full((1, 1, 3), np.nan)
    )
    assert one.phase_voltages is not None
    first = one.phase_voltages[:, 0]
    assert i[0, :, 0] == pytest.approx((first - first.mean()) / WINDINGS["phase_resistance"])


def test_a_free_wheel_has_open_windings() -> None:
    t = np.arange(301) * 1e-3
    wheel = Recording("wheel", t, np.zeros_like(t), kind="free_wheel", phase_voltages=np.ones((3, t.size)))
    assert not pack_inputs([wheel], voltages=True).powered[0]


@pytest.mark.parametrize(("inductance", "allowed"), [(1e-6, 1e-3), (1e-2, 1e-4)])
def test_any_electrical_time_constant_is_carried(inductance: float, allowed: float) -> None:
    """A microhenry forgets within a thousandth of a step, ten millihenry rule the motion: both agree with scipy."""
    changes = {"phase_inductance": inductance, "mutual_inductance": 0.0}
    one = recording("sine")
    assert one.phase_voltages is not None
    first = (one.phase_voltages[:, 0] - one.phase_voltages[:, 0].mean()) / WINDINGS["phase_resistance"]
    exact = simulate_voltage_reference("sine", STAR, values("sine", **changes), one, START, tuple(first), rtol=1e-9)
    y, _, i = simulate("sine", STAR, 2, settled=True, **changes)
    assert np.max(np.abs(i - exact.currents)) < allowed
    assert np.max(np.abs(y - exact.y)) < 3e-6


def test_weights_are_exact_for_parabolas_and_phi_is_its_integral() -> None:
    from scipy.integrate import quad

    for z in (0.0, 1e-7, 0.0199, 0.0201, 0.5, 40.0):
        for k, found in enumerate(phi_functions(z)):
            integral = quad(lambda s, z=z, k=k: math.exp(-z * (1 - s)) * s**k / math.factorial(k), 0.0, 1.0)[0]
            assert found == pytest.approx(integral, rel=1e-10)
    resistance, inductance, h = 5.0, 1.7e-3, 5e-4
    weights = np.zeros(WEIGHTS)
    current_weights(resistance, inductance, h, weights)

    decay = resistance / inductance

    def pushed(t: float) -> float:
        return 3.0 + 2e3 * t - 5e6 * t * t

    for end, row in ((h, weights[:4]), (0.5 * h, weights[4:])):
        grown = quad(lambda t, end=end: math.exp(-decay * (end - t)) * pushed(t) / inductance, 0.0, end)[0]
        exact = 0.4 * math.exp(-decay * end) + grown
        assert row @ [0.4, pushed(0.0), pushed(0.5 * h), pushed(h)] == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("nome", [0.1, 0.493, 0.93])
def test_phase_constants_are_the_thrust_of_single_phases(nome: float) -> None:
    for kind, own in (("sine", SINE), ("theta", {**THETA, "nome": nome})):
        for y in (0.0, 0.003, 0.0111):
            found = constants(kind, own, y)
            exact = [motor_force(kind, {**FRICTION, **own}, y, unit) for unit in np.eye(3)]
            assert found == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_only_motors_with_phases_have_windings() -> None:
    with pytest.raises(UsageError, match="cannot be driven by voltages"):
        Model("force", (), STAR)
    with pytest.raises(UsageError, match="cannot be driven by voltages"):
        Model("sine", (), "triangle")
    assert [p.name for p in Model("sine", (), STAR).parameters][4:6] == ["phase_resistance", "phase_inductance"]
