"""Columns, units, time stamps and signals that are wrong: an error with place, fact and remedy, or a counted note."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linid.errors import UsageError
from linid.recording import ChannelMapping, read_recording

from .expectations import error_of, note_of
from .exports import HEADER, T, Y, lines, rows, write

# Columns and units ------------------------------------------------------------------------------------------------


def test_duplicate_column_names(tmp_path: Path) -> None:
    header = HEADER.replace("Phase Current U", "Actual Position").replace("(A)", "(mm)", 1)
    error_of(write(tmp_path, [header, *rows()]), "ambiguous", "#2", "#3", "position", "line 1")


def test_mapped_duplicate_needs_a_number(tmp_path: Path) -> None:
    text = ["Time (ms),Pos (mm),Pos (mm)"] + [f"{k},{k},{2 * k}" for k in range(60)]
    path = write(tmp_path, text)
    error_of(path, "ambiguous", channels=ChannelMapping.model_validate({"position": "Pos"}))
    recording = read_recording(path, channels=ChannelMapping.model_validate({"position": "#3"}))
    assert recording.y[10] == pytest.approx(0.02)


def test_mapped_column_missing_suggests_the_nearest(tmp_path: Path) -> None:
    mapping = ChannelMapping.model_validate({"position": {"column": "Actual Positon"}})
    error_of(write(tmp_path, lines()), "Did you mean 'Actual Position", "line 1", channels=mapping)


def test_no_position(tmp_path: Path) -> None:
    error_of(write(tmp_path, ["Time (ms),Foo (mm)", *(f"{k},{k}" for k in range(60))]), "no position", "'Foo (mm)'")


def test_no_time_and_no_period(tmp_path: Path) -> None:
    error_of(
        write(tmp_path, ["Position (mm),Iq (A)", *(f"{k},{k % 7}" for k in range(60))]), "no time column", "period"
    )


def test_clock_times_to_the_minute_are_not_read(tmp_path: Path) -> None:
    text = ["Date;Time;Position (mm)", *(f"01.02.2024;12:{k:02d};{k}" for k in range(60))]
    path = write(tmp_path, text)
    error_of(path, "no time column", "clock times", "'Time'", "period")
    assert len(read_recording(path, period=0.01).t) == 60


def test_unknown_unit_suggests(tmp_path: Path) -> None:
    text = ["Time (ms),Position (mmm)", *(f"{k},{k}" for k in range(60))]
    error_of(write(tmp_path, text), "unknown unit 'mmm'", "Did you mean", "mm")
    text = ["Time (ms),Position (MM)", *(f"{k},{k}" for k in range(60))]
    error_of(write(tmp_path, text), "unknown unit 'MM'", "mm")


def test_missing_unit_is_not_guessed(tmp_path: Path) -> None:
    path = write(tmp_path, ["Time (ms),Position", *(f"{k},{k}" for k in range(60))])
    error_of(path, "no unit declared", "position: {column: Position, unit:")
    mapping = ChannelMapping.model_validate({"position": {"column": "Position", "unit": "um"}})
    assert read_recording(path, channels=mapping).y[3] == pytest.approx(3e-6)


def test_unit_of_the_wrong_kind(tmp_path: Path) -> None:
    path = write(tmp_path, ["Time (ms),Position (deg)", *(f"{k},{k}" for k in range(60))])
    error_of(path, "'deg' is a angle", "length", "axis")
    assert read_recording(path, axis="rotary").y[3] == pytest.approx(np.deg2rad(3))


def test_counts_in_the_header_need_a_scale(tmp_path: Path) -> None:
    error_of(write(tmp_path, ["Time (ms),Position (counts)", *(f"{k},{k}" for k in range(60))]), "without a scale")


def test_one_phase_current_is_not_enough(tmp_path: Path) -> None:
    mapping = ChannelMapping.model_validate({"current_u": "Phase Current U"})
    error_of(write(tmp_path, lines()), "one phase current", channels=mapping)


# Time -------------------------------------------------------------------------------------------------------------


def free(times: list[float] | np.ndarray, values: np.ndarray | None = None) -> list[str]:
    """A free-wheel export with the given times in ms."""
    x = 10 + np.sin(np.asarray(times) / 30.0) if values is None else values
    return ["Time (ms),Position (mm)", *(f"{t:.6g},{p:.9f}" for t, p in zip(times, x, strict=True))]


def test_time_going_back(tmp_path: Path) -> None:
    times = np.r_[np.arange(60), np.arange(40)]
    error_of(write(tmp_path, free(times)), "line 62", "goes back from 0.059 s to 0 s", "Split")


def test_repeated_time_stamps_with_other_values(tmp_path: Path) -> None:
    times = np.repeat(np.arange(60), 2)
    error_of(write(tmp_path, free(times, np.arange(120.0))), "60 time stamps occur twice", "line 3", "period")


def test_repeated_rows_are_counted(tmp_path: Path) -> None:
    recording = note_of(write(tmp_path, free(np.repeat(np.arange(60), 2))), "60 repeated rows")
    assert len(recording.t) == 60


def test_single_repeated_time_stamp_is_counted(tmp_path: Path) -> None:
    text = free(np.arange(100))
    text.insert(40, "38,12.0")
    note_of(write(tmp_path, text), "1 row with a repeated time stamp left out")


def test_short_gap_is_counted_and_closed(tmp_path: Path) -> None:
    times = np.delete(np.arange(300), [100, 101, 102])
    recording = note_of(write(tmp_path, free(times)), "1 gap in time", "3 samples missing")
    assert len(recording.t) == 300
    np.testing.assert_allclose(recording.y, 1e-3 * (10 + np.sin(np.arange(300) / 30)), atol=2e-6)


def test_long_gap_keeps_the_longest_part(tmp_path: Path) -> None:
    times = np.delete(np.arange(300), np.arange(100, 150))
    recording = note_of(write(tmp_path, free(times)), "longest gap-free part", "150 of 250")
    np.testing.assert_allclose(recording.t, np.arange(150, 300) * 1e-3)


def test_jitter_is_resampled(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    times = np.arange(400) + rng.uniform(-0.2, 0.2, 400)
    text = ["Time (ms),Position (mm)", *(f"{t:.6f},{10 + np.sin(t / 30):.9f}" for t in times)]
    recording = note_of(write(tmp_path, text), "resampled", "jitter")
    assert np.ptp(np.diff(recording.t)) < 1e-12
    np.testing.assert_allclose(recording.y, 1e-3 * (10 + np.sin(1e3 * recording.t / 30)), atol=1e-9)


def test_rounded_time_stamps_become_regular(tmp_path: Path) -> None:
    times = np.round(np.arange(400) * 0.25, 1)
    text = ["Time (ms),Position (mm)", *(f"{t:.1f},{k * 0.01:.2f}" for k, t in enumerate(times))]
    recording = note_of(write(tmp_path, text), "rounded to 0.0001 s")
    np.testing.assert_allclose(np.diff(recording.t), 0.25e-3, rtol=1e-3)
    np.testing.assert_allclose(recording.y, 1e-5 * np.arange(400), atol=1e-12)


def test_time_stamps_rounded_to_three_digits_do_not_drift(tmp_path: Path) -> None:
    text = ["Time (ms),Position (mm)", *(f"{k / 3:.3f},{k * 0.01:.2f}" for k in range(3001))]
    recording = read_recording(write(tmp_path, text))
    assert recording.period == pytest.approx(1e-3 / 3, rel=1e-6)
    assert recording.duration == pytest.approx(1.0, abs=1e-6)


def test_one_period_for_two_rates_is_refused(tmp_path: Path) -> None:
    text = ["Time (ms);Position (mm);Time (ms);Iq (A)"]
    text += [f"{k};{k};{2 * k if k < 50 else ''};{k % 7 if k < 50 else ''}" for k in range(100)]
    error_of(write(tmp_path, text), "found 50 samples, the position has 100", period=1e-3)


def test_campaign_instead_of_a_recording(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="YAML"):
        read_recording(write(tmp_path, ["recordings: []"], name="c.yaml"))


def test_too_few_samples(tmp_path: Path) -> None:
    error_of(write(tmp_path, free(np.arange(3))), "3 samples")


# Channels ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["motor", "free_wheel"])
def test_constant_position(tmp_path: Path, kind: str) -> None:
    text = [HEADER] + [",".join([row.split(",")[0], "100.0", *row.split(",")[2:]]) for row in rows()]
    error_of(write(tmp_path, text), "constant", kind=kind)


def test_saturated_current_is_counted(tmp_path: Path) -> None:
    text = ["Time (s),Position (mm),Iq (A)"]
    text += [f"{t:.3f},{y:.5f},{min(0.4, u):.4f}" for t, y, u in zip(T, 1e3 * Y, 0.5 * np.sin(40 * T), strict=True)]
    count = int((0.5 * np.sin(40 * T) >= 0.4).sum())
    note_of(write(tmp_path, text), f"{count} samples at 0.4 A", "i_q")


@pytest.mark.parametrize("unit", ["rad", "deg", "rev"])
def test_wrapped_rotary_position_is_unwrapped(tmp_path: Path, unit: str) -> None:
    turn = {"rad": 2 * np.pi, "deg": 360.0, "rev": 1.0}[unit]
    turns = 2.3 * np.sin(np.arange(300) / 60.0)
    text = [f"Time (ms),Position ({unit})", *(f"{k},{(x % 1.0) * turn:.9f}" for k, x in enumerate(turns))]
    recording = note_of(write(tmp_path, text), "made continuous", axis="rotary")
    np.testing.assert_allclose(recording.y - recording.y[0], 2 * np.pi * (turns - turns[0]), atol=1e-6)


def test_counter_overflow_is_unwrapped(tmp_path: Path) -> None:
    true = 60000 + 37 * np.arange(400)
    text = ["Time (ms),Position (inc)", *(f"{k},{x % 65536}" for k, x in enumerate(true))]
    mapping = ChannelMapping.model_validate({"position": {"column": "Position", "unit": "inc", "scale": 1e-6}})
    recording = note_of(write(tmp_path, text), "65536", "made continuous", channels=mapping)
    np.testing.assert_allclose(recording.y, 1e-6 * true)


def test_position_jump_is_refused(tmp_path: Path) -> None:
    x = 100 + 0.01 * np.arange(100.0)
    x[50:] -= 77.7
    text = ["Time (ms),Position (mm)", *(f"{k},{p:.4f}" for k, p in enumerate(x))]
    error_of(write(tmp_path, text), "line 52", "jumps", "within one sample")


def test_currents_in_a_free_wheel_recording_are_noted(tmp_path: Path) -> None:
    note_of(write(tmp_path, lines()), "free-wheel recording with currents", kind="free_wheel")
