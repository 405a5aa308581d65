"""The measurement of growth itself: its points, its resumption, its slopes. No test looks at speed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import growth
from tests.benchmarks.growth_report import Line, Point, table


def test_points_are_measured_once_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = growth.grow(tmp_path, {"read": (1000,), "population": (10, 30)})
    assert {(p.series, p.size) for p in points} == {("read", 1000), ("population", 10), ("population", 30)}
    assert all(value > 0.0 for p in points for value in p.seconds.values())
    assert all(p.peak_mb >= p.base_mb > 50.0 for p in points)
    assert (tmp_path / "growth.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "growth.md").read_text(encoding="utf-8").count("\n") == 2 + len(points)
    calls: list[tuple[str, ...]] = []
    run = growth._run
    monkeypatch.setattr(growth, "_run", lambda *arguments: calls.append(arguments) or run(*arguments))
    again = growth.grow(tmp_path, {"read": (1000, 3000), "population": (10,)}, resume=True)
    assert again[:3] == points and [p.size for p in again[3:]] == [3000]
    assert [call[1:3] for call in calls if call[0] == "--point"] == [("read", "3000")]
    assert len(json.loads((tmp_path / "growth.json").read_text(encoding="utf-8"))) == 4


def test_the_recorded_motion_is_that_of_the_axis() -> None:
    """The problem's cost at the true values is that of the encoder's noise, and no other candidate is better."""
    recording = growth.make_recording(3000)
    problem, point = growth.make_problem([recording])
    cost = growth.Cost(problem)
    residuals = problem.residuals(point[None, :], np.zeros((1, 0)))[0]
    assert np.sqrt(np.mean(residuals**2)) < 20.0 * growth.NOISE
    assert cost(point)[0] < cost(growth.candidates(problem, 50)).min()


def test_the_slope_is_that_of_the_largest_sizes() -> None:
    x = 10.0 ** np.arange(3, 8)
    slope, factor, begin = Line("read", list(x), list(3e-6 * x + 1.0)).fitted
    assert begin == 1e6 and slope == pytest.approx(0.89, abs=0.01)
    assert factor * 1e7**slope == pytest.approx(31.0)
    assert np.isnan(Line("read", [1e3], [1.0]).fitted[0])


def test_the_table_has_a_row_for_each_point() -> None:
    text = table([Point("read", 3000, {"read": 0.02}, 200.0, 150.0), Point("read", 1000, {"read": 0.01}, 190.0, 150.0)])
    assert text.splitlines()[2:] == [
        "| read | 1000 | read 0.01 s | 190 | 150 |",
        "| read | 3000 | read 0.02 s | 200 | 150 |",
    ]
