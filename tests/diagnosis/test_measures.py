"""The gap measures against closed forms: a known force that the model lacks, and known noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linid.diagnosis.gap import RecordingGap
from linid.diagnosis.means import Means
from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.refined_models import changes_of, jumps_in, measured_beside
from linid.errors import UsageError
from linid.identification.objectives.acceleration import Acceleration, bump
from linid.identification.settings import HORIZON
from linid.physics.model import Model
from linid.recording import read_campaign
from linid.recording.recording import Recording

from .machine import MASS, K, Noise, current, drift, recording, result

NOISE = Noise(encoder=2e-7, current=2e-3)


def gap_of(one: Recording, *others: Recording, seed: int = 1) -> RecordingGap:
    return measure_gaps(result(), [one], seed=seed, among=(one, *others))[0][0]


def test_no_gap_where_the_model_is_the_machine() -> None:
    gap = gap_of(recording())
    assert gap.free_run < 1e-6 and gap.ahead < 1e-8 and gap.force < 1e-4


@pytest.mark.parametrize("extra", [0.02, -0.3])
def test_a_missing_constant_force_has_its_analytic_gap(extra: float) -> None:
    one = recording(extra=extra)
    gap = gap_of(one)
    assert gap.force == pytest.approx(abs(extra), rel=1e-3)
    assert gap.force_share == pytest.approx(abs(extra) / np.sqrt(np.mean((K * current(one.t)) ** 2)), rel=2e-3)
    assert gap.ahead == pytest.approx(abs(float(drift(HORIZON, extra))), rel=1e-3)
    free = np.sqrt(np.mean(drift(one.t, extra) ** 2)) / np.std(one.y)
    assert gap.free_run == pytest.approx(float(free), rel=1e-3)


def test_the_force_of_an_added_mass_counts() -> None:
    """Force is mass times missing acceleration, with the mass that was added."""
    one = recording(extra=0.1)
    heavier = gap_of(replace(one, added_mass=1.0))
    # the heavier model lacks 0.1 N and 1 kg times the measured acceleration
    acceleration = np.gradient(np.gradient(one.y, 1e-3), 1e-3)[20:-20]
    assert heavier.force == pytest.approx(float(np.sqrt(np.mean((0.1 + 1.0 * acceleration) ** 2))), rel=0.02)


def test_free_run_is_the_rms_error_over_the_standard_deviation() -> None:
    one = recording(extra=0.1, noise=NOISE)
    (gap,), (trace,) = measure_gaps(result(), [one])
    assert gap.free_run == pytest.approx(float(np.sqrt(np.mean((trace.y_simulated - one.y) ** 2)) / np.std(one.y)))
    assert trace.y_simulated[0] == pytest.approx(one.y[0], abs=5 * NOISE.encoder)


def test_one_more_model_is_measured_beside_those_before_it() -> None:
    """A change goes on from where the last one ended; floors stay, which the noise makes, unless they were infinite."""
    one, better = recording(noise=NOISE), result()
    weaker, stronger = (
        replace(better, estimates=tuple(replace(e, value=k * e.value) if e.value == K else e for e in better.estimates))
        for k in (0.9, 1.05)
    )
    changes, _, _ = changes_of([one], weaker, stronger, Means())
    change, trace = measured_beside((one,), changes, better, 1, 0, 1)
    (gap,), (own,) = measure_gaps(better, [one])
    for name, (level, floor) in {
        "free_run": (gap.free_run, gap.free_run_floor),
        "ahead": (gap.ahead, gap.ahead_floor),
        "force": (gap.force, gap.force_floor),
    }.items():
        known, found = changes[0].changes[name], change.changes[name]
        assert (found.before, found.after, found.floor) == (known.after, level, known.floor)
        assert known.floor == pytest.approx(floor, rel=0.06) and level < 0.2 * known.after  # noise times the constant
    assert np.array_equal(trace.force_residual, own.force_residual)
    lost = {name: replace(known, floor=np.inf) for name, known in changes[0].changes.items()}
    anew, _ = measured_beside((one,), (replace(changes[0], changes=lost),), better, 1, 0, 1)
    assert anew.changes["ahead"].floor == gap.ahead_floor


def test_pieces_are_restarted_and_end_at_the_horizon() -> None:
    one = recording(extra=0.1)
    (gap,), (trace,) = measure_gaps(result(), [one])
    pieces = trace.ahead
    assert pieces is not None and pieces.horizon == pytest.approx(HORIZON)
    assert gap.ahead == pytest.approx(float(np.sqrt(np.mean(pieces.end_error**2))))
    # every piece leaves the measured motion along the same closed form (model minus machine)
    blocks = np.split(np.arange(pieces.t.size), np.flatnonzero(np.isnan(pieces.t)))
    for rows in blocks[:5]:
        good = rows[np.isfinite(pieces.t[rows])]
        since = pieces.t[good] - pieces.t[good[0]]
        np.testing.assert_allclose(pieces.error[good], -drift(since, 0.1), atol=2e-8)
        np.testing.assert_allclose(pieces.y[good], np.interp(pieces.t[good], one.t, one.y) + pieces.error[good])
    assert np.nanmax(np.diff(pieces.end_t)) == pytest.approx(HORIZON / 2)


@pytest.mark.parametrize("noise", [NOISE, Noise(encoder=1e-7, current=1e-2)])
def test_a_recording_of_the_model_with_noise_lies_at_its_floor(noise: Noise) -> None:
    gap = gap_of(recording(noise=noise, seed=3))
    assert gap.ahead == pytest.approx(gap.ahead_floor, rel=0.25)
    assert gap.force == pytest.approx(gap.force_floor, rel=0.15)
    assert gap.free_run < 3.0 * gap.free_run_floor  # one draw of a random walk: only its order is certain


def test_pure_encoder_noise_lies_about_its_floor() -> None:
    """Now and then noise looks like a bend and a window starts with a speed that is hardly smoothed: such windows make
    the ahead errors of one recording in four some times larger, so that medians and not RMS values are compared."""
    gaps = [gap_of(recording(noise=Noise(encoder=5e-6), seed=k), seed=20 + k) for k in range(12)]
    assert np.median([gap.force / gap.force_floor for gap in gaps]) == pytest.approx(1.0, rel=0.1)
    for name in ("free_run", "ahead"):
        assert 0.4 < np.median([getattr(gap, name) / getattr(gap, f"{name}_floor") for gap in gaps]) < 1.3, name


def test_the_floor_is_the_spread_of_repeated_noise() -> None:
    """Against forty recordings of the noise-free machine with fresh noise of the same size."""
    measured = [gap_of(recording(noise=NOISE, seed=100 + k)) for k in range(40)]
    floors = measured[:6]
    for name, tolerance in (("free_run", 0.35), ("ahead", 0.1), ("force", 0.1)):
        spread = np.sqrt(np.mean([getattr(gap, name) ** 2 for gap in measured]))
        floor = np.sqrt(np.mean([getattr(gap, f"{name}_floor") ** 2 for gap in floors]))
        assert floor == pytest.approx(spread, rel=tolerance), name


def ratios(runs: list[Recording]) -> dict[str, float]:
    """Floor over actual error of the true model: RMS of twelve floors over that of all runs' errors, since of a free
    run's random walk a few say little."""
    actual = measure_gaps(result(), runs, floors=False)[0]
    floors = [gap_of(one, seed=40 + k) for k, one in enumerate(runs[:12])]

    def rms(gaps: Sequence[RecordingGap], name: str) -> float:
        return float(np.sqrt(np.mean([getattr(gap, name) ** 2 for gap in gaps])))

    return {name: rms(floors, f"{name}_floor") / rms(actual, name) for name in ("free_run", "ahead", "force")}


