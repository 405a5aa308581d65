"""The generated voltages: their power balance, the currents that they drive, open windings, and their exports."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.recording.campaign import read_campaign
from linid.stand.description import AxisDescription, Winding
from linid.stand.export import read_truth, write_campaign
from linid.stand.generate import generate, resample_noise
from linid.stand.layouts import LAYOUTS
from linid.stand.measurement import measure_voltages
from linid.stand.modes import command
from linid.stand.plant import phase_constants, plant_parameters, simulate, thrust
from linid.stand.winding import phase_current_rates, phase_voltages

REPOSITORY = Path(__file__).resolve().parents[2]
THETA = {
    "kind": "theta",
    "force_constant_n_per_a": 7.75,
    "electrical_wavenumber_per_m": 111.0,
    "commutation_offset_rad": 0.768,
    "winding_displacement_rad": 0.9,
    "winding_length_rad": 0.688,
    "nome": 0.493,
}


def changed(description: AxisDescription, **values: Any) -> AxisDescription:
    return AxisDescription.model_validate(description.model_dump() | values)


def wound(connection: str, mutual: float = -3e-4) -> Winding:
    return Winding.model_validate(
        {"resistance_ohm": 5.0, "inductance_h": 1.7e-3, "mutual_inductance_h": mutual, "connection": connection}
    )


def matrix(winding: Winding) -> np.ndarray:
    """The inductance matrix in H."""
    mutual = winding.mutual_inductance_h
    return np.full((3, 3), mutual) + (winding.inductance_h - mutual) * np.eye(3)


@pytest.mark.parametrize("motor", ["sine", "theta"])
@pytest.mark.parametrize("connection", ["star", "separate"])
@pytest.mark.parametrize("name", ["sine_current_1", "sine_position_1", "moves_1"])
def test_electrical_energy_becomes_heat_field_and_work(
    voltage_stand: AxisDescription, motor: str, connection: str, name: str
) -> None:
    """Against the work that the integrator sums up, logged at every loop of 10 us: to 3e-6 of the energy supplied.

    What is left is the time by which logged currents lead their mean course; it goes with the loop period squared.
    """
    winding = wound(connection)
    fast = changed(
        voltage_stand,
        winding=winding.model_dump(),
        measurement=voltage_stand.measurement.model_dump() | {"sample_period_s": 1e-5},
        drive=voltage_stand.drive.model_dump() | {"loop_period_s": 1e-5},
        motor=voltage_stand.motor.model_dump() if motor == "sine" else THETA,
    )
    mode = next(mode for mode in fast.campaign if mode.name == name).model_copy(update={"duration_s": 1.0})
    run = simulate(fast, command(mode, fast), start_position=mode.start_position_m)
    voltages, currents = phase_voltages(winding, plant_parameters(fast), run), run.phase_currents

    def energy(power: np.ndarray) -> np.ndarray:
        return np.asarray(CubicSpline(run.t, power).antiderivative()(run.t))

    supplied = energy(np.sum(voltages * currents, axis=0))
    heat = energy(winding.resistance_ohm * np.sum(currents**2, axis=0))
    field = 0.5 * np.einsum("jn,jk,kn->n", currents, matrix(winding), currents)
    balance = supplied - heat - run.work - field + field[0]
    allowed = 3e-6 * supplied.max()
    assert min(run.work.max(), heat.max(), field.max()) > 10 * allowed
    assert np.max(np.abs(balance)) < allowed


def test_phase_constants_sum_up_to_the_thrust(voltage_stand: AxisDescription) -> None:
    parameters = plant_parameters(changed(voltage_stand, motor=THETA))
    y = np.linspace(0.1, 0.2, 50)
    angle = parameters.density * y + parameters.shift
    currents = parameters.polarity * 2.0 * np.stack([np.sin(angle + 2 * math.pi / 3 * j) for j in (-1, 0, 1)])
    summed = np.sum(phase_constants(y, parameters) * currents, axis=0)
    np.testing.assert_allclose(summed, [thrust(x, 2.0, parameters) for x in y], rtol=1e-12)
    sine = phase_constants(y, plant_parameters(voltage_stand))
    np.testing.assert_allclose(sine[2], -133.8 * np.sin(222.0 * y + 0.5368 + 1.936), rtol=1e-12)


def test_current_rates_are_the_slopes_of_the_currents(voltage_stand: AxisDescription) -> None:
    """Logged at every loop: central differences of period h are off by a part h^2 / (12 lag^2), as is the rate."""
    fast = changed(voltage_stand, measurement=voltage_stand.measurement.model_dump() | {"sample_period_s": 5e-5})
    mode = next(mode for mode in fast.campaign if mode.name == "moves_1").model_copy(update={"duration_s": 0.7})
    run = simulate(fast, command(mode, fast), start_position=mode.start_position_m)
    rates = phase_current_rates(plant_parameters(fast), run)
    slopes = np.gradient(run.phase_currents, run.t, axis=1)
    assert np.max(np.abs(rates)) > 50
    np.testing.assert_allclose(rates[:, 1:-1], slopes[:, 1:-1], atol=0.005 * np.max(np.abs(rates)))


@pytest.mark.parametrize("connection", ["star", "separate"])
@pytest.mark.parametrize("name", ["sine_current_1", "sine_position_1", "moves_1"])
def test_splined_voltages_drive_the_logged_currents(voltage_stand: AxisDescription, connection: str, name: str) -> None:
    """L I' = U - R I - e v along the exact motion, from a cubic spline of the voltages logged at 1 kHz."""
    winding = wound(connection)
    described = changed(voltage_stand, winding=winding.model_dump())
    motion = generate(described, seed=1, only=[name]).exact[name]
    assert motion.voltages is not None
    t = motion.t[:600]
    given = CubicSpline(motion.t, np.vstack([motion.voltages, motion.y, motion.v]), axis=1)
    parameters, inverse = plant_parameters(described), np.linalg.inv(matrix(winding))

    def rates(instant: float, currents: np.ndarray) -> np.ndarray:
        *voltages, y, v = given(instant)
        drop = voltages - phase_constants(np.array([y]), parameters)[:, 0] * v - winding.resistance_ohm * currents
        return inverse @ (drop - drop.mean() if connection == "star" else drop)

    driven = solve_ivp(rates, (0, t[-1]), motion.currents[:, 0], t_eval=t, rtol=1e-6, atol=1e-7, max_step=1e-3)
    largest = np.max(np.abs(motion.currents))
    assert largest > 0.09
    assert np.max(np.abs(driven.y - motion.currents[:, :600])) < 1e-3 * largest


