"""Currents that do not sum to zero tell what commutated ones hide: nome, coil length, force constant of theta."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from linid.identification.fit import fit
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.field.guideway import k_of
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.stand.description import load_axis_description
from linid.stand.generate import true_parameters

from .stand import CONFIGS, FREE_WHEELS, stand

SETTINGS = FitSettings(search=SearchSettings(population=24, generations=6), jobs=2)
FREQUENCIES = ((1.3, 0.7, 2.1), (0.9, 2.3, 1.7), (3.1, 1.1, 0.6))  # Hz of the three phases, each fed by itself
NOISE_Y, NOISE_I = 2e-7, 3e-3  # m, A


def narrow() -> dict[str, float]:
    """The stand with narrow magnets, whose field has third, fifth and seventh harmonics to tell three unknowns by."""
    return true_parameters(load_axis_description(CONFIGS / "stand_axis_narrow.yaml"))


def fed_one_by_one(index: int) -> Recording:
    """Each phase on a supply of its own; position and currents with sensor noise."""
    truth = narrow()
    random = np.random.default_rng(50 + index)
    t = np.arange(3000) * 1e-3
    currents = np.array([0.6 * np.sin(2.0 * math.pi * f * t + j) for j, f in enumerate(FREQUENCIES[index])])
    model = Model("theta")
    exact = Recording(f"one_by_one_{index}", t, np.full(t.size, 0.39), phase_currents=currents)
    inputs = pack_inputs([exact])
    start = np.array([[[0.39, 0.0, 0.0]]])
    y = Simulator(model, inputs, 16).run(model.vector(truth)[None], whole_recordings(inputs), start)[0][0]
    noisy = currents + NOISE_I * random.standard_normal(currents.shape)
    return Recording(exact.name, t, y + NOISE_Y * random.standard_normal(t.size), phase_currents=noisy)


@cache
def theta_fit() -> FitResult:
    wheels = list(stand(only=FREE_WHEELS).recordings)
    friction = fit("friction", wheels, settings=SETTINGS)
    return fit("theta", [*wheels, *map(fed_one_by_one, range(3))], settings=SETTINGS, start=friction)


def test_a_theta_fit_tells_the_magnets() -> None:
    truth, result = narrow(), theta_fit()
    found = {e.name: e for e in (*result.estimates, *result.derived)}
    pitch = math.pi / (2.0 * truth["electrical_wavenumber"])
    true = {
        "pole_pitch": pitch,
        "field_shape": k_of(truth["nome"]),
        "coil_length": 2.0 * truth["winding_length"] / truth["electrical_wavenumber"],
        "phase_spacing": truth["winding_displacement"] / truth["electrical_wavenumber"],
        "force_constant": truth["force_constant"],
        "nome": truth["nome"],
    }
    for name, value in true.items():
        estimate = found[name]
        assert estimate.status in ("fitted", "derived"), estimate
        assert abs(estimate.value - value) < 4.0 * (estimate.high - estimate.low) / 3.92, (estimate, value)
        if name == "coil_length":  # one of two pitches less that has the same thrust
            assert estimate.low < value < estimate.high and "shared by two minima" in estimate.note
            assert estimate.high == pytest.approx(2.0 * pitch - value, rel=0.01)
        else:
            assert estimate.high - estimate.low < 0.5 * value, estimate
