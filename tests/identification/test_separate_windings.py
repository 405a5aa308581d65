"""Separate windings: mutual inductance where the currents do not sum to zero, and no word on it where they do."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom

from linid.identification.fit import fit
from linid.identification.fit_windings import fit_windings
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.result import Estimate, FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.electrical import SEPARATE
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

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
MOTOR = {
    "force_constant": 30.0,
    "electrical_wavenumber": 222.0,
    "winding_displacement": 2.0 * math.pi / 3.0,
    "commutation_offset": 0.4,
}
WINDINGS = {"phase_resistance": 5.0, "phase_inductance": 1.7e-3, "mutual_inductance": -4e-4}
SETTINGS = FitSettings(search=SearchSettings(population=32, generations=20), jobs=1)
POSITION_NOISE, CURRENT_NOISE, VOLTAGE_NOISE = 1e-7, 0.003, 0.02  # m, A, V


def voltages(t: np.ndarray, common: float) -> np.ndarray:
    """Voltages that carry the forcer to and fro, commutated, and a chirp of `common` V on all three windings."""
    path = 0.05 * np.sin(2.0 * np.pi * t) ** 2
    push = 1.75 * np.cos(4.0 * np.pi * t) + MOTOR["force_constant"] * np.gradient(path, t)
    angle = MOTOR["electrical_wavenumber"] * path + MOTOR["commutation_offset"]
    chirp = common * np.sin(2.0 * np.pi * (5.0 * t + 10.0 * t * t))
    return np.array([push * np.sin(angle + (j - 2) * 2.0 * np.pi / 3.0) + chirp for j in (1, 2, 3)])


def one_by_one(t: np.ndarray) -> np.ndarray:
    """A chirp on one winding after the other; the two others are shorted."""
    rows = np.zeros((3, t.size))
    for row, part in zip(rows, np.array_split(np.arange(t.size), 3), strict=True):
        x = t[part] - t[part[0]]
        row[part] = 8.0 * np.sin(2.0 * np.pi * (4.0 * x + 12.0 * x * x))
    return rows


@cache
def exact(drive: str, mutual: float) -> tuple[Recording, ...]:
    """Two driven recordings without noise; the first carries the axis over some poles."""
    t = np.arange(1501) * 1e-3
    kinds = {
        "balanced": (voltages(t, 0.0), voltages(0.8 * t, 0.0)),
        "nearly balanced": (voltages(t, 0.2), voltages(0.8 * t, 0.2)),
        "unbalanced": (voltages(t, 1.0), voltages(0.8 * t, 1.0)),
        "one by one": (voltages(t, 0.0), one_by_one(t)),
    }
    model = Model("sine", (), SEPARATE)
    vector = model.vector({**FRICTION, **MOTOR, **WINDINGS, "mutual_inductance": mutual})[None]
    made = []
    for number, rows in enumerate(kinds[drive]):
        one = Recording(f"run_{number}", t, np.zeros_like(t), phase_voltages=rows)
        inputs = pack_inputs([one], voltages=True)
        y, _, i, _ = Simulator(model, inputs, 8).run_by_voltage(
            vector, whole_recordings(inputs), np.zeros((1, 1, 3)), np.full((1, 1, 3), np.nan)
        )
        made.append(replace(one, y=y[0], phase_currents=i[0]))
    return tuple(made)


def recordings(drive: str, mutual: float = WINDINGS["mutual_inductance"], seed: int = 1) -> list[Recording]:
    random = np.random.default_rng(seed)
    return [
        replace(
            r,
            y=r.y + POSITION_NOISE * random.standard_normal(r.y.size),
            phase_currents=r.phase_currents + CURRENT_NOISE * random.standard_normal((3, r.y.size)),
            phase_voltages=r.phase_voltages + VOLTAGE_NOISE * random.standard_normal((3, r.y.size)),
        )
        for r in exact(drive, mutual)
    ]


@cache
def by_currents(drive: str, mutual: float = WINDINGS["mutual_inductance"]) -> FitResult:
    """The motor by its currents alone; its friction and mass are known."""
    return fit("sine", recordings(drive, mutual), settings=SETTINGS, known=FRICTION)


def named(result: FitResult) -> dict[str, Estimate]:
    return {e.name: e for e in result.estimates}


@pytest.mark.parametrize("drive", ["one by one", "unbalanced"])
@pytest.mark.parametrize("mutual", [-7.5e-4, -4e-4, 5e-4])
def test_all_three_are_recovered_where_the_currents_do_not_sum_to_zero(drive: str, mutual: float) -> None:
    true = {**WINDINGS, "mutual_inductance": mutual}
    found = named(fit_windings(by_currents(drive, mutual), recordings(drive, mutual), SEPARATE, settings=SETTINGS))
    for name, least in (("phase_resistance", 0.002), ("phase_inductance", 3e-5), ("mutual_inductance", 3e-5)):
        estimate = found[name]
        assert estimate.status == "fitted"
        assert abs(estimate.value - true[name]) < 3.5 * estimate.std, estimate
        assert estimate.std < least, estimate


@pytest.mark.parametrize("drive", ["balanced", "nearly balanced"])
def test_balanced_currents_tell_only_the_difference(drive: str) -> None:
    """Noise of the voltages alone would be fitted best by whatever mutual inductance smooths it most."""
    wishes = replace(SETTINGS, bounds={"mutual_inductance": (-1e-3, 1e-3)}, profiles=("mutual_inductance",))
    result = fit_windings(by_currents(drive), recordings(drive), SEPARATE, settings=wishes)
    found = named(result)
    mutual, inductance = found["mutual_inductance"], found["phase_inductance"]
    assert mutual.status == "not_identifiable" and math.isnan(mutual.std) and "one phase alone" in mutual.note
    assert "mutual_inductance" not in result.fitted and "L - M" in inductance.note
    difference = WINDINGS["phase_inductance"] - WINDINGS["mutual_inductance"]
    assert abs(inductance.value - difference) < 3.5 * inductance.std < 0.05 * difference
    assert result.winding == SEPARATE
    again = model_from_text(model_to_text(result), "here")
    assert named(again)["mutual_inductance"].status == "not_identifiable"


def test_a_known_inductance_leaves_the_mutual_one_to_be_found() -> None:
    known = {"phase_inductance": WINDINGS["phase_inductance"]}
    result = fit_windings(by_currents("balanced"), recordings("balanced"), SEPARATE, settings=SETTINGS, known=known)
    mutual = named(result)["mutual_inductance"]
    assert mutual.status == "fitted" and mutual.std < 1e-4
    assert abs(mutual.value - WINDINGS["mutual_inductance"]) < 3.5 * mutual.std


@pytest.mark.exhaustive
@pytest.mark.parametrize("drive", ["one by one", "unbalanced", "balanced"])
def test_intervals_cover_over_fifty_draws_of_the_noise(drive: str) -> None:
    true, seeds = dict(WINDINGS), range(200, 250)
    if drive == "balanced":
        true["phase_inductance"] -= true.pop("mutual_inductance")
    hits = dict.fromkeys(true, 0)
    for seed in seeds:
        found = named(fit_windings(by_currents(drive), recordings(drive, seed=seed), SEPARATE, settings=SETTINGS))
        for name, value in true.items():
            hits[name] += found[name].low <= value <= found[name].high
    least = binom.ppf(0.001, len(seeds), 0.95)
    assert all(hit >= least for hit in hits.values()), hits