@pytest.mark.parametrize("connection", ["star", "separate"])
def test_open_windings_show_their_back_emf(voltage_stand: AxisDescription, connection: str) -> None:
    described = changed(voltage_stand, winding=wound(connection).model_dump())
    generated = generate(described, seed=1, only=["freewheel_1"])
    motion, (recording,) = generated.exact["freewheel_1"], generated.recordings
    back_emf = phase_constants(motion.y, plant_parameters(described)) * motion.v
    if connection == "star":
        back_emf -= back_emf.mean(axis=0)
    np.testing.assert_allclose(motion.voltages, back_emf, atol=1e-13)
    assert recording.kind == "free_wheel" and recording.phase_currents is not None
    assert not recording.phase_currents.any() and np.max(np.abs(back_emf)) > 30


def test_star_voltages_sum_to_zero_and_separate_ones_do_not(voltage_stand: AxisDescription) -> None:
    sums = {}
    for connection in ("star", "separate"):
        described = changed(voltage_stand, winding=wound(connection).model_dump())
        voltages = generate(described, seed=1, only=["moves_1"]).exact["moves_1"].voltages
        assert voltages is not None
        sums[connection] = np.max(np.abs(voltages.sum(axis=0)))
    assert sums["star"] < 1e-12 and sums["separate"] > 100


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("layout", list(LAYOUTS))
@pytest.mark.parametrize("resolution", [0.0, 1e-3])
def test_every_layout_reads_back(
    voltage_stand: AxisDescription, tmp_path: Path, layout: str, mark: str, resolution: float
) -> None:
    measurement = voltage_stand.measurement.model_dump() | {"voltage_resolution_v": resolution}
    described = changed(voltage_stand, measurement=measurement)
    generated = generate(described, seed=3, only=["freewheel_3", "sine_current_2"])
    write_campaign(generated, tmp_path, layout, decimal_mark=mark)
    for read, written in zip(read_campaign(tmp_path / "campaign.yaml").recordings, generated.recordings, strict=True):
        assert (read.kind, read.notes) == (written.kind, ())
        assert written.phase_voltages is not None and read.phase_voltages is not None
        np.testing.assert_allclose(read.phase_voltages, written.phase_voltages, rtol=0, atol=0.6e-12)
        np.testing.assert_array_equal(read.phase_currents, written.phase_currents)


