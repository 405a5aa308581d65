"""The compiled kernels: guarded equals specialised, threads change nothing, failures stay with their candidate."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.identification.objectives.ahead import Ahead
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.identification.stand import stand

T = np.arange(0.0, 0.3, 1e-3)


def recording(seed: int = 0) -> Recording:
    generator = np.random.default_rng(seed)
    currents = 0.5 * np.sin(2 * np.pi * 3.0 * T + np.array([[0.0], [2.0], [4.0]]))
    return Recording("r", T, np.zeros_like(T), phase_currents=currents + 0.01 * generator.standard_normal((3, T.size)))


def population(model: Model, size: int, seed: int = 0) -> np.ndarray:
    """Random parameters over two decades around the defaults; theta's nome on both sides of the Gaussian switch."""
    generator = np.random.default_rng(seed)
    rows = []
    for k in range(size):
        values = {}
        for parameter in model.parameters:
            if parameter.log:
                values[parameter.name] = parameter.default * 10.0 ** generator.uniform(-1, 1)
            else:
                values[parameter.name] = generator.uniform(parameter.lower, parameter.upper)
        values["static_force"] = values["coulomb_force"] * (1.0 + generator.random())
        values["stribeck_exponent"] = 2.0 if k % 2 else generator.uniform(0.5, 2.0)
        rows.append(model.vector(values))
    return np.array(rows)


def run(model: Model, params: np.ndarray, *, specialised: bool = False, jobs: int = 1) -> np.ndarray:
    simulator = Simulator(model, pack_inputs([recording(), recording(1)]), 2, jobs, specialised)
    starts = np.tile([0.1, 0.05, math.nan], (params.shape[0], 2, 1))
    return simulator.run(params, whole_recordings(simulator.inputs), starts)[0]


@pytest.mark.parametrize("kind", ["friction", "force", "sine", "theta"])
def test_guarded_and_specialised_kernels_give_the_same_bits(kind: str) -> None:
    """Without effects motors run side by side, by an exponential whose last bit may be another."""
    plain, full = Model(kind), Model(kind, ("constant_force",))
    params = population(full, 12)
    assert np.array_equal(run(full, params), run(full, params, specialised=True), equal_nan=True)
    params = population(plain, 12)
    guarded, specialised = run(plain, params), run(plain, params, specialised=True)
    if kind in ("friction", "force"):
        assert np.array_equal(guarded, specialised, equal_nan=True)
    assert np.array_equal(np.isnan(guarded), np.isnan(specialised))
    assert np.nanmax(np.abs(guarded - specialised)) < 1e-14


@pytest.mark.parametrize("jobs", [2, 3])
def test_threads_change_no_bit(jobs: int) -> None:
    model = Model("theta")
    params = population(model, 9)
    assert np.array_equal(run(model, params), run(model, params, jobs=jobs), equal_nan=True)


def test_off_means_off() -> None:
    """Parameters of an effect that is off change nothing, whatever they are; switched on they do."""
    plain, with_effect = Model("sine"), Model("sine", ("constant_force",))
    params = population(with_effect, 4)
    assert np.all(params[:, with_effect.slot("constant_force")] != 0.0)
    bare = params.copy()
    bare[:, with_effect.slot("constant_force")] = 0.0
    assert np.array_equal(run(plain, params), run(plain, bare))
    assert not np.array_equal(run(plain, params), run(with_effect, params))


def test_rows_do_not_touch_each_other_and_failure_stays_in_its_row() -> None:
    model = Model("sine")
    params = population(model, 5)
    broken = params.copy()
    broken[2, 7] = -1e-9  # a negative mass runs away
    good, mixed = run(model, params), run(model, broken)
    assert np.array_equal(np.delete(good, 2, axis=0), np.delete(mixed, 2, axis=0))
    assert np.isnan(mixed[2, -1]) or abs(mixed[2, -1]) < 1e6


def test_bristles_of_chosen_samples_are_those_of_the_whole_way() -> None:
    """Whatever the parameters are, and where the motion before them is left out because it is forgotten."""
    campaign = stand()
    model = Model("theta")
    recordings = tuple(r for r in campaign.recordings if r.kind != "free_wheel")[:4]
    part = Ahead(model, recordings, 2, 1, thin=4)
    motion, none = part.motion, np.full((8, len(recordings)), np.nan)
    true = model.vector({k: x for k, x in campaign.truth.items() if k in {p.name for p in model.parameters}})
    scale = np.random.default_rng(3).uniform(0.7, 1.4, (8, true.size))
    known = (part.simulator, true * scale, motion.y, motion.v, motion.standstill, none)
    whole = Simulator.along(*known, without="acceleration").bristle
    chosen = Simulator.along(*known, without="acceleration", wanted=part.begins).bristle
    assert np.max(np.abs(chosen - whole)[:, part.begins]) < 1e-9 * np.max(np.abs(whole))
    assert np.mean(np.isnan(chosen)) > 0.3  # most of the way is left out


@pytest.mark.parametrize("kind", ["sine", "theta"])
@pytest.mark.parametrize("substeps", [1, 3])
def test_forces_shared_by_windows_are_those_of_each(kind: str, substeps: int) -> None:
    """With and without the table of forces along the measured motion; an effect that is off has none."""
    campaign = stand()
    recordings = tuple(r for r in campaign.recordings if r.name in ("freewheel_1", "moves_1", "sine_position_1"))
    values = dict(campaign.truth)
    if kind == "sine":
        values |= {
            name: 2.0 * values[name] for name in ("electrical_wavenumber", "winding_displacement", "commutation_offset")
        }
    plain, guarded = Model(kind), Model(kind, ("constant_force",))

    def known(model: Model) -> np.ndarray:
        return model.vector({p.name: values.get(p.name, 0.0) for p in model.parameters})

    scale = np.random.default_rng(5).uniform(0.9, 1.1, (5, 1))
    shared, alone = (
        Ahead(model, recordings, substeps, jobs).simulate(known(model)[None, :] * scale)
        for model, jobs in ((plain, 2), (guarded, 1))
    )
    assert np.nanmax(np.abs(shared - alone)) < 1e-10
    assert np.array_equal(np.isnan(shared), np.isnan(alone))
