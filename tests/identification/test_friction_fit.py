"""Friction fits: recovery, coverage of the intervals, identifiability, scale of a single mass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from linid.errors import DataError, UsageError
from linid.identification.fit import fit
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.recording.splines import trim
from linid.stand.generate import GeneratedCampaign, resample_noise
from tests.benchmarks.paper_stands import table_2

from .stand import FREE_WHEELS, stand

SMALL = FitSettings(search=SearchSettings(population=24, generations=4), jobs=2)


def estimates(result: FitResult) -> dict[str, object]:
    return {e.name: e for e in result.estimates}


def test_free_wheels_with_added_masses_give_friction_and_mass() -> None:
    campaign = stand(only=FREE_WHEELS)
    result = fit("friction", campaign.recordings, settings=SMALL)
    assert result.converged
    for estimate in result.estimates:
        if estimate.status == "fixed":
            continue
        truth = campaign.truth[estimate.name]
        assert abs(estimate.value - truth) < 4.5 * estimate.std, estimate
        assert estimate.std < 0.05 * truth, estimate
    # What is left over is the encoder's noise: 0.2 um and a resolution of 0.1 um.
    assert max(result.residual_rms.values()) < 1.2 * np.hypot(0.2e-6, 0.1e-6 / np.sqrt(12.0))


def test_what_the_shipped_recordings_miss_is_their_draw_of_noise() -> None:
    """Three of data/stand's seven truths lie outside the intervals; its noise reversed, as far on the other side."""
    campaign = stand(only=FREE_WHEELS)
    reversed_noise = [replace(r, y=2.0 * campaign.exact[r.name].y - r.y) for r in campaign.recordings]
    one, other = (fit("friction", r, settings=SMALL).estimates for r in (campaign.recordings, reversed_noise))
    for mine, its in zip(one, other, strict=True):
        if mine.status != "fixed":
            truth = campaign.truth[mine.name]
            assert abs(0.5 * (mine.value + its.value) - truth) < 0.5 * mine.std, (mine, its)


@pytest.mark.parametrize(("campaign", "seed"), [(stand, 1016), (table_2, 1030)])
def test_a_needle_of_friction_at_rest_is_not_taken_for_the_minimum(
    campaign: Callable[[], GeneratedCampaign], seed: int
) -> None:
    """Draws of noise in which a descent from the middle of the box ends at a rise that is far too narrow."""
    generated = campaign()
    wheels = [r for r in resample_noise(generated, seed).recordings if r.kind == "free_wheel" and r.split == "fit"]
    for estimate in fit("friction", wheels, settings=SMALL).estimates:
        if estimate.status != "fixed":
            assert estimate.status == "fitted", estimate
            assert abs(estimate.value - generated.truth[estimate.name]) < 4.0 * estimate.std, estimate


def test_a_plain_genetic_algorithm_needs_its_generations() -> None:
    """From random candidates, to the end of its budget: far from what the first values have at once."""
    campaign = stand(only=FREE_WHEELS)
    plain = replace(SMALL, search=SearchSettings(method="plain", population=48, generations=40, patience=1))
    found, usual = (fit("friction", campaign.recordings, settings=s) for s in (plain, SMALL))
    searched = [line for line in found.history if line.stage == "plain"]
    assert [line.generation for line in searched] == list(range(41))
    assert searched[0].best > searched[-1].best > 10.0 * usual.history[0].best
    assert usual.history[-1].best < 1.001 * found.history[-1].best


def test_without_least_squares_the_best_candidate_stays() -> None:
    campaign = stand(only=FREE_WHEELS)
    search = SearchSettings(method="plain", population=24, generations=6)
    result = fit("friction", campaign.recordings, settings=replace(SMALL, search=search, least_squares_steps=0))
    assert {line.stage for line in result.history} == {"plain"} and not result.converged
    assert "left out as asked" in result.stop_reasons[-1]
    polished = fit("friction", campaign.recordings, settings=replace(SMALL, search=search, least_squares_steps=3))
    assert polished.history[-1].stage == "least_squares" and polished.value("mass") != result.value("mass")


def test_intervals_cover_the_truth() -> None:
    """12 noise seeds, 7 parameters: the count of covering 95 % intervals is plausible for 95 %."""
    campaign = stand(only=FREE_WHEELS)
    hits = total = 0
    for seed in range(12):
        noisy = resample_noise(campaign, 100 + seed)
        result = fit("friction", noisy.recordings, settings=SMALL)
        for estimate in result.estimates:
            if estimate.status == "fitted":
                total += 1
                hits += estimate.low <= campaign.truth[estimate.name] <= estimate.high
    assert total >= 80
    # Parameters of one fit are correlated; the limits are those of a third as many independent trials.
    low = binom.ppf(0.0005, total // 3, 0.95) / (total // 3)
    assert hits / total >= low


def test_without_stops_the_bristle_is_named_not_identifiable() -> None:
    campaign = stand(only=FREE_WHEELS)
    fast = []
    for recording in campaign.recordings:
        v = campaign.exact[recording.name].v
        slow = np.flatnonzero(np.abs(v) < 0.1)
        fast.append(trim(recording, float(recording.t[0]), float(recording.t[slow[0]])))
    result = fit("friction", fast, settings=SMALL)
    status = {e.name: e.status for e in result.estimates}
    assert status["bristle_stiffness"] == "not_identifiable"
    assert status["bristle_damping"] == "not_identifiable"
    notes = {e.name: e.note for e in result.estimates}
    assert "pre-sliding" in notes["bristle_stiffness"]
    assert status["coulomb_force"] == "fitted" and status["mass"] == "fitted"


def test_one_mass_alone_gives_forces_per_kilogram() -> None:
    campaign = stand(only=FREE_WHEELS)
    two = campaign.recordings[:2]
    result = fit("friction", two, settings=SMALL)
    assert result.per_mass
    units = {e.name: e.unit for e in result.estimates}
    assert units["coulomb_force"] == "N/kg"
    expected = campaign.truth["coulomb_force"] / campaign.truth["mass"]
    assert result.value("coulomb_force") == pytest.approx(expected, rel=2e-4)
    given = fit("friction", two, settings=SMALL, known={"mass": campaign.truth["mass"]})
    assert not given.per_mass
    assert given.value("coulomb_force") == pytest.approx(campaign.truth["coulomb_force"], rel=2e-4)


def test_same_seed_same_bits_on_any_number_of_threads() -> None:
    campaign = stand(only=FREE_WHEELS)
    one = fit("friction", campaign.recordings, settings=replace(SMALL, jobs=1))
    two = fit("friction", campaign.recordings, settings=replace(SMALL, jobs=2))
    assert one.estimates == two.estimates
    assert np.array_equal(one.covariance, two.covariance)


def test_a_rotary_axis_carries_rotary_units() -> None:
    campaign = stand(only=FREE_WHEELS)
    turned = [replace(r, axis="rotary") for r in campaign.recordings]
    result = fit("friction", turned, settings=SMALL)
    units = {e.name: e.unit for e in result.estimates}
    assert units["coulomb_force"] == "N m" and units["mass"] == "kg m^2" and units["viscous_friction"] == "N m s/rad"


def test_recordings_that_cannot_be_fitted_are_refused() -> None:
    campaign = stand(only=FREE_WHEELS)
    with pytest.raises(UsageError, match="no recording"):
        fit("friction", [])
    short = trim(campaign.recordings[0], 0.0, 0.02)
    with pytest.raises(DataError, match="at least 50"):
        fit("friction", [short])
    with pytest.raises(UsageError, match="free wheels"):
        fit("sine", campaign.recordings)
