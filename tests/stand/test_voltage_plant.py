"""The stand under imposed voltages: against scipy, closed forms, its energies, and `linid simulate`'s own kernel."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from linid.errors import ConfigError
from linid.physics.electrical import STAR
from linid.physics.model import Model
from linid.recording.campaign import read_campaign
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.stand.description import AxisDescription, load_axis_description
from linid.stand.export import write_campaign
from linid.stand.generate import generate
from linid.stand.layouts import LAYOUTS
from linid.stand.mode_descriptions import SineVoltage, SquareVoltage
from linid.stand.modes import command, loop_times, voltage_wave
from linid.stand.voltage_plant import VoltageRun, simulate_by_voltage
from tests.stand.printed_friction import printed_friction

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "stand_by_voltage.yaml"
THETA = {
    "kind": "theta",
    "force_constant_n_per_a": 7.75,
    "electrical_wavenumber_per_m": 111.0,
    "winding_displacement_rad": 0.9,
    "commutation_offset_rad": 0.768,
    "winding_length_rad": 0.688,
    "nome": 0.493,
}
PHASES = (1.0, -0.7, 0.2)
cases = pytest.mark.parametrize(
    ("motor", "connection", "phases"),
    [("sine", "star", None), ("sine", "separate", PHASES), ("theta", "star", PHASES), ("theta", "separate", None)],
)


def described(motor: str = "sine", connection: str = "star", mutual: float = -3e-4, **changes: Any) -> AxisDescription:
    base = load_axis_description(CONFIG).model_dump()
    base["winding"] |= {"connection": connection, "mutual_inductance_h": mutual}
    if motor == "theta":
        base["motor"] = THETA
    return AxisDescription.model_validate(base | changes)


def sine(phases: tuple[float, float, float] | None = None, **changes: Any) -> SineVoltage:
    common: dict[str, Any] = {"duration_s": 0.4, "start_position_m": 0.39, "amplitude_v": 12.0, "frequency_hz": 4.0}
    return SineVoltage(name="s", mode="sine_voltage", phases=phases, **(common | {"fade_s": 0.1} | changes))


def square(phases: tuple[float, float, float] | None = None, **changes: Any) -> SquareVoltage:
    common: dict[str, Any] = {"duration_s": 0.4, "start_position_m": 0.39, "amplitude_v": 8.0, "frequency_hz": 8.0}
    return SquareVoltage(name="q", mode="square_voltage", phases=phases, **(common | changes))


def inductances(axis: AxisDescription) -> np.ndarray:
    assert axis.winding is not None
    mutual = axis.winding.mutual_inductance_h
    return np.full((3, 3), mutual) + (axis.winding.inductance_h - mutual) * np.eye(3)


def field(motor: Any, y: float) -> np.ndarray:
    """Thrust per ampere of each phase, by the sine or by the differences of Jacobi's theta functions as sums."""
    out = []
    for j in (-1, 0, 1):
        z = motor.electrical_wavenumber_per_m * y + motor.winding_displacement_rad * j + motor.commutation_offset_rad
        if motor.kind == "sine":
            out.append(motor.force_constant_n_per_a * math.sin(z))
            continue

        def theta(x: float) -> float:
            orders = range(1, 12)
            third = 1 + 2 * sum(motor.nome ** (n * n) * math.cos(2 * n * x) for n in orders)
            moved = 1 + 2 * sum(motor.nome ** (n * n) * math.cos(2 * n * (x - math.pi / 2)) for n in orders)
            return third - moved

        apart = theta(z - motor.winding_length_rad) - theta(z + motor.winding_length_rad)
        out.append(motor.force_constant_n_per_a * apart)
    return np.array(out)


