"""How much free runs, and windows of a prediction, count beside each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.identification.fit import fit
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.objective import independent_along
from linid.identification.optimise.window_trust import trust_of
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.model import Model
from linid.stand.generate import resample_noise

from .stand import FREE_WHEELS, stand

SMALL = FitSettings(search=SearchSettings(population=24, generations=3), jobs=2)
DRIVEN = ("slow_ramp_1", "sine_current_2", "sine_position_1", "moves_1")


def sine_truth() -> dict[str, float]:
    """The stand's theta motor as the sine motor that pushes alike: its third harmonic cancels."""
    truth = stand(only=FREE_WHEELS + DRIVEN).truth
    doubled = {k: 2.0 * truth[k] for k in ("electrical_wavenumber", "winding_displacement", "commutation_offset")}
    return truth | doubled | {"force_constant": 30.0}


def test_white_residuals_count_each_and_correlated_ones_less() -> None:
    white = np.random.default_rng(1).standard_normal(4000)
    assert independent_along(white) > 3800.0
    slow = np.convolve(white, np.ones(20))  # a mean of twenty: as many samples tell as much as one
    assert independent_along(slow) == pytest.approx(4000.0 / 20.0, rel=0.25)
    assert independent_along(np.zeros(10)) == 0.0


def test_free_runs_do_not_count_their_samples_in_the_search() -> None:
    wheels = [r for r in stand(only=FREE_WHEELS).recordings if r.kind == "free_wheel"]
    noise = np.random.default_rng(1).standard_normal(sum(r.y.size for r in wheels))
    assert np.all(FreeRun(Model("friction"), tuple(wheels), 1, 1, project=True).independent(noise) == 0.0)
    counts = FreeRun(Model("friction"), tuple(wheels), 1, 1).independent(noise)
    assert np.all(counts > 0.85 * np.array([r.y.size for r in wheels]))


def test_free_runs_share_what_they_count_as_if_they_were_fitted() -> None:
    """Where one recording is fitted already and another one not yet, neither counts more than the other for it."""
    wheels = [r for r in stand(only=FREE_WHEELS).recordings if r.kind == "free_wheel"][:2]
    part = FreeRun(Model("friction"), tuple(wheels), 1, 1)
    one, other = (np.linspace(0.0, 1.0, r.y.size) for r in wheels)
    noise = np.random.default_rng(1).standard_normal(one.size + other.size)
    slow = np.concatenate([0.0 * one, other**2])  # what a parameter does
    slopes = np.column_stack([slow, np.zeros(noise.size), np.ones(noise.size), np.concatenate([one, other])])
    off = noise + 5.0 * slow
    unlike, alike = part.independent(off), part.independent(off, slopes)
    assert unlike[0] > 20.0 * unlike[1]
    assert alike[0] == pytest.approx(alike[1], rel=0.2)
    assert np.sum(1.0 / alike) == pytest.approx(np.sum(1.0 / unlike))
    alone = part.independent(noise)
    assert part.independent(noise, slopes) == pytest.approx(alone, rel=0.02)
    assert np.array_equal(part.independent(np.full(noise.size, np.nan), slopes), np.zeros(2))


def test_breakaway_under_noisy_current_counts_less_than_motion() -> None:
    campaign = stand(only=FREE_WHEELS + DRIVEN)
    ramp = next(r for r in campaign.recordings if r.name == "slow_ramp_1")
    model = Model("sine")
    vector = model.vector({name: x for name, x in sine_truth().items() if name in {p.name for p in model.parameters}})
    part = Ahead(model, (ramp,), 2, 1)
    trust = trust_of(part, vector, np.random.default_rng(1))
    assert trust.shape == (part.segments.count.size,) and np.all((trust > 0.0) & (trust <= 1.0))
    power = np.zeros(trust.size)
    for seed in range(10):  # the machine's own noise scatters as the draws foretold
        again = next(r for r in resample_noise(campaign, 100 + seed).recordings if r.name == ramp.name)
        error = replace(part, recordings=(again,)).residuals(vector[None], np.zeros((1, 0)))[0]
        power += np.bincount(part.groups, error**2) / np.bincount(part.groups) / 10.0
    least, usual = trust < 0.3, trust > 0.9
    assert 1 <= least.sum() < usual.sum()
    assert power[least].mean() > 9.0 * power[usual].mean()
    quiet = replace(ramp, phase_currents=np.zeros_like(ramp.phase_currents))
    assert np.all(trust_of(Ahead(model, (quiet,), 2, 1), vector, np.random.default_rng(1)) == 1.0)


def test_driven_recordings_blur_no_friction_that_free_wheels_tell() -> None:
    """A joint fit knows friction as well as the free wheels alone, and the truth lies within what it says."""
    campaign = stand(only=FREE_WHEELS + DRIVEN)
    scores = []
    for seed in (1012, 1016, 1019):
        recordings = resample_noise(campaign, seed).recordings
        friction = fit("friction", [r for r in recordings if r.kind == "free_wheel"], settings=SMALL)
        joint = fit("sine", recordings, settings=SMALL, start=friction)
        alone = {e.name: e for e in friction.estimates if e.status == "fitted"}
        for estimate in joint.estimates:
            if estimate.name in alone:
                assert estimate.std < 1.25 * alone[estimate.name].std, estimate
                scores.append((estimate.value - campaign.truth[estimate.name]) / estimate.std)
    assert np.max(np.abs(scores)) < 4.0 and 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.5
