"""Figures of motion draw the data that they were given, with units, whatever state the data are in."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from linid.errors import DataError
from linid.recording.recording import Recording
from linid.report.figures.by_voltage import ByVoltage, by_voltage_figure
from linid.report.figures.coast_down import coast_down_figure
from linid.report.figures.common import breakdown
from linid.report.figures.comparison import comparison_figure
from linid.report.figures.currents import currents_figure, liveliest
from linid.report.figures.free_wheel import free_wheel_displacement_figure, free_wheel_velocity_figure, until_rest
from linid.report.figures.operation import operation_figure
from linid.report.figures.overview import overview_figure
from linid.report.style import ACCENT, ERROR, MEASURED, MODEL

from .samples import coast, move, pieces, trace


def lines(axes: Any, colour: str) -> list[Any]:
    """The lines of one colour that carry data (not the straight helper lines)."""
    return [line for line in axes.lines if line.get_color() == colour and len(line.get_xdata()) > 2]


def assert_sound(figure: Figure) -> None:
    """Every axes holds data and says its units; nothing sits outside the page."""
    figure.draw_without_rendering()
    assert figure.axes
    for axes in figure.axes:
        assert axes.lines or axes.images or axes.collections
        shared = [other for other in figure.axes if other.get_position().y0 == axes.get_position().y0]
        assert any("(" in other.get_ylabel() for other in shared)
        column = [other for other in figure.axes if abs(other.get_position().x0 - axes.get_position().x0) < 1e-6]
        assert any("(" in other.get_xlabel() for other in column)
        box = axes.get_tightbbox()
        assert box.x0 >= -1 and box.y0 >= -1
        assert box.x1 <= figure.bbox.x1 + 1 and box.y1 <= figure.bbox.y1 + 1


def assert_no_overlap(figure: Figure) -> None:
    """No axes, labels included, reaches into another."""
    figure.draw_without_rendering()
    boxes = [axes.get_tightbbox() for axes in figure.axes]
    for i, one in enumerate(boxes):
        for other in boxes[i + 1 :]:
            width = min(one.x1, other.x1) - max(one.x0, other.x0)
            height = min(one.y1, other.y1) - max(one.y0, other.y0)
            assert width <= 2 or height <= 2


def test_comparison_draws_the_data() -> None:
    one = move(n=1500)
    figure = comparison_figure(one)
    assert_sound(figure)
    assert_no_overlap(figure)
    position, velocity, error = figure.axes
    assert position.get_ylabel() == "position (mm)" and velocity.get_ylabel() == "velocity (m/s)"
    assert error.get_ylabel() == "error (µm)" and error.get_xlabel() == "time (s)"
    assert "moves_3 (motor, held out)" in position.get_title(loc="left")
    for axes, measured, simulated in (
        (position, one.y_measured * 1e3, one.y_simulated * 1e3),
        (velocity, one.velocity_measured, one.velocity_simulated),
    ):
        np.testing.assert_array_equal(lines(axes, MEASURED)[0].get_xdata(), one.t)
        np.testing.assert_allclose(lines(axes, MEASURED)[0].get_ydata(), measured)
        np.testing.assert_allclose(lines(axes, MODEL)[0].get_ydata(), simulated)
    np.testing.assert_allclose(lines(error, ERROR)[0].get_ydata(), (one.y_simulated - one.y_measured) * 1e6)
    size = np.sqrt(np.mean((one.y_simulated - one.y_measured) ** 2)) * 1e6
    assert error.get_title(loc="right") == f"model minus measured, RMS error {size:.3g} µm"


def driven(**changes: Any) -> Any:
    """A move with its restarted predictions, whose free run slips by two pole pitches from the middle on."""
    one = move(n=2000)
    slipped = one.y_simulated + np.where(one.t > 1.0, 0.048, 0.0)
    return replace(one, **{"ahead": pieces(one), "pole_pitch": 0.024, "y_simulated": slipped, **changes})


def test_driven_recordings_show_restarted_predictions_and_the_free_run_while_in_step() -> None:
    one = driven()
    figure = comparison_figure(one)
    assert_sound(figure)
    assert_no_overlap(figure)
    top, _, bottom = figure.axes
    np.testing.assert_allclose(lines(top, MODEL)[0].get_ydata(), one.ahead.y * 1e3)
    (free,) = lines(top, ACCENT)
    assert free.get_xdata()[-1] == pytest.approx(1.0)  # t > 1 s has lost step
    ends = next(line for line in bottom.lines if line.get_marker() == "o")
    np.testing.assert_allclose(ends.get_ydata(), 50.0)
    assert bottom.get_ylabel() == "error (µm)"
    assert bottom.get_title(loc="right") == "model minus measured; points: 0.1 s ahead, RMS 50 µm"
    assert "lost step at 1 s" in figure._supxlabel.get_text()


def test_free_run_that_keeps_step_is_drawn_to_the_end() -> None:
    one = driven(y_simulated=move(n=2000).y_simulated)
    figure = comparison_figure(one)
    assert "keeps step to the end" in figure._supxlabel.get_text()
    assert len(lines(figure.axes[0], ACCENT)[0].get_xdata()) == 2000
    drifting = driven(pole_pitch=None, y_simulated=one.y_measured + 0.2 * one.t)  # a quarter of 0.4 m at 0.5 s
    assert "left the measured motion at 0.5" in comparison_figure(drifting)._supxlabel.get_text()


def test_overview_gives_each_recording_the_unit_of_its_error() -> None:
    wheel = coast(n=2000)
    quiet = replace(wheel, y_simulated=wheel.y_measured + 2e-7)
    figure = overview_figure([quiet, driven()])
    assert_sound(figure)
    assert [figure.axes[k].get_ylabel() for k in (1, 3)] == ["error (nm)", "error (µm)"]
    notes = [text.get_text() for text in figure.axes[2].texts]
    assert "0.1 s ahead, RMS 50 µm" in notes


def test_long_recordings_are_decimated_but_keep_their_peak() -> None:
    one = move(n=60_000)
    y = one.y_simulated.copy()
    y[31_234] += 0.01
    figure = comparison_figure(trace("long", one.t, one.y_measured, y))
    drawn = lines(figure.axes[2], ERROR)[0].get_ydata()
    assert len(drawn) < 3100
    assert max(drawn) == pytest.approx(np.max(y - one.y_measured) * 1e3)


def test_rotary_axes_have_their_units() -> None:
    one = move(n=1000, axis="rotary")
    labels = [axes.get_ylabel() for axes in comparison_figure(one).axes]
    assert labels == ["position (mrad)", "velocity (rad/s)", "error (µrad)"]
    wheel = free_wheel_velocity_figure([trace("r", one.t, one.y_measured, one.y_simulated, axis="rotary")])
    assert "added inertia 0 kg m²" in wheel.axes[0].get_title(loc="left")
    assert wheel.axes[0].get_ylabel() == "velocity (rad/s)"


def broken(kind: str) -> Any:
    """A move whose simulation is nan from the middle, nan throughout, runs away, or stands still like the machine."""
    one = move(kind, n=1200)
    y = one.y_simulated.copy()
    if kind == "nan_tail":
        y[600:] = np.nan
    elif kind == "nan":
        y[:] = np.nan
    elif kind == "inf":
        y[700:] = np.inf
    elif kind == "runaway":
        y += 50.0 * one.t**3
    elif kind == "constant":
        return trace(kind, one.t, np.full(1200, 0.39), np.full(1200, 0.39))
    elif kind == "zero":
        return trace(kind, one.t, np.zeros(1200), np.zeros(1200))
    with np.errstate(invalid="ignore"):
        return trace(kind, one.t, one.y_measured, y)


@pytest.mark.parametrize("kind", ["nan_tail", "nan", "inf", "runaway", "constant", "zero"])
@pytest.mark.filterwarnings("error")
def test_broken_simulations_leave_the_measured_line_legible(kind: str) -> None:
    one = broken(kind)
    for figure in (comparison_figure(one), overview_figure([one, one]), free_wheel_displacement_figure([one])):
        assert_sound(figure)
        low, high = figure.axes[0].get_ylim()
        sign = lines(figure.axes[0], MEASURED)[0].get_ydata()
        assert np.all(np.isfinite([low, high])) and low <= min(sign) and max(sign) <= high
        assert high - low <= 3.0 * max(np.ptp(sign), 1.0)


def test_breakdown_is_found_where_it_is() -> None:
    one = broken("nan_tail")
    assert breakdown(one) == (one.t[600], "diverged at 0.6 s")
    assert breakdown(move(n=1200)) is None
    failure = breakdown(broken("runaway"))
    assert failure is not None and failure[1].startswith("off the scale")


@pytest.mark.parametrize("count", [1, 2, 4, 6, 9, 10, 30])
def test_overview_holds_any_number_of_recordings(count: int) -> None:
    figure = overview_figure([move(f"a_rather_long_recording_name_{i}", n=300) for i in range(count)])
    assert_sound(figure)
    assert_no_overlap(figure)
    assert len(figure.axes) == count * (2 if count <= 9 else 1)
    one = move("x", n=300)
    np.testing.assert_allclose(lines(figure.axes[0], MODEL)[0].get_ydata(), one.y_simulated * 1e3)


def test_free_wheels_are_grouped_by_mass_and_point_forward() -> None:
    wheels = [coast("a", 0.4, 0.5), coast("b", 0.3, 0.0, direction=-1), coast("c", 0.5, 0.5)]
    figure = free_wheel_displacement_figure(wheels)
    assert_sound(figure)
    assert_no_overlap(figure)
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_title(loc="left")]
    assert titles == ["added mass 0 kg", "added mass 0.5 kg"]
    top = figure.axes[0]
    backward = wheels[1]
    model = [line for line in lines(top, MODEL)]
    np.testing.assert_allclose(model[0].get_ydata(), -(backward.y_simulated - backward.y_measured[0]) * 1e3)
    points = lines(top, MEASURED)[0]
    assert points.get_label() == "b" and 30 <= len(points.get_xdata()) <= 60
    where = np.searchsorted(backward.t, points.get_xdata())
    np.testing.assert_allclose(points.get_ydata(), -(backward.y_measured - backward.y_measured[0])[where] * 1e3)
    assert len(lines(figure.axes[2], MODEL)) == 2


@pytest.mark.parametrize(("masses", "each"), [(1, 1), (3, 2), (4, 7), (7, 1)])
def test_many_free_wheels(masses: int, each: int) -> None:
    wheels = [coast(f"wheel_{i}", 0.3 + 0.02 * i, 0.25 * m, n=400) for m in range(masses) for i in range(each)]
    for figure in (free_wheel_displacement_figure(wheels), free_wheel_velocity_figure(wheels)):
        assert_sound(figure)
        assert_no_overlap(figure)
        assert sum(len(lines(axes, MODEL)) for axes in figure.axes) == masses * each


def test_legend_lies_above_all_curves() -> None:
    figure = free_wheel_displacement_figure([coast(f"w{i}", 0.5 - 0.01 * i, 0.0) for i in range(6)])
    figure.draw_without_rendering()
    axes = figure.axes[0]
    bottom = axes.get_legend().get_window_extent().y0
    highest = max(axes.transData.transform((0, max(line.get_ydata())))[1] for line in lines(axes, MODEL))
    assert bottom >= highest - 1


def test_coast_down_window() -> None:
    one = coast(n=1500)
    recording = Recording("push", one.t, one.y_measured.copy())
    figure = coast_down_figure(recording, 0.2, 0.9, [(0.2, 0.9), (1.1, 1.3)])
    assert_sound(figure)
    top, bottom = figure.axes
    np.testing.assert_allclose(lines(top, MEASURED)[0].get_ydata(), one.y_measured * 1e3)
    np.testing.assert_allclose(lines(bottom, MEASURED)[0].get_ydata(), np.gradient(one.y_measured, one.t))
    spans = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in top.patches)
    np.testing.assert_allclose(spans, [(0.2, 0.9), (1.1, 1.3)])
    assert "0.200 to 0.900 s" in top.get_title(loc="left")


def test_currents_show_samples_and_spline() -> None:
    one = move(n=1500)
    assert one.phase_currents is not None

    def spline(t: np.ndarray) -> np.ndarray:
        return np.array([np.interp(t, one.t, row) for row in one.phase_currents])  # type: ignore[union-attr]

    figure = currents_figure("moves_3", one.t, one.phase_currents, spline, zoom=(0.5, 0.53))
    assert_sound(figure)
    top, bottom = figure.axes
    for row, line in zip(one.phase_currents, (line for line in top.lines if len(line.get_xdata()) > 2), strict=True):
        np.testing.assert_array_equal(line.get_ydata(), row)
    inside = (one.t >= 0.5) & (one.t <= 0.53)
    samples = [line for line in bottom.lines if line.get_marker() == "o"]
    curves = [line for line in bottom.lines if line.get_marker() != "o" and len(line.get_xdata()) > 2]
    assert len(samples) == len(curves) == 3
    np.testing.assert_array_equal(samples[1].get_ydata(), one.phase_currents[1][inside])
    np.testing.assert_allclose(curves[2].get_ydata(), spline(curves[2].get_xdata())[2])
    assert len(curves[0].get_xdata()) > 10 * inside.sum()
    assert top.get_ylabel() == "current (A)"


def test_other_inputs_and_zero_currents() -> None:
    t = np.arange(200) * 1e-3
    assert currents_figure("u", t, np.sin(t), unit="V").axes[0].get_ylabel() == "input (V)"
    assert_sound(currents_figure("still", t, np.zeros((3, 200))))


def test_zoom_finds_the_liveliest_stretch() -> None:
    t = np.arange(1000) * 1e-3
    i = np.zeros((3, 1000))
    i[1, 500:510] = [0, 1] * 5
    start, end = liveliest(t, i)
    assert start <= 0.5 and end >= 0.509 and end - start == pytest.approx(0.039)
    assert liveliest(t[:10], i[:, :10]) == (t[0], t[9])


def test_nothing_to_draw_is_an_error() -> None:
    for draw in (overview_figure, free_wheel_displacement_figure):
        with pytest.raises(DataError):
            draw([])


def test_cases_of_operation_follow_position_and_velocity_and_show_both_models() -> None:
    ours, theirs = driven(), driven()
    theirs = replace(theirs, ahead=pieces(theirs, drift=2e-4))
    figure = operation_figure([ours, ours], [theirs, theirs], ("sine", "theta"), "Sine model")
    assert_sound(figure)
    assert len(figure.axes) == 6  # position, velocity and error of two cases
    assert any("begins anew from the measured state every 0.1 s" in text.get_text() for text in figure.texts)
    for position, velocity, error in (figure.axes[:3], figure.axes[3:]):
        for axes in (position, velocity):
            (measured,) = lines(axes, MEASURED)
            assert len(lines(axes, MODEL)) == len(lines(axes, ACCENT)) == 1
            followed = lines(axes, MODEL)[0]
            at = np.isfinite(followed.get_ydata())
            true = np.interp(followed.get_xdata()[at], measured.get_xdata(), measured.get_ydata())
            assert np.abs(followed.get_ydata()[at] - true).max() < 0.01 * np.ptp(measured.get_ydata())
        peaks = [np.nanmax(lines(error, colour)[0].get_ydata()) for colour in (MODEL, ACCENT)]
        assert peaks[1] == pytest.approx(4.0 * peaks[0], rel=1e-3)  # 0.2 mm and 50 um
        assert error.get_title(loc="left") == "sine RMS 50 µm; theta RMS 200 µm"
    with pytest.raises(DataError, match="no prediction"):
        operation_figure([coast()], [coast()], ("sine", "theta"), "free wheels")


def test_what_follows_a_stop_is_cut_but_for_a_little() -> None:
    whole = coast(n=3000)
    cut = until_rest(whole)
    stop = whole.t[np.flatnonzero(whole.velocity_simulated > 1e-6)[-1]]
    assert stop < cut.t[-1] < 1.6 * stop < whole.t[-1]
    for name in ("y_measured", "y_simulated", "velocity_measured", "velocity_simulated"):
        np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name)[: cut.t.size])


def test_runs_by_voltage_show_motion_and_currents() -> None:
    one = move(n=1500)
    currents = np.array([np.sin(20.0 * one.t + phase) for phase in (0.0, 2.1, 4.2)])
    case = ByVoltage(replace(one, phase_currents=currents + 1e-3), 5.0 * currents, currents)
    figure = by_voltage_figure([case, case], "Driven by voltages")
    assert_sound(figure)
    assert_no_overlap(figure)
    position, error, voltages, shown = figure.axes[0::2]
    assert "position" in position.get_ylabel() and len(lines(position, MEASURED)) == 1
    off = np.abs(np.asarray(lines(error, ERROR)[0].get_ydata())).max()
    assert off == pytest.approx(1e6 * np.abs(one.y_simulated - one.y_measured).max(), rel=1e-6)
    assert len(voltages.get_lines()) == 4 and len(lines(shown, MODEL)) == 3
    assert "1 mA" in shown.get_title(loc="left")
    with pytest.raises(DataError, match="no run to draw"):
        by_voltage_figure([], "none")
