"""Figures of a fit: friction band, convergence, correlation, gap measures; and the files they go to."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

import linid.report
from linid.errors import DataError
from linid.report.figures.comparison import comparison_figure
from linid.report.figures.convergence import convergence_figure
from linid.report.figures.correlation import correlation_figure
from linid.report.figures.friction_curve import (
    force_unit,
    friction_band,
    friction_curve_figure,
    sample_parameters,
    speed_covered,
    steady_friction,
)
from linid.report.figures.gap_bars import gap_figure
from linid.report.figures.write import (
    fit_drawings,
    inside,
    validation_drawings,
    wanted,
    worst_recordings,
    write_drawings,
)
from linid.report.style import ERROR, MEASURED, MEASURED_LIGHT, MODEL, new_figure, save, style

from .samples import ESTIMATES, FITTED, NAN, coast, estimate, fit_result, gap, move

PARAMETERS = {
    "coulomb_force": 1.72,
    "static_force": 3.2,
    "stribeck_velocity": 0.02,
    "stribeck_exponent": 2.0,
    "viscous_friction": 6.5,
}


def test_steady_friction_at_known_points() -> None:
    v = np.array([0.0, 0.02, -0.02, 5.0])
    at_v_s = 1.72 + 1.48 / np.e + 6.5 * 0.02
    np.testing.assert_allclose(steady_friction(v, PARAMETERS), [3.2, at_v_s, -at_v_s, 1.72 + 32.5])


def test_samples_follow_the_covariance_and_keep_signs() -> None:
    draws = sample_parameters(fit_result(), 40_000, seed=2)
    for name in ("coulomb_force", "viscous_friction"):
        one = next(e for e in ESTIMATES if e.name == name)
        assert np.mean(draws[name]) == pytest.approx(one.value, rel=1e-3)
        assert np.std(draws[name]) == pytest.approx(one.std, rel=0.05)
    i, j = FITTED.index("coulomb_force"), FITTED.index("viscous_friction")
    drawn = np.corrcoef(draws["coulomb_force"], draws["viscous_friction"])[0, 1]
    assert drawn == pytest.approx(fit_result().correlation[i, j], abs=0.02)
    assert all((column > 0).all() for column in draws.values())
    assert np.ptp(draws["stribeck_exponent"]) == 0.0  # fixed


def test_what_is_not_identifiable_is_held() -> None:
    estimates = tuple(
        estimate("static_force", "F_S", "N", 3.2, NAN, status="not_identifiable") if e.name == "static_force" else e
        for e in ESTIMATES
    )
    result = fit_result(estimates=estimates)
    assert np.ptp(sample_parameters(result)["static_force"]) == 0.0
    assert "static_force" in friction_curve_figure(result, 1.0)._supxlabel.get_text()
    assert np.ptp(sample_parameters(fit_result(covariance=np.zeros((0, 0))))["coulomb_force"]) == 0.0


def test_band_holds_the_curve_and_is_reproducible() -> None:
    v = np.linspace(0, 2, 300)
    curve, low, high = friction_band(fit_result(), v, seed=4)
    assert np.all(low <= curve) and np.all(curve <= high)
    assert np.all(high - low > 0)
    for one, again in zip((curve, low, high), friction_band(fit_result(), v, seed=4), strict=True):
        np.testing.assert_array_equal(one, again)


def test_band_has_the_width_of_a_known_case() -> None:
    # only the Coulomb force is uncertain and v >> v_s: the half-width is 1.96 std
    covariance = np.zeros((len(FITTED), len(FITTED)))
    covariance[0, 0] = 0.02**2
    _, low, high = friction_band(fit_result(covariance=covariance), np.array([1.0]), samples=50_000)
    assert (high - low)[0] / 2 == pytest.approx(1.96 * 0.02, rel=0.03)


def test_friction_figure_marks_where_data_end() -> None:
    figure = friction_curve_figure(fit_result(), 0.8)
    whole, near = figure.axes
    curves = [line for line in whole.lines if line.get_color() == MODEL]
    solid = next(line for line in curves if line.get_linestyle() == "-")
    dashed = next(line for line in curves if line.get_linestyle() == "--")
    assert max(solid.get_xdata()) <= 0.8 < min(dashed.get_xdata())
    expected = steady_friction(solid.get_xdata(), {n: fit_result().value(n) for n in PARAMETERS})
    np.testing.assert_allclose(solid.get_ydata(), expected)
    assert whole.get_xlabel() == "speed (m/s)" and whole.get_ylabel() == "friction (N)"
    (shade,) = [p for p in whole.patches if isinstance(p, Rectangle)]
    assert shade.get_x() == pytest.approx(0.8)
    assert near.get_xlim()[1] == pytest.approx(6 * fit_result().value("stribeck_velocity"), rel=0.01)


def test_friction_figure_without_known_speeds_claims_none() -> None:
    figure = friction_curve_figure(fit_result(), 0.0)
    assert "not known" in figure._supxlabel.get_text()
    assert not figure.axes[0].patches


def test_friction_units() -> None:
    assert force_unit(fit_result(per_mass=True)) == "N/kg"
    rotary = tuple(estimate(e.name, e.symbol, "N m", e.value, e.std) for e in ESTIMATES)
    assert force_unit(fit_result(estimates=rotary, axis="rotary")) == "N m"
    assert (
        friction_curve_figure(fit_result(estimates=rotary, axis="rotary"), 9.0).axes[0].get_xlabel().endswith("rad/s)")
    )
    with pytest.raises(DataError, match="viscous_friction"):
        friction_curve_figure(fit_result(estimates=ESTIMATES[:4]), 1.0)


def test_speed_covered() -> None:
    assert speed_covered([coast(v0=0.4), coast(v0=0.6)]) == pytest.approx(0.6, rel=0.05)
    assert speed_covered([]) == 0.0


def test_convergence_draws_history() -> None:
    result = fit_result()
    figure = convergence_figure(result)
    stages = [axes.get_title(loc="left").replace("\n", "_") for axes in figure.axes]
    assert stages == ["genetic", "cma", "least_squares"]  # costs of stages are not comparable: a panel each
    for stage, axes in zip(stages, figure.axes, strict=True):
        lines = [g for g in result.history if g.stage == stage]
        drawn = np.concatenate([line.get_xydata() for line in axes.lines if line.get_color() == MODEL])
        np.testing.assert_allclose(drawn, [(g.evaluations, g.best) for g in lines])
        medians = np.concatenate([line.get_xydata() for line in axes.lines if line.get_color() == MEASURED_LIGHT])
        np.testing.assert_allclose(medians[:, 1], [g.median for g in lines])
    assert figure.axes[0].get_yscale() == "log" and "evaluations" in figure.axes[0].get_xlabel()
    text = figure._supxlabel.get_text()
    assert "60 steps used" in text and "not comparable" in text.replace("\n", " ")
    with pytest.raises(DataError):
        convergence_figure(fit_result(history=()))


@pytest.mark.parametrize("gain", [0.3, 0.03, 0.004])
@pytest.mark.parametrize("size", [1e-9, 1.3e-7, 4.53e-4, 0.0132, 0.7, 812.0, 4.5e4, 7e8])
def test_convergence_keeps_its_tick_labels_out_of_the_panel_beside(size: float, gain: float) -> None:
    """Costs of stages that gain little, so that their labels differ only in the last digits."""
    kind = type(fit_result().history[0])
    history = tuple(
        kind(stage, step, start + 30 * step, size * (1.0 + gain / (step + 1)), size * (1.0 + gain / (step + 0.9)))
        for stage, start in (("genetic", 100), ("least_squares_of_a_part", 1250), ("least_squares", 1340))
        for step in range(5)
    )
    figure = convergence_figure(fit_result(history=history))
    figure.draw_without_rendering()
    for left, right in pairwise(figure.axes):
        labels = [label for label in right.get_yticklabels() if label.get_text()]
        gap = min(one.get_window_extent().x0 for one in labels) - left.get_window_extent().x1
        assert gap > figure.dpi / 25.4  # a millimetre
        for one in labels:
            assert float(one.get_text()) == pytest.approx(one.get_position()[1], rel=6e-4)


def test_convergence_survives_bad_costs() -> None:
    """Costs that a logarithm does not have are left out; the others of their stage stay."""
    good = fit_result().history
    history = (type(good[0])("genetic", 0, 120, 0.0, float("inf")), *good[1:])
    figure = convergence_figure(fit_result(history=history, converged=False))
    figure.draw_without_rendering()
    kept = [g for g in good[1:] if g.stage == "genetic"]
    for colour, costs in ((MODEL, [g.best for g in kept]), (MEASURED_LIGHT, [g.median for g in kept])):
        drawn = next(line.get_ydata() for line in figure.axes[0].lines if line.get_color() == colour)
        np.testing.assert_allclose(drawn, [np.nan, *costs])
    low, high = figure.axes[0].get_ylim()
    assert 0.0 < low < high < np.inf
    assert "Did not converge" in figure._supxlabel.get_text()


def big_fit(count: int) -> object:
    names = tuple(f"parameter_number_{i}" for i in range(count))
    factor = np.random.default_rng(1).normal(size=(count, 6))
    matrix = factor @ factor.T + np.eye(count)
    scale = 1 / np.sqrt(np.diag(matrix))
    estimates = tuple(estimate(n, f"z_{i}", "1", 1, 1) for i, n in enumerate(names))
    pairs = ((names[-1], names[0], -0.999, ""), ("absent", names[0], 1.0, ""))
    return fit_result(fitted=names, estimates=estimates, correlation=matrix * np.outer(scale, scale), pairs=pairs)


@pytest.mark.parametrize("count", [2, 3, 12, 25])
def test_correlation_writes_every_value_inside_its_cell(count: int) -> None:
    result = big_fit(count)
    figure = correlation_figure(result)  # type: ignore[arg-type]
    figure.draw_without_rendering()
    axes = figure.axes[0]
    assert len(axes.texts) == count * (count - 1) // 2
    cell = axes.get_window_extent().width / (count - 1)
    assert max(text.get_window_extent().width for text in axes.texts) < cell
    for text in axes.texts:
        column, row = text.get_position()
        value = result.correlation[int(row) + 1, int(column)]  # type: ignore[attr-defined]
        assert float(text.get_text().replace("−", "-")) == pytest.approx(value, abs=0.0051)
    (box,) = [patch for patch in axes.patches if patch.get_edgecolor()[:3] != (0, 0, 0)]
    assert (box.get_x() + 0.5, box.get_y() + 0.5) == (0, count - 2)


def test_correlation_needs_two_parameters() -> None:
    with pytest.raises(DataError):
        correlation_figure(fit_result(fitted=("mass",), correlation=np.eye(1)))


@pytest.mark.parametrize("count", [1, 6, 30])
def test_gap_figure_draws_measures_and_floors(count: int) -> None:
    gaps = [gap(f"recording_{i}", free_run=0.001 * (i + 1), split="fit" if i % 2 else "held_out") for i in range(count)]
    figure = gap_figure(gaps)
    figure.draw_without_rendering()
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels == ["free run, NRMSE (%)", "0.1 s ahead, RMS (µm)", "residual force, RMS (N)"]
    dots = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    np.testing.assert_allclose([line.get_xdata()[0] for line in dots], [100 * g.free_run for g in gaps])
    assert [line.get_markerfacecolor() == MEASURED for line in dots] == [g.split == "held_out" for g in gaps]
    floors = [line.get_xdata()[0] for line in figure.axes[2].lines if line.get_marker() == "|"]
    np.testing.assert_allclose(floors, [g.force_floor for g in gaps])
    for axes in figure.axes:
        for text in axes.texts:
            assert text.get_window_extent().x1 <= axes.get_window_extent().x1 + 2
        assert len(axes.get_xticks()) >= 2
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == [g.recording for g in gaps]


def test_gap_figure_with_zero_and_missing_measures() -> None:
    gaps = [gap(free_run=NAN, ahead=0.0, ahead_floor=0.0), gap(force=0.0, force_floor=NAN)]
    figure = gap_figure(gaps, "rotary")
    figure.draw_without_rendering()
    assert any(t.get_text().strip() == "no value" and t.get_color() == ERROR for t in figure.axes[0].texts)
    assert "µrad" in figure.axes[1].get_xlabel() and "N m" in figure.axes[2].get_xlabel()


def test_fit_figures_are_written_under_stable_names(tmp_path: Path) -> None:
    seen: list[tuple[int, int, str]] = []
    drawings = fit_drawings(fit_result(), [coast(n=300), move("moves/3", n=300)])
    paths = write_drawings(drawings, tmp_path, formats=("png",), progress=lambda *call: seen.append(call))
    stems = [
        "free_wheel_displacement",
        "free_wheel_velocity",
        "friction_curve",
        "convergence",
        "correlation",
        "overview",
        "comparison_freewheel_1",
        "comparison_moves_3",
        "currents_moves_3",
    ]
    assert [path.name for path in paths] == [f"{stem}.png" for stem in stems]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    assert seen == [(i, len(stems), stem) for i, stem in enumerate(stems, 1)]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_validation_figures(tmp_path: Path) -> None:
    paths = write_drawings(validation_drawings([gap()], [move(n=300)]), tmp_path, formats=("png",))
    assert [path.name for path in paths] == ["gaps.png", "overview.png", "comparison_moves_3.png"]
    assert write_drawings(validation_drawings([], []), tmp_path / "none") == []


def test_the_few_are_overviews_and_the_worst_recordings(tmp_path: Path) -> None:
    gaps = [
        gap("moves_1", split="fit", ahead=9.0),  # the held-out ones judge
        gap("moves_3", ahead=2e-5),
        gap("moves_4", ahead=3e-5),
        gap("wheel_1", kind="free_wheel", split="fit", free_run=0.01),
        gap("wheel_2", kind="free_wheel", split="fit", free_run=NAN),  # diverged
    ]
    worst = worst_recordings(gaps)
    assert worst == {"moves_4", "wheel_2"} and worst_recordings([]) == frozenset()
    traces = [replace(move(n=300), recording=name) for name in ("moves_3", "moves_4")]
    drawings = inside("held_out", validation_drawings(gaps, traces, worst))
    assert [d.stem.removeprefix("held_out/") for d in wanted(drawings, "few")] == [
        "gaps",
        "overview",
        "comparison_moves_4",
    ]
    assert wanted(drawings, "all") == drawings and wanted(drawings, "none") == []
    write_drawings(wanted(drawings, "few"), tmp_path, formats=("pdf",))
    assert len(re.findall(rb"/Type /Page\b", (tmp_path / "held_out" / "comparison.pdf").read_bytes())) == 1


def test_recordings_are_pages_where_pdf_is_wanted(tmp_path: Path) -> None:
    traces = [replace(move(n=300), recording=name) for name in ("moves_3", "moves_4")]
    drawings = inside("held_out", validation_drawings([gap()], traces))
    paths = write_drawings(drawings, tmp_path, formats=("png", "pdf"), processes=2)
    names = ["comparison.pdf", "gaps.png", "gaps.pdf", "overview.png", "overview.pdf"]
    assert paths == [tmp_path / "held_out" / name for name in names]
    assert paths[0].read_bytes().count(b"/Type /Page\n") + paths[0].read_bytes().count(b"/Type /Page ") == len(traces)


def test_equal_figures_give_equal_files(tmp_path: Path) -> None:
    def write(folder: str) -> list[bytes]:
        paths = save(comparison_figure(move(n=300)), tmp_path / folder / "a", ("png", "pdf", "svg"))
        assert [path.suffix for path in paths] == [".png", ".pdf", ".svg"]
        return [path.read_bytes() for path in paths]

    assert write("one") == write("two")


def test_threads_draw_the_same_as_one_thread(tmp_path: Path) -> None:
    def draw(index: int) -> bytes:
        (path,) = save(comparison_figure(move(n=300)), tmp_path / str(index), ("png",))
        return path.read_bytes()

    with ThreadPoolExecutor(4) as pool:
        assert len(set(pool.map(draw, range(4)))) == 1


def test_style_leaves_no_trace_and_ignores_the_users_settings() -> None:
    import matplotlib

    before = {key: value for key, value in matplotlib.rcParams.items() if key != "backend"}
    with matplotlib.rc_context({"axes.grid": False, "font.size": 30, "lines.linewidth": 9}):
        with style():
            assert matplotlib.rcParams["font.size"] == 8 and matplotlib.rcParams["axes.grid"]
            figure = new_figure(100.0)
        assert matplotlib.rcParams["font.size"] == 30
    assert {key: value for key, value in matplotlib.rcParams.items() if key != "backend"} == before
    assert figure.get_size_inches()[0] * 25.4 == pytest.approx(160.0)


def test_matplotlib_and_rich_are_imported_late() -> None:
    code = (
        "import sys, linid.report.tables, linid.report.figures.write\n"
        "print([m for m in ('matplotlib', 'rich', 'scipy', 'pandas', 'numba') if m in sys.modules])"
    )
    root = Path(linid.report.__file__).parents[2]
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root, check=True)
    assert answer.stdout.strip() == "[]"


def test_no_figure_uses_pyplot() -> None:
    for path in Path(linid.report.__file__).parent.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
        names += [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        assert not [name for name in names if "pyplot" in name]
