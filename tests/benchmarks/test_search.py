"""The page on searches counts what arrives; the motors are those of the paper's tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.benchmarks.search import NAMES, Run, figure, lowest, motor, page


def runs() -> list[Run]:
    found = []
    for kind in NAMES:
        for seed, cost in enumerate((1.0, 1.005, 2.0), 1):
            found.append(Run(kind, "scratch", seed, cost, 10.0 * seed, [[100.0, 9.0], [400.0, cost]]))
        found.append(Run(kind, "plain", 1, 42.0, 60.0, [[64.0, 90.0], [6400.0, 42.0]]))
    return found


def test_a_seed_that_ends_elsewhere_is_not_counted(tmp_path: Path) -> None:
    text = page(runs())
    assert lowest(runs(), "sine") == 1.0
    row = next(line for line in text.splitlines() if line.startswith("| sine model, motor of table 2 |"))
    assert row.endswith(" | 2 of 3 | 20 s, at most 30 s | 400 | 42 times the lowest cost after 6400 | 640000 |")
    figure(runs(), tmp_path / "convergence.png")
    assert (tmp_path / "convergence.png").stat().st_size > 10_000


def test_the_motors_are_the_paper_s() -> None:
    sine, theta = motor("sine"), motor("theta_3")
    assert sine.force_constant_n_per_a == 133.8 and sine.winding_displacement_rad == pytest.approx(0.5368)
    assert motor("theta_2") == sine  # by the theta model
    assert theta.kind == "theta" and theta.nome == 0.493 and theta.winding_length_rad == pytest.approx(1.376)
