"""The benchmark code itself works; its figures decide nothing."""

from __future__ import annotations

import pytest

from tests.benchmarks.__main__ import simulation_times
from tests.benchmarks.jacobian import costs
from tests.benchmarks.lockstep import figures as side_by_side


def test_simulation_benchmark_gives_its_figures() -> None:
    figures = simulation_times(1)
    assert figures["theta / sine"] > 0.0 and figures["theta: ns per internal step"] > 0.0


@pytest.mark.parametrize("effects", [(), ("cogging",)])
def test_jacobian_benchmark_gives_its_figures(effects: tuple[str, ...]) -> None:
    figures = costs("sine", effects, 1)
    assert 0.0 < figures["simulations carried along"] < figures["simulations by differences"]


def test_benchmark_of_simulations_side_by_side_gives_its_figures() -> None:
    assert all(one["ratio"] > 0.0 and one["apart, m"] < 1e-10 for one in side_by_side(1).values())
