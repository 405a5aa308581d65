"""The benchmark code itself works; its figures decide nothing."""

from __future__ import annotations

import pytest

from tests.benchmarks.__main__ import simulation_times
from tests.benchmarks.jacobian import costs


def test_simulation_benchmark_gives_its_figures() -> None:
    figures = simulation_times(1)
    assert figures["theta / sine"] > 0.0 and figures["theta: ns per internal step"] > 0.0


@pytest.mark.parametrize("effects", [(), ("cogging",)])
def test_jacobian_benchmark_gives_its_figures(effects: tuple[str, ...]) -> None:
    figures = costs("sine", effects, 1)
    assert 0.0 < figures["simulations carried along"] < figures["simulations by differences"]
