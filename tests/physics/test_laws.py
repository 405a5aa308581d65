"""Friction laws: closed forms against slow integration, slopes against differences, and what their tables say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from linid.errors import UsageError
from linid.physics import friction
from linid.physics.laws import dahl, elasto_plastic, maxwell_slip
from linid.physics.laws.law import MOST_OWN
from linid.physics.laws.registry import LAWS, find_law
from linid.physics.model import MASS, Model

REST, BREAKAWAY = 2.3e-4, 1.8e-4
SINGLE = [(dahl, 0.6), (dahl, 1.0), (dahl, 1.7), (elasto_plastic, 0.3), (elasto_plastic, 0.8)]


def _end(law, w: float, travel: float, own: tuple[float, ...]) -> float:
    """The deflection in m after a travel in m."""
    if law is dahl:
        return float(dahl.passed(w, travel, REST, BREAKAWAY, own)[0])
    return float(law.moved(w, travel, REST, BREAKAWAY, own))


@pytest.mark.parametrize(("law", "own"), SINGLE)
@pytest.mark.parametrize("travel", [3e-5, -2e-4, 1.1e-3])
@pytest.mark.parametrize("first", [0.0, 1.2e-4, -2.2e-4])
def test_a_travel_is_the_integral_of_the_rate(law, own: float, travel: float, first: float) -> None:
    values, way = (own, 0.0, 0.0, 0.0), math.copysign(1.0, travel)

    def slope(x: float, w: np.ndarray) -> list[float]:
        return [way * law.rate(float(w[0]), way, REST, BREAKAWAY, values)[0]]

    slow = solve_ivp(slope, (0.0, abs(travel)), [first], rtol=1e-10, atol=1e-15, max_step=abs(travel) / 400)
    assert _end(law, first, travel, values) == pytest.approx(slow.y[0, -1], rel=1e-4, abs=2e-8)


@pytest.mark.parametrize("own", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("rest", [0.85 * BREAKAWAY, BREAKAWAY, 1.6 * BREAKAWAY])
def test_an_elasto_plastic_bristle_nears_steady_sliding_as_its_rate_says(own: float, rest: float) -> None:
    """From near and far on both sides, also where effects bring the steady deflection below that of breakaway and all
    slipping begins within a hundredth of it."""
    values = (own, 0.0, 0.0, 0.0)

    def slope(x: float, u: np.ndarray) -> list[float]:
        return [elasto_plastic.rate(float(u[0]) * rest, 1.0, rest, BREAKAWAY, values)[0]]

    for missing in (1e-6, 1e-3, 0.03, 0.4, 1.2, -1e-5, -0.2):
        for travel in (0.05, 0.9, 7.0):
            slow = solve_ivp(
                slope, (0.0, travel), [1.0 - missing], method="LSODA", rtol=1e-10, atol=1e-12, max_step=2e-3
            )
            found = elasto_plastic.moved((1.0 - missing) * rest, travel * rest, rest, BREAKAWAY, values) / rest
            assert found == pytest.approx(slow.y[0, -1], abs=5e-5)
            if abs(missing) < 1e-3:
                assert found == pytest.approx(slow.y[0, -1], abs=1e-8)


@pytest.mark.parametrize(("law", "own"), SINGLE)
@pytest.mark.parametrize("w", [3e-5, 2.0e-4, -1.0e-4])
def test_slopes_of_the_rate_are_its_differences(law, own: float, w: float) -> None:
    values, step = (own, 0.0, 0.0, 0.0), 1e-6
    value, by_w, by_rest = law.rate(w, 1.0, REST, BREAKAWAY, values)
    up, down = (law.rate(w + sign * step * REST, 1.0, REST, BREAKAWAY, values)[0] for sign in (1, -1))
    assert by_w == pytest.approx((up - down) / (2 * step * REST), rel=1e-3, abs=1.0)
    up, down = (law.rate(w, 1.0, REST * math.exp(sign * step), BREAKAWAY, values)[0] for sign in (1, -1))
    assert by_rest == pytest.approx((up - down) / (2 * step), rel=1e-3, abs=1e-4)
    assert value >= 0.0


@settings(deadline=None, max_examples=300)
@given(
    exponent=st.one_of(st.floats(0.3, 3.0), st.sampled_from([1.0, 1.5, 2.0, 1.0 + 1e-8, 1.5 - 1e-6, 2.0 + 1e-9])),
    size=st.floats(-6.0, 0.3).map(lambda x: 10.0**x),
    over=st.booleans(),
    way=st.floats(-4.0, 2.0).map(lambda x: 10.0**x),
    back=st.booleans(),
)
def test_dahls_means_are_integrals_of_its_way(exponent: float, size: float, over: bool, way: float, back: bool) -> None:
    """From below and beyond steady sliding, also where exponents make powers of logarithms."""
    side = -REST if back else REST
    own, w = (exponent, 0.0, 0.0, 0.0), side * (1.0 + size if over else 1.0 - size)
    _, mean, late = dahl.passed(w, way * side, REST, BREAKAWAY, own)
    there = size ** (1.0 - exponent) / (1.0 - exponent) if exponent < 0.99 else math.inf  # where it slides steadily
    ends = [x for x in (size, size / 10.0, there) if 0.0 < x < way]

    def at(s: float) -> float:
        return float(dahl.passed(w, s * side, REST, BREAKAWAY, own)[0]) / side

    first = quad(at, 0.0, way, points=ends or None, limit=400)[0] / way
    second = quad(lambda s: s * at(s), 0.0, way, points=ends or None, limit=400)[0] / way**2
    assert mean / side == pytest.approx(first, abs=2e-6)
    assert late / side == pytest.approx(second, abs=2e-6)


def test_dahls_law_with_exponent_one_bends_as_lugre_does() -> None:
    expected = REST + (5e-5 - REST) * math.exp(-1e-4 / REST)
    assert _end(dahl, 5e-5, 1e-4, (1.0, 0.0, 0.0, 0.0)) == pytest.approx(expected, rel=1e-12)


def test_an_elasto_plastic_bristle_does_not_drift_below_breakaway() -> None:
    """LuGre's creeps in small loops; this one comes back to where it was (Dupont et al. 2002)."""
    w, own = 0.0, (0.7, 0.0, 0.0, 0.0)
    for travel in [6e-5, -6e-5] * 50:
        w = elasto_plastic.moved(w, travel, REST, BREAKAWAY, own)
    assert w == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize("own", [(0.5, 0.0, 0.0, 0.0), (0.3, 0.6, -0.2, 0.3), (1.0, -0.9, 0.6, -0.6)])