def integrated(axis: AxisDescription, mode: SineVoltage | SquareVoltage, t: np.ndarray) -> np.ndarray:
    """States y, v, w, I_1 to I_3 at t by scipy from (31), (39), (41) to (45), restarted where a square wave steps."""
    assert axis.winding is not None
    friction, winding, motor = axis.friction, axis.winding, axis.motor
    inverse = np.linalg.inv(inductances(axis))
    turn = 1.0 if motor.kind == "sine" else 2.0
    omega, shift = turn * motor.electrical_wavenumber_per_m, turn * motor.commutation_offset_rad

    def rates(instant: float, s: np.ndarray, level: float | None) -> np.ndarray:
        y, v, w, currents = s[0], s[1], s[2], s[3:]
        if level is None:
            assert isinstance(mode, SineVoltage)
            r = min(instant / mode.fade_s, 1.0)
            level = (
                mode.amplitude_v * (10 * r**3 - 15 * r**4 + 6 * r**5) * math.sin(math.tau * mode.frequency_hz * instant)
            )
        turning = [math.sin(omega * y + shift + math.tau / 3 * j) for j in (-1, 0, 1)]
        constants = field(motor, y)
        drop = level * np.array(mode.phases or turning) - constants * v - winding.resistance_ohm * currents
        if winding.connection == "star":  # the neutral takes the potential at which the currents' rates sum to zero
            drop = drop - (inverse @ drop).sum() / inverse.sum()
        w_rate, resist = printed_friction(friction, v, w)
        push = float(constants @ currents) - resist
        return np.concatenate([[v, push / (axis.mass_kg + mode.added_mass_kg), w_rate], inverse @ drop])

    edges = [0.0, float(t[-1])]
    levels: list[float | None] = [None]
    if isinstance(mode, SquareVoltage):
        times = loop_times(mode, axis)
        first, _ = voltage_wave(mode, times)
        changes = [0, *(np.flatnonzero(np.diff(first)) + 1)]
        edges = [float(times[k]) for k in changes if times[k] < t[-1]] + [float(t[-1])]
        levels = [float(first[k]) for k in changes]
    state = np.array([mode.start_position_m, 0.0, 0.0, 0.0, 0.0, 0.0])
    rows = [state[:, None]]
    for (a, b), level in zip(pairwise(edges), levels, strict=False):
        here = t[(t > a + 1e-12) & (t <= b + 1e-12)]
        done = solve_ivp(
            rates, (a, b), state, "LSODA", t_eval=np.append(here[here < b], b), args=(level,), rtol=1e-10,
            atol=[1e-12, 1e-10, 1e-13, 1e-10, 1e-10, 1e-10], max_step=1e-3,
        )  # fmt: skip
        assert done.success
        state = done.y[:, -1]
        rows.append(done.y[:, : here.size] if here.size else done.y[:, :0])
    return np.concatenate(rows, axis=1)


@cases
@pytest.mark.parametrize("make", [sine, square])
def test_motion_and_currents_are_those_of_the_equations(
    make: Any, motor: str, connection: str, phases: tuple[float, float, float] | None
) -> None:
    axis, mode = described(motor, connection), make(phases)
    run = simulate_by_voltage(axis, mode)
    exact = integrated(axis, mode, run.t)
    assert np.ptp(run.y) > 2e-3 and np.max(np.abs(run.phase_currents)) > 0.05
    np.testing.assert_allclose(run.y, exact[0], atol=2e-8)
    np.testing.assert_allclose(run.phase_currents, exact[3:], atol=2e-6 * np.max(np.abs(exact[3:])) + 1e-6)


def energies(axis: AxisDescription, run: VoltageRun) -> tuple[np.ndarray, np.ndarray]:
    """Imbalance of the circuit and of the forcer in J at each logged instant."""
    friction = axis.friction
    stored = 0.5 * np.einsum("jn,jk,kn->n", run.phase_currents, inductances(axis), run.phase_currents)
    moving = 0.5 * axis.mass_kg * run.v**2 + 0.5 * friction.bristle_stiffness_n_per_m * run.w**2
    return run.supplied - run.heat - run.work - stored, run.work - run.loss - moving


@cases
def test_electrical_energy_becomes_heat_field_and_work_and_work_becomes_motion_and_friction(
    motor: str, connection: str, phases: tuple[float, float, float] | None
) -> None:
    axis = described(motor, connection)
    for mode in (sine(phases, duration_s=1.0), square(phases, duration_s=1.0)):
        run = simulate_by_voltage(axis, mode)
        circuit, forcer = energies(axis, run)
        assert run.work[-1] > 1e-3 * run.supplied[-1] > 0.0
        assert np.max(np.abs(circuit)) < 1e-6 * run.supplied[-1]
        assert np.max(np.abs(forcer)) < 1e-5 * run.work[-1]


@pytest.mark.parametrize("connection", ["star", "separate"])
def test_a_held_forcer_is_a_resistance_and_an_inductance(connection: str) -> None:
    """Closed form of a step: U/R (1 - exp(-t R/L)), L - M for the vector, L + 2 M for the mean of the phases."""
    axis = described(connection=connection, mass_kg=1e9)
    mode = square(PHASES, duration_s=0.01, frequency_hz=1.0)
    run = simulate_by_voltage(axis, mode)
    shares = np.array(PHASES)
    mean = np.full(3, shares.mean()) * (connection == "separate")
    rise, slow = (-np.expm1(-run.t * 5.0 / x) for x in (1.7e-3 + 3e-4, 1.7e-3 - 6e-4))
    exact = 8.0 / 5.0 * (np.outer(shares - shares.mean(), rise) + np.outer(mean, slow))
    np.testing.assert_allclose(run.phase_currents, exact, atol=1e-8)
    np.testing.assert_allclose(run.phase_voltages[:, 3], 8.0 * (shares - (connection == "star") * shares.mean()))


