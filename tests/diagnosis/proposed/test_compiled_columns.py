"""Compiled columns against what numpy and scipy make of the same formulas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.linalg import solve_banded

from linid.diagnosis.proposed.response import pushed_rows, rates_of, resisted_rows
from linid.diagnosis.proposed.spline_columns import uniform_splines
from linid.diagnosis.proposed.wave_columns import wave_columns
from linid.diagnosis.proposed.wave_scan import normal_equations, waves_beside

SEEDS = st.integers(0, 2**32 - 1)


@settings(deadline=None, max_examples=50)
@given(seed=SEEDS, size=st.integers(4, 40))
def test_splines_are_those_of_scipy(seed: int, size: int) -> None:
    pieces = size - 3
    places = np.random.default_rng(seed).uniform(0.0, pieces, 200)
    places[:3] = 0.0, pieces, pieces // 2
    knots = np.arange(-3.0, pieces + 4.0)
    expected = BSpline.design_matrix(places, knots, 3).toarray()
    assert np.allclose(uniform_splines(places, pieces, size), expected, rtol=0.0, atol=1e-14)


@settings(deadline=None, max_examples=50)
@given(seed=SEEDS, size=st.integers(4, 20))
def test_splines_around_a_circle_close_it(seed: int, size: int) -> None:
    """They sum to one, and are the same one interval on, but for their number."""
    places = np.random.default_rng(seed).uniform(0.0, size, 100)
    found = uniform_splines(places, size, size)
    assert np.allclose(found.sum(axis=1), 1.0)
    onward = uniform_splines(np.mod(places + 1.0, size), size, size)
    assert np.allclose(onward, np.roll(found, 1, axis=1), atol=1e-12)


def test_where_there_is_no_place_there_is_no_value() -> None:
    found = uniform_splines(np.array([0.5, np.nan, -1.0, 9.0]), 5, 8)
    assert np.all(np.isfinite(found[0])) and np.all(np.isnan(found[1:]))


@settings(deadline=None, max_examples=50)
@given(seed=SEEDS, rows=st.integers(3, 60), width=st.integers(1, 5))
def test_rows_are_what_the_formulas_say(seed: int, rows: int, width: int) -> None:
    draw = np.random.default_rng(seed)
    forces, mass = draw.standard_normal((rows, width)), draw.uniform(0.5, 2.0, rows)
    place, kept = draw.integers(0, rows, rows), draw.uniform(0.0, 1.0, rows)
    expected = (forces - kept[:, None] * forces[place]) / mass[:, None]
    assert np.allclose(pushed_rows(forces, place, kept, mass), expected)

    t, inner = np.cumsum(draw.uniform(0.1, 1.0, rows)), draw.uniform(size=rows) < 0.7
    inner[[0, -1]] = False
    slopes = np.zeros_like(forces)
    slopes[1:-1] = (forces[2:] - forces[:-2]) / (t[2:] - t[:-2])[:, None]
    assert np.allclose(rates_of(forces, t, inner), np.where(inner[:, None], slopes, 0.0))

    share = draw.standard_normal(rows)
    band = np.stack([np.ones(rows), -np.append(kept[1:], 0.0)])
    bent = solve_banded((1, 0), band, share[:, None] * forces) / mass[:, None]
    assert np.allclose(resisted_rows(forces, share, kept, mass), bent, atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(seed=SEEDS, step=st.floats(1e-3, 3.0), blurred=st.booleans())
def test_wavenumbers_beside_each_other_are_as_each_alone(seed: int, step: float, blurred: bool) -> None:
    draw, many = np.random.default_rng(seed), 4
    x, factor = draw.uniform(-2.0, 2.0, 50), draw.standard_normal(50)
    spread = draw.uniform(0.0, 0.05, 50) if blurred else np.zeros(50)
    found = waves_beside(x, spread, factor, 40.0, step, many)
    for m in range(2 * many + 1):
        expected = wave_columns(x, (40.0 + (m - many) * step,), spread) * factor[:, None]
        assert np.allclose(found[m], expected, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 16])
def test_normal_equations_of_classes_are_those_of_all_columns(count: int) -> None:
    """Also where what the bristle holds is of a rest in another class; rows that do not count are left out."""
    draw, rows = np.random.default_rng(count), 400
    pair, owner = draw.standard_normal((rows, 2)), draw.integers(0, count, rows)
    place, kept = draw.integers(0, rows, rows), draw.uniform(0.0, 1.0, rows)
    scale = np.where(draw.uniform(size=rows) < 0.2, 0.0, draw.uniform(0.5, 2.0, rows))
    rest = draw.standard_normal(rows)
    columns = (pair[:, :, None] * (owner[:, None] == np.arange(count))[:, None, :]).transpose(0, 2, 1).reshape(rows, -1)
    columns = scale[:, None] * (columns - kept[:, None] * columns[place])
    normal, moment = normal_equations(pair, owner, count, place, kept, scale, rest)
    assert np.allclose(normal, columns.T @ columns)
    assert np.allclose(moment, columns.T @ np.where(scale != 0.0, rest, 0.0))