@pytest.mark.parametrize("noise", [0.0, 0.33])
@pytest.mark.parametrize("step", [1e-7, 1e-6, 5e-6, 1e-5])
def test_the_steps_of_an_encoder_have_their_floor(step: float, noise: float) -> None:
    """The true model on readings in whole steps, each run elsewhere on the lattice; noise: in steps."""
    runs = [recording(noise=Noise(noise * step, NOISE.current), seed=k) for k in range(80)]
    runs = [replace(run, y=np.round(run.y / step + 0.37 * k) * step) for k, run in enumerate(runs)]
    found = ratios(runs)
    for name in ("ahead", "force"):
        assert 0.8 <= found[name] <= 1.3, found
    assert 0.7 <= found["free_run"] <= 1.3, found  # a start speed misjudged now and then is no draw's usual size


def test_noise_that_grows_along_the_recording_has_its_floor() -> None:
    """Ten times as much in the last third: a level of the whole recording would miss by a factor of five."""
    runs = []
    for k in range(40):
        one = recording(noise=Noise(1e-7, NOISE.current), seed=k)
        more = np.where(one.t > 2.0, 1e-5, 1e-6) * np.random.default_rng(900 + k).standard_normal(one.t.size)
        runs.append(replace(one, y=one.y + more))
    found = ratios(runs)
    assert 0.8 <= found["ahead"] <= 1.3 and 0.8 <= found["force"] <= 1.3, found


def test_the_force_floor_of_encoder_noise_is_that_of_a_linear_filter() -> None:
    """The weak form is linear in position: white noise passes as m std |kernel''|."""
    noise = Noise(encoder=5e-6)
    one = recording(noise=noise, seed=4, duration=6.0)
    gap = gap_of(one)
    (half,) = Acceleration(Model("force"), (one,), 1).half_widths
    kernel = np.convolve(bump(half), [1.0, -2.0, 1.0]) / 1e-6
    assert gap.force_floor == pytest.approx(MASS * noise.encoder * float(np.linalg.norm(kernel)), rel=0.1)


def test_the_floor_follows_the_seed_alone() -> None:
    one = recording(noise=NOISE)
    assert gap_of(one) == gap_of(one)
    assert gap_of(one).ahead_floor != gap_of(one, seed=2).ahead_floor


def test_another_kind_of_axis_is_refused() -> None:
    with pytest.raises(UsageError, match="rotary"):
        measure_gaps(result(), [replace(recording(), axis="rotary")])


def test_a_free_wheel_is_measured_with_its_start_speed_refined() -> None:
    """A coast-down in closed form; its floor is the encoder's noise."""
    t = np.arange(200) * 1e-3
    v0, tau, brake = 0.6, MASS / 8.0, 1.5 / 8.0
    y = -brake * t + (v0 + brake) * tau * (1 - np.exp(-t / tau))
    y = y + 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    gap = gap_of(Recording("push", t, y, kind="free_wheel"))
    assert gap.free_run_floor == pytest.approx(1e-6 / np.std(y), rel=0.15)
    assert gap.free_run == pytest.approx(gap.free_run_floor, rel=0.15)


def test_only_square_currents_jump_within_a_sampling_interval() -> None:
    """The stand's other inputs are sines, ramps and those of a position loop; free wheels have none."""
    stand = read_campaign(Path(__file__).parents[2] / "data" / "stand" / "campaign.yaml")
    assert [r.name for r in stand.recordings if jumps_in(r)] == ["square_current_1", "square_current_2"]
