"""The curve of a proposed term holds the truth within its band, and keeps to the data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.curve import term_curve
from linid.diagnosis.proposed.estimate import estimated
from linid.diagnosis.proposed.family import per_recording
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.waves import wave_families
from linid.diagnosis.report_data import TermCurve
from tests.diagnosis.proposed.axis import STROKE, axis, proposal_of

SEEDS = 12


def hill(y: Array) -> Array:
    """A smooth force in N over position in m."""
    return np.exp(-0.5 * ((y - 0.2) / 0.06) ** 2) - 0.5 * np.sin(2.0 * math.pi * y / STROKE)


def shown(problem: Problem, proposal: Proposal) -> TermCurve:
    found = term_curve(problem, proposal)
    assert found is not None
    return found


def told_truth(problem: Problem, proposal: Proposal, truth: Array, x: Array) -> Array:
    """The truth (n,) at all rows as a curve at x (m,), without what the base can do."""
    side = proposal.family.sides[0]
    rows = ~problem.held
    coefficients = np.linalg.lstsq(side.at(side.argument.values[rows]), truth[rows], rcond=1e-9)[0]
    return np.asarray(side.at(x) @ (estimated(problem, proposal.regression).told @ coefficients))


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_the_band_holds_the_truth_over_seeds(memory: float) -> None:
    """Also where the noise of neighbouring rows hangs together."""
    inside, width = [], []
    for seed in range(SEEDS):
        problem = axis(lambda p: hill(p.rows.y), seed, memory=memory)
        proposal = proposal_of(problem, "position")
        curve = shown(problem, proposal)
        truth = told_truth(problem, proposal, hill(problem.rows.y), curve.axes[0].x)
        known = np.isfinite(curve.value)
        inside.append(np.mean((truth >= curve.low)[known] & (truth <= curve.high)[known]))
        width.append(np.nanmedian(curve.high - curve.value))
    assert 0.90 <= np.mean(inside) <= 0.995
    assert np.median(width) < (0.03 if memory == 0.0 else 0.15)


def test_a_friction_over_position_is_positive_where_it_resists_more() -> None:
    problem = axis(lambda p: p.friction * (1.0 + 0.5 * np.sin(10.0 * p.rows.y)))
    curve = shown(problem, proposal_of(problem, "position x direction"))
    assert (curve.factor, curve.unit, curve.axes[0].argument) == ("direction", "N", "position")
    wave = 0.5 * np.sin(10.0 * curve.axes[0].x)
    known = np.isfinite(curve.value)
    assert np.corrcoef(curve.value[known], wave[known])[0, 1] > 0.99
    assert abs(np.nanmean(curve.value)) < 0.25  # the 1 N that the base can do is not in it


def test_a_factor_of_the_motor_force_has_no_unit() -> None:
    problem = axis(lambda p: -0.1 * p.push * np.abs(p.rows.v))
    curve = shown(problem, proposal_of(problem, "speed x motor force"))
    assert (curve.factor, curve.unit, curve.axes[0].label) == ("motor_force", "1", "speed")
    x, known = curve.axes[0].x, np.isfinite(curve.value)
    assert np.polyfit(x[known], curve.value[known], 1)[0] == pytest.approx(-0.1, abs=0.01)


@pytest.mark.parametrize(("rotary", "unit"), [(False, "N s/m"), (True, "N m s/rad")])
def test_units_of_a_factor_of_velocity(rotary: bool, unit: str) -> None:
    problem = axis(lambda p: -p.rows.v * hill(p.rows.y), rotary=rotary)
    assert shown(problem, proposal_of(problem, "position x velocity")).unit == unit


def test_a_periodic_curve_is_drawn_over_one_period() -> None:
    problem = axis(lambda p: 0.5 * np.sin(200.0 * p.rows.y + 1.0))
    curve = shown(problem, proposal_of(problem, "pole_phase"))
    x = curve.axes[0].x
    assert (x[0], x[-1]) == pytest.approx((0.0, 2.0 * math.pi / 200.0))
    assert "period" in curve.axes[0].label
    np.testing.assert_allclose(curve.value, 0.5 * np.sin(200.0 * x + 1.0), atol=0.03)
    assert curve.value[0] == pytest.approx(curve.value[-1])


@pytest.mark.parametrize(("number", "periods"), [(1, True), (2, False)])
def test_waves_are_drawn_over_a_period_or_over_the_stroke(number: int, periods: bool) -> None:
    lengths = (0.031, 0.047)[:number]
    problem = axis(lambda p: sum(0.5 * np.sin(2.0 * math.pi * p.rows.y / one) for one in lengths))
    family = next(iter(wave_families(problem, arguments_of(problem), Leftover(problem).of_rows)))
    curve = shown(problem, proposal_of(problem, family))
    x = curve.axes[0].x
    assert (x[-1] - x[0] < 0.035) == periods
    truth = sum(0.5 * np.sin(2.0 * math.pi * x / one) for one in lengths)
    known = np.isfinite(curve.value)
    np.testing.assert_allclose(curve.value[known], truth[known], atol=0.1)


def test_a_surface_has_the_first_argument_along_its_rows_and_no_value_without_data() -> None:
    problem = axis(lambda p: 3.0 * p.rows.v * np.sin(8.0 * p.rows.y))
    curve = shown(problem, proposal_of(problem, "position and velocity"))
    assert [one.argument for one in curve.axes] == ["position", "velocity"]
    y, v = (one.x for one in curve.axes)
    assert curve.value.shape == (v.size, y.size)
    known = np.isfinite(curve.value)
    assert 0.3 < known.mean() < 1.0  # at the ends of the stroke nothing is fast
    truth = 3.0 * v[:, None] * np.sin(8.0 * y)
    by_base = np.broadcast_to(v[:, None], known.shape)
    columns = np.stack([truth[known], by_base[known], np.ones(known.sum())], axis=1)
    share, left = np.linalg.lstsq(columns, curve.value[known], rcond=None)[:2]
    assert share[0] == pytest.approx(1.0, abs=0.05)
    assert left[0] < 0.05 * float(np.sum(curve.value[known] ** 2))
    assert np.all(np.isnan(curve.low) == ~known)


def test_what_the_base_can_do_is_not_in_the_curve() -> None:
    """A drag in v^3 is shown without the viscous part that the base takes up."""
    problem = axis(lambda p: -2.0 * p.rows.v**3)
    curve = shown(problem, proposal_of(problem, "velocity"))
    v = problem.rows.v[~problem.held]
    on_rows = np.interp(v, curve.axes[0].x, np.nan_to_num(curve.value))
    assert abs(float(on_rows @ v)) / float(v @ v) < 0.05


def test_coefficients_of_each_recording_make_no_curve() -> None:
    problem = axis(lambda p: p.rows.recording * 0.1 * p.rows.v)
    family = next(one for one in per_recording(problem, 0.5) if one.form == "damping per recording")
    assert term_curve(problem, proposal_of(problem, family)) is None