def test_shares_of_elements_sum_to_one(own: tuple[float, ...]) -> None:
    shares = np.array([maxwell_slip.shape(k, own) for k in range(maxwell_slip.ELEMENTS)])
    assert np.allclose(shares.sum(axis=0), 1.0) and np.all(shares > 0.0)


def test_every_law_says_what_it_is() -> None:
    names = {p.name for p in friction.PARAMETERS}
    for law in LAWS.values():
        assert law.title and law.meaning and law.source and set(law.absent) <= names
        assert len(law.own) <= MOST_OWN and all(p.meaning for p in law.own)
        model = Model("friction", law=law.name)
        assert {p.name for p in model.parameters} == (names - set(law.absent)) | {p.name for p in law.own}
        assert len({model.slot(p.name) for p in model.parameters}) == len(model.parameters)
    with pytest.raises(UsageError, match="there is no friction law 'dahls'"):
        find_law("dahls")


def test_what_a_law_lacks_is_tied() -> None:
    values = {"coulomb_force": 3.0, "static_force": 9.0, "mass": 0.7, "bristle_damping": 5.0}
    vector = Model("friction", law="dahl").vector(values)
    model = Model("friction")
    assert vector[model.slot("static_force")] == 3.0 and vector[model.slot("bristle_damping")] == 0.0
    vector = Model("friction", law="coulomb").vector(values)
    assert vector[MASS] * 1e6 < vector[model.slot("bristle_stiffness")]


def test_windings_go_with_lugre_only() -> None:
    with pytest.raises(UsageError, match="not simulated together with the windings"):
        Model("sine", (), "star", "maxwell_slip")
