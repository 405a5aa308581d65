"""Noise of the logged phase currents in the fit of motors whose windings do not stand 120 degrees apart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.identification.fit import fit
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.input_noise import CurrentPush, whitened
from linid.identification.optimise.rivals import advantage
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.signals.error_dynamics import Bristle, position_answers
from linid.physics.model import Model
from linid.stand.generate import GeneratedCampaign, resample_noise
from linid.threads import one_thread
from tests.benchmarks.paper_stands import table_2, table_3

SMALL = FitSettings(search=SearchSettings(population=24, generations=3), jobs=2)


def bristle(n: int, rate: float, share: float, stiffness: float, damping: float, viscous: float) -> Bristle:
    along = np.ones((1, n))
    return Bristle(rate * along, share * along, *(np.array([x]) for x in (stiffness, damping, viscous)))


def test_a_sliding_axis_carries_a_push_on_and_viscous_friction_forgets_it() -> None:
    dt, n, viscous = 1e-3, 120, 8.0
    answer = position_answers(bristle(n, 1e5, 0.0, 2e4, 50.0, viscous), dt)[0, :, 20]
    late = dt * (np.arange(n) - 20.0)
    exact = np.where(late > 0.0, dt * (1.0 - np.exp(-viscous * late)) / viscous, 0.0)
    assert answer == pytest.approx(exact, abs=0.02 * exact[-1])


def test_a_sticking_axis_swings_back() -> None:
    dt, n, stiffness, damping = 1e-4, 800, 2e4, 60.0
    answer = position_answers(bristle(n, 0.0, 1.0, stiffness, damping, 0.0), dt)[0, :, 10]
    late = dt * (np.arange(n) - 10.0)
    turn = np.sqrt(stiffness - 0.25 * damping**2)
    exact = np.where(late > 0.0, dt * np.exp(-0.5 * damping * late) * np.sin(turn * late) / turn, 0.0)
    assert answer == pytest.approx(exact, abs=0.05 * np.max(exact))


def test_whitened_residuals_of_the_truth_are_white_and_of_unit_variance() -> None:
    campaign = table_3()
    moving = tuple(r for r in campaign.recordings if r.name in ("sine_position_1", "sine_current_2"))
    part = Ahead(Model("theta"), moving, 2, 1)
    vector = part.model.vector({"stribeck_exponent": 2.0, **campaign.truth})
    push = CurrentPush(part)(vector[None])[0]
    white = whitened(part, vector, push, np.random.default_rng(1))
    rows = white.residuals(vector[None], np.zeros((1, 0)))[0]
    power = np.bincount(white.groups, rows**2) / np.bincount(white.groups)
    assert np.median(power) == pytest.approx(1.0, abs=0.1)
    windows = rows.reshape(-1, np.bincount(white.groups)[0])[np.abs(np.log(power)) < 0.5]
    assert abs(np.mean(windows[:, 1:] * windows[:, :-1])) < 0.1  # plain ones: 0.99
    plain = part.residuals(vector[None], np.zeros((1, 0)))[0].reshape(-1, 101)
    assert np.mean(plain[:, 1:] * plain[:, :-1]) > 0.9 * np.mean(plain**2)


def motor_fit(campaign: GeneratedCampaign, model: ModelKind, seed: int, friction_seed: int | None = None) -> FitResult:
    """A motor's fit to a campaign with a draw of noise, friction from its free wheels or those of another draw."""
    recordings = resample_noise(campaign, seed).recordings
    wheels = recordings if friction_seed is None else resample_noise(campaign, friction_seed).recordings
    # As the product does: along a flat valley the last bits, which hang on the number of threads, decide the end.
    with one_thread():
        friction = fit("friction", [r for r in wheels if r.kind == "free_wheel"], settings=SMALL)
        return fit(model, recordings, settings=SMALL, start=friction)


