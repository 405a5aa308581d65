"""The kernel's profile gives its figures; they decide nothing."""

from __future__ import annotations

from tests.benchmarks.kernel import Case, cases, clock, copy_bandwidth, float32_ranking, profile
from tests.benchmarks.operations import KINDS

SECONDS = 0.01


def friction_case(name: str) -> Case:
    return next(case for case in cases("friction") if case.name == name).part(4, 10)


def test_windows_hold_steps_of_one_kind_and_figures_follow() -> None:
    costs = {kind: {"latency": 4.0, "throughput": 1.0} for kind in KINDS}
    frequency = clock(SECONDS)
    sliding = profile(friction_case("sliding"), costs, SECONDS, frequency)
    followed = profile(friction_case("followed"), costs, SECONDS, frequency)
    assert sliding["followed"] == 0.0 and followed["followed"] == 1.0
    assert sliding["operations"]["exp"] == 0.0 and followed["operations"]["exp"] > 1.0
    assert followed["chain"] > sliding["chain"] > 0.0 and copy_bandwidth(SECONDS) > 0.0


def test_float32_ranks_candidates_that_differ_much() -> None:
    assert float32_ranking(3)["spread 0.1: rank correlation"] > 0.9