def test_the_whole_campaign_generates_and_tells_its_truth(voltage_stand: AxisDescription, tmp_path: Path) -> None:
    generated = generate(voltage_stand, seed=1)
    kinds = {(mode.mode, mode.split) for mode in voltage_stand.campaign}
    assert len(kinds) == 8
    assert generated.truth["phase_resistance"] == 5.0 and generated.truth["phase_inductance"] == 1.7e-3
    write_campaign(generated, tmp_path)
    assert read_truth(tmp_path) == generated.truth
    assert "connection: star" in (tmp_path / "truth.yaml").read_text()


def test_truth_of_the_inductance_is_what_the_connection_shows(voltage_stand: AxisDescription) -> None:
    def truth(connection: str) -> dict[str, float]:
        described = changed(voltage_stand, winding=wound(connection).model_dump())
        return generate(described, seed=1, only=["freewheel_1"]).truth

    assert truth("star")["phase_inductance"] == pytest.approx(2.0e-3) and "mutual_inductance" not in truth("star")
    assert (truth("separate")["phase_inductance"], truth("separate")["mutual_inductance"]) == (1.7e-3, -3e-4)


def test_a_winding_changes_nothing_else_that_is_logged(voltage_stand: AxisDescription, tmp_path: Path) -> None:
    names = ["freewheel_1", "sine_current_2"]
    write_campaign(generate(voltage_stand, seed=2, only=names), tmp_path / "with")
    write_campaign(generate(changed(voltage_stand, winding=None), seed=2, only=names), tmp_path / "without")
    for name in names:
        full = (tmp_path / "with" / f"{name}.csv").read_text().splitlines()
        bare = (tmp_path / "without" / f"{name}.csv").read_text().splitlines()
        assert [line.split(",")[:5] for line in full] == [line.split(",") for line in bare]
    assert "voltage" not in (tmp_path / "without" / "truth.yaml").read_text().split("seed")[1]


def test_the_stand_without_winding_is_written_as_before(stand: AxisDescription, tmp_path: Path) -> None:
    names = ["freewheel_1", "slow_ramp_1", "sine_current_1", "moves_1"]
    write_campaign(generate(stand, seed=1, only=names), tmp_path)
    folder = REPOSITORY / "data" / "stand"
    assert (tmp_path / "truth.yaml").read_bytes() == (folder / "truth.yaml").read_bytes()
    for name in names:
        ours, kept = [(place / f"{name}.csv").read_text().splitlines() for place in (tmp_path, folder)]
        assert (ours[0], len(ours)) == (kept[0], len(kept))
        # Another processor's rounding may move a quantised value by a step here and there.
        assert sum(a != b for a, b in zip(ours, kept, strict=True)) < 0.01 * len(kept)


def test_voltage_noise_and_resolution(voltage_stand: AxisDescription) -> None:
    exact = np.stack([math.sqrt(k) * 1e-4 * np.arange(100_000) for k in (2, 3, 5)])
    measurement = voltage_stand.measurement.model_copy(
        update={"voltage_resolution_v": 0.05, "voltage_noise_rms_v": 0.02}
    )
    logged = measure_voltages(exact, measurement, seed=1, index=0)
    np.testing.assert_allclose(logged * 20, np.round(logged * 20), atol=1e-8)
    # The standard error of an rms from N values is rms / sqrt(2 N) = 0.22 %; five of them.
    assert np.std(logged - exact) == pytest.approx(math.hypot(0.02, 0.05 / math.sqrt(12)), rel=0.011)
    np.testing.assert_array_equal(logged, measure_voltages(exact, measurement, seed=1, index=0))
    assert not np.array_equal(logged, measure_voltages(exact, measurement, seed=1, index=1))


def test_resampled_noise_also_moves_the_voltages(voltage_stand: AxisDescription) -> None:
    first = generate(voltage_stand, seed=1, only=["freewheel_1"])
    again, fresh = resample_noise(first, 7), generate(voltage_stand, seed=7, only=["freewheel_1"])
    np.testing.assert_array_equal(again.recordings[0].phase_voltages, fresh.recordings[0].phase_voltages)
    assert not np.array_equal(again.recordings[0].phase_voltages, first.recordings[0].phase_voltages)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("resistance_ohm", 0.0),
        ("inductance_h", -1e-3),
        ("mutual_inductance_h", 1.7e-3),
        ("mutual_inductance_h", -0.85e-3),
        ("connection", "delta"),
        ("turns", 100),
    ],
)
def test_windings_that_cannot_be_are_refused(key: str, value: object) -> None:
    with pytest.raises(ValidationError, match=key):
        Winding.model_validate(wound("star").model_dump() | {key: value})