@pytest.mark.parametrize("seed", [1, 1025])
def test_the_motor_of_table_2_is_recovered_from_noisy_currents(seed: int) -> None:
    """Plain least squares give 130.2 N/A and 0.551 with intervals that exclude 133.8 N/A and 0.5368 (seed 1); scores of
    second order, which noise biases, an interval of the shift that excludes its own estimate (seed 1025)."""
    campaign = table_2()
    found = {e.name: e for e in motor_fit(campaign, "sine", seed).estimates}
    for name in ("force_constant", "winding_displacement", "electrical_wavenumber", "commutation_offset"):
        assert found[name].low < campaign.truth[name] < found[name].high, found[name]
        assert found[name].status == "fitted"
    assert found["force_constant"].high < 1.1 * found["force_constant"].low


def test_rival_minima_are_told_apart_by_what_noise_may_do() -> None:
    generator = np.random.default_rng(3)
    one = generator.chisquare(99, 300)
    other = one + generator.standard_normal(300)
    assert abs(advantage(one, other)) < 3.0
    assert advantage(one, other + 0.3) > 3.0
    assert advantage(other + 0.3, one) == pytest.approx(-advantage(one, other + 0.3))


def test_a_rival_with_wide_magnets_is_fitted_before_its_shape_is_free() -> None:
    """In this draw of noise the first minimum has a nome of 0.89; the true one beside it costs the same."""
    campaign = table_3()
    result = motor_fit(campaign, "theta", 1006)
    found = {e.name: e for e in (*result.estimates, *result.derived)}
    assert found["nome"].value > 0.85
    for name in ("winding_displacement", "nome", "electrical_wavenumber", "commutation_offset"):
        assert found[name].low < campaign.truth[name] < found[name].high, found[name]
    # Wide magnets push like a sine however wide they are: the whole valley costs the same, wherever the fit stopped.
    assert found["nome"].low < 0.3
    assert found["fundamental_force_constant"].low > 100.0 and found["fundamental_force_constant"].high < 125.0
    # What follows from them holds both minima too, and says so.
    derived = {"phase_spacing": 1.513 / 104.7, "coil_length": 2.0 * 1.376 / 104.7, "fundamental_force_constant": 120.75}
    for name, truth in derived.items():
        assert found[name].low < truth < found[name].high, found[name]
    # A coil of any of both minima has a twin that pushes alike: together they fill the pitch of the winding.
    both = found["coil_length"].low + found["coil_length"].high
    assert both == pytest.approx(math.pi / found["electrical_wavenumber"].value)
    assert "shared by two minima" in found["phase_spacing"].note
    assert "shared by two minima" in found["sine_force_error"].note and "k is" not in found["sine_force_error"].note


def test_a_rival_is_settled_under_the_noise_before_its_shape_is_free() -> None:
    """In this draw the first minimum has a nome of 0.89 and costs 2.4 standard deviations more than the true one; from
    where plain least squares leave the other parameters the rival ran back to it, and that was told as certain."""
    campaign = table_3()
    found = {e.name: e for e in motor_fit(campaign, "theta", 3158, friction_seed=3150).estimates}
    for name in ("winding_displacement", "nome", "electrical_wavenumber", "commutation_offset"):
        assert found[name].low < campaign.truth[name] < found[name].high, found[name]
    assert found["nome"].value < 0.8


@pytest.mark.exhaustive
def test_the_motor_of_table_3_lies_within_its_intervals() -> None:
    """Under commutated currents narrow magnets at other spacings push alike: what two minima share says so."""
    campaign = table_3()
    missed = []
    for seed in (1, 2, 3):
        result = motor_fit(campaign, "theta", seed)
        found = {e.name: e for e in result.estimates}
        for name in ("force_constant", "winding_displacement", "winding_length", "nome", "electrical_wavenumber"):
            one, truth = found[name], campaign.truth[name]
            if not one.low < truth < one.high:
                missed.append(one)
                assert abs(one.value - truth) < 3.5 * one.std, one
        fundamental = next(e for e in result.derived if e.name == "fundamental_force_constant")
        assert fundamental.low < 120.8 < fundamental.high
    assert len(missed) <= 2, missed  # of 15 intervals of 95 %, by chance more than two in 4 of 100 cases