def test_a_steady_vector_draws_the_forcer_to_its_pole() -> None:
    """At rest no force is left but the bristles': the field of the currents is in line with the magnets'."""
    axis = described()
    run = simulate_by_voltage(axis, square((1.0, -0.5, -0.5), duration_s=3.0, frequency_hz=0.05, amplitude_v=10.0))
    force = float(field(axis.motor, run.y[-1]) @ run.phase_currents[:, -1])
    largest = 1.5 * 30.0 * 10.0 / 5.0
    assert abs(run.v[-1]) < 1e-5 and run.phase_currents[:, -1] == pytest.approx([2.0, -1.0, -1.0], abs=1e-4)
    assert abs(force) < axis.friction.static_force_n < 0.05 * largest
    assert abs(run.y[-1] - 0.39) < math.pi / 222.0


def test_the_wave_is_held_or_goes_straight() -> None:
    axis = described()
    t = loop_times(sine(), axis)
    first, last = voltage_wave(sine(fade_s=0.0), t)
    np.testing.assert_array_equal(first[1:], last[:-1])
    np.testing.assert_allclose(first, 12.0 * np.sin(8.0 * math.pi * t[:-1]), atol=1e-12)
    first, last = voltage_wave(square(), t)
    np.testing.assert_array_equal(first, last)
    np.testing.assert_array_equal(first, 8.0 * np.where(np.floor(16.0 * t[:-1] + 0.5 + 1e-9) % 2, -1.0, 1.0))


@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_exports_log_voltages_and_currents(tmp_path: Path, layout: str) -> None:
    axis = load_axis_description(CONFIG)
    generated = generate(axis, seed=2, only=["square_voltage_1", "vector_1"])
    write_campaign(generated, tmp_path, layout)
    for read, written in zip(read_campaign(tmp_path / "campaign.yaml").recordings, generated.recordings, strict=True):
        assert read.kind == "motor" and read.phase_voltages is not None and written.phase_voltages is not None
        np.testing.assert_allclose(read.phase_voltages, written.phase_voltages, atol=1e-9)
        np.testing.assert_array_equal(read.phase_currents, written.phase_currents)
        exact = generated.exact[written.name]
        assert exact.voltages is not None
        assert np.std(read.phase_voltages - exact.voltages) == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize("name", ["sine_voltage_1", "vector_1"])
def test_the_simulation_by_voltage_moves_as_the_stand_does(name: str) -> None:
    """Two independent integrators; what is left is the spline through voltages logged at 1 kHz."""
    axis = load_axis_description(CONFIG)
    generated = generate(axis, seed=1, only=[name])
    exact, (recording,) = generated.exact[name], generated.recordings
    assert exact.voltages is not None
    model, inputs = (
        Model("sine", (), STAR),
        pack_inputs([replace(recording, phase_voltages=exact.voltages)], voltages=True),
    )
    start = np.array([[[exact.y[0], 0.0, 0.0]]])
    y, _, currents, _ = Simulator(model, inputs, 4).run_by_voltage(
        model.vector(generated.truth)[None], whole_recordings(inputs), start, np.zeros((1, 1, 3))
    )
    assert np.max(np.abs(y[0] - exact.y)) < 2e-3 * np.ptp(exact.y)
    assert np.sqrt(np.mean((currents[0] - exact.currents) ** 2)) < 0.01 * np.max(np.abs(exact.currents))


def test_voltages_without_windings_or_with_long_steps_are_refused() -> None:
    with pytest.raises(ValidationError, match="sine_voltage_1 imposes voltages, which need a winding"):
        described().__class__.model_validate(load_axis_description(CONFIG).model_dump() | {"winding": None})
    slow = described().winding
    assert slow is not None
    with pytest.raises(ValidationError, match="a tenth of the windings' time constant"):
        described(winding=slow.model_dump() | {"inductance_h": 4e-4, "mutual_inductance_h": 0.0})


def test_voltages_that_bring_forth_too_much_current_are_refused() -> None:
    strong = square(amplitude_v=60.0, phases=(1.0, -0.5, -0.5)).model_dump()
    with pytest.raises(ConfigError, match=r"recording q: its voltages bring forth .* over the drive's limit of 4 A"):
        generate(described(campaign=[strong]), seed=1)
    with pytest.raises(ConfigError, match="imposed voltages"):
        command(square(), described())
