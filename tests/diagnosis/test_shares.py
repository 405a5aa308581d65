"""Order-free shares: closed forms of Shapley's value, exact and by sampled orders."""

from __future__ import annotations

import numpy as np
import pytest

from linid.diagnosis.shares import _shapley, _subsets


def game(parts: dict[str, np.ndarray]) -> dict[frozenset[str], np.ndarray]:
    """Mean square of what is missing while a set of additive parts is explained, in one block."""
    names = tuple(parts)
    whole = sum(parts.values())
    out = {}
    for subset in _subsets(names, 1):
        left = whole - sum((parts[name] for name in subset), np.zeros_like(whole))
        out[frozenset(subset)] = np.array([float(left @ left)])
    return out


@pytest.mark.parametrize("count", [2, 4, 8])
def test_shares_of_additive_causes_are_their_covariances_with_the_sum(count: int) -> None:
    """v(S) = |sum of what is not in S|^2 has Shapley's value <r_e, r>, which sums to the whole."""
    random = np.random.default_rng(count)
    parts = {f"e{k}": random.standard_normal(200) * (1.0 + k) for k in range(count)}
    whole = sum(parts.values())
    values = game(parts)
    found = _shapley(tuple(parts), values, 1)
    total = float(whole @ whole)
    assert sum(float(x[0]) for x in found.values()) == pytest.approx(total)
    tolerance = 1e-9 if count <= 6 else 0.05
    for name, part in parts.items():
        assert float(found[name][0]) == pytest.approx(float(part @ whole), abs=tolerance * total)


def test_two_causes_that_hide_each_other_share_what_they_hide() -> None:
    """Opposite parts: alone neither closes anything, together nothing is missing."""
    part = np.ones(10)
    found = _shapley(("a", "b", "c"), game({"a": part, "b": -part, "c": 2.0 * part}), 1)
    assert float(found["a"][0]) == pytest.approx(20.0)
    assert float(found["b"][0]) == pytest.approx(-20.0)
    assert float(found["c"][0]) == pytest.approx(40.0)
