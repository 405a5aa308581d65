"""Every kind of bad file is met with an error that says where, what and what to do, or read and counted in a note."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from linid.errors import DataError
from linid.recording import ChannelMapping, read_recording

from .exports import HEADER, N, T, Y, german, lines, rows, write


def error_of(path: Path, *parts: str, **options) -> DataError:
    """The DataError of reading `path`; its text names the file, holds `parts` and gives a remedy."""
    with pytest.raises(DataError) as caught:
        read_recording(path, **options)
    text = str(caught.value)
    assert caught.value.exit_code == 4
    assert str(path) in text and len(caught.value.remedy) > 5
    for part in parts:
        assert part in text, text
    return caught.value


def note_of(path: Path, *parts: str, **options):
    """The recording; one note holds all `parts`."""
    recording = read_recording(path, **options)
    assert any(all(part in note for part in parts) for note in recording.notes), recording.notes
    return recording


def changed(line: int, text: str) -> list[str]:
    """The clean export with one line (number from 1) replaced."""
    out = lines()
    out[line - 1] = text
    return out


def cell(line: int, column: int, text: str) -> list[str]:
    """The clean export with one cell (numbers from 1) replaced."""
    out = lines()
    cells = out[line - 1].split(",")
    cells[column - 1] = text
    out[line - 1] = ",".join(cells)
    return out


# Files that are no text export ------------------------------------------------------------------------------------


def test_missing_file(tmp_path: Path) -> None:
    error_of(tmp_path / "nothing.csv", "not found")


def test_folder(tmp_path: Path) -> None:
    error_of(tmp_path, "folder")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_no_permission(tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    path.chmod(0)
    error_of(path, "permission")


def test_no_permission_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    error_of(tmp_path / "a.csv", "permission")


def test_empty_file(tmp_path: Path) -> None:
    error_of(write(tmp_path, b""), "empty")


def test_only_blank_lines(tmp_path: Path) -> None:
    error_of(write(tmp_path, b"\n\n  \n"), "blank")


def test_header_only(tmp_path: Path) -> None:
    error_of(write(tmp_path, [HEADER]), "no line of numbers")


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"PK\x03\x04" + bytes(200), "Excel"),
        (gzip.compress(b"1,2,3\n" * 50), "gzip"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (b"MATLAB 5.0 MAT-file" + bytes(100), "MATLAB"),
        (bytes(range(256)) * 20, "binary"),
    ],
)
def test_binary_named_csv(tmp_path: Path, content: bytes, word: str) -> None:
    error_of(write(tmp_path, content), word)


def test_damaged_utf16(tmp_path: Path) -> None:
    error_of(write(tmp_path, "\n".join(lines()).encode("utf-16") + b"\xd8"), "utf-16")


def test_nul_bytes_at_the_end_are_counted(tmp_path: Path) -> None:
    recording = note_of(write(tmp_path, "\n".join(lines()).encode() + b"\n" + bytes(512)), "512 NUL bytes")
    assert len(recording.t) == N


def test_nul_bytes_inside_make_the_cell_unreadable(tmp_path: Path) -> None:
    content = "\n".join(cell(50, 2, "1\x0000.5")).encode()
    recording = note_of(write(tmp_path, content), "1 NUL byte inside")
    assert recording.y[48] == pytest.approx(Y[48], abs=1e-6)
    assert any("1 unreadable cell" in note and "line 50" in note for note in recording.notes)


def test_windows_1252_is_noted(tmp_path: Path) -> None:
    text = "\n".join(["Time (ms);Position (µm)", *(f"{k};{k}" for k in range(60))])
    note_of(write(tmp_path, text, encoding="cp1252"), "Windows-1252")


# Dialect ----------------------------------------------------------------------------------------------------------


def test_comma_for_both_is_refused(tmp_path: Path) -> None:
    body = [row.replace(".", ",") for row in rows()]
    error_of(write(tmp_path, [HEADER, *body]), "line 2", "ambiguous commas", "5 fields", "10")


def test_comma_for_both_but_quoted_is_read(tmp_path: Path) -> None:
    body = [",".join(f'"{c.replace(".", ",")}"' for c in row.split(",")) for row in rows()]
    recording = read_recording(write(tmp_path, [HEADER, *body]))
    np.testing.assert_allclose(recording.y, Y, atol=1e-7)


def test_comma_for_both_with_changing_field_counts(tmp_path: Path) -> None:
    body = [f"{k},{k},5,{k}" if k % 2 else f"{k},5,{k},5,{k},2" for k in range(100)]
    error_of(write(tmp_path, ["Time (ms),Position (mm),Iq (A)", *body]), "constant number of fields", "semicolon")


def test_mixed_decimal_marks(tmp_path: Path) -> None:
    body = [f"{k},0;{0.1 * k:.1f}" for k in range(100)]
    error_of(write(tmp_path, ["Time (ms);Position (mm)", *body]), "mixed decimal marks", "'0,0'", "'0.0'")


def test_one_cell_with_the_other_mark_is_counted(tmp_path: Path) -> None:
    text = [german(line) for line in lines()]
    cells = text[100].split(";")
    cells[1] = cells[1].replace(",", ".")
    text[100] = ";".join(cells)
    note_of(write(tmp_path, text), "1 unreadable cell", "line 101")


@pytest.mark.parametrize("number", ["1.234,5", "1'234,5", "1.234.567"])
def test_thousands_separators(tmp_path: Path, number: str) -> None:
    body = [f"{k};{number}" for k in range(100)]
    error_of(write(tmp_path, ["Time (ms);Position (mm)", *body]), "thousands", number)


def test_thousands_separator_deep_in_the_file(tmp_path: Path) -> None:
    body = [f"{k};{900 + k},5" if k < 100 else f"{k};1.{k - 100:03d},5" for k in range(140)]
    error_of(write(tmp_path, ["Time (ms);Position (mm)", *body]), "line 102", "thousands", "1.000,5")


def test_separator_can_be_given(tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    assert len(read_recording(path, channels=ChannelMapping(separator=",")).t) == N
    error_of(path, "", channels=ChannelMapping(separator=";"))


# Rows -------------------------------------------------------------------------------------------------------------


def test_ragged_rows_few_are_counted(tmp_path: Path) -> None:
    text = changed(40, "38.0,1,2,3")
    recording = note_of(write(tmp_path, text), "1 row with a wrong number of fields left out", "line 40")
    assert len(recording.t) == N  # the hole is closed on the regular grid
    assert recording.y[38] == pytest.approx(Y[38], abs=1e-5)


def test_ragged_rows_many_are_refused(tmp_path: Path) -> None:
    text = [line if k % 12 else line + ",7,8" for k, line in enumerate(lines(), start=1)]
    error_of(write(tmp_path, text), "wrong number of fields", "expected 5", "line 12")


def test_header_with_another_number_of_names(tmp_path: Path) -> None:
    error_of(write(tmp_path, ["Time (ms),Position (mm),Iq (A)", *rows()]), "line 1", "3 names", "5 fields")


def test_truncated_last_row(tmp_path: Path) -> None:
    text = "\n".join(lines())[:-18]
    recording = note_of(write(tmp_path, text), "last row", "line 201", "cut short")
    assert len(recording.t) == N - 1


@pytest.mark.parametrize("mark", ["EOF", "END", "<EOF>"])
def test_end_of_file_marker(tmp_path: Path, mark: str) -> None:
    recording = note_of(write(tmp_path, [*lines(), mark]), "end-of-file marker", "line 202")
    assert len(recording.t) == N


def test_text_after_the_data_is_counted(tmp_path: Path) -> None:
    note_of(write(tmp_path, [*lines(), "", "Comment: nice run", "Operator: A"]), "2 lines of text after the data")


def test_second_header_in_mid_file(tmp_path: Path) -> None:
    error_of(write(tmp_path, [*lines(), *lines()]), "line 202", "second header", "Split")


def test_blank_lines_inside_are_counted(tmp_path: Path) -> None:
    text = lines()
    text.insert(50, "")
    recording = note_of(write(tmp_path, text), "1 blank line inside")
    assert len(recording.t) == N


# Cells ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "NaN", "Inf", "-inf", "1_000", "#REF!", "n/a", "abc", "1e999"])
def test_one_bad_cell_is_interpolated_and_counted(tmp_path: Path, text: str) -> None:
    recording = note_of(write(tmp_path, cell(80, 2, text)), "Actual Position", "1 unreadable cell", "line 80")
    assert recording.y[78] == pytest.approx(Y[78], abs=1e-6)
    assert np.isfinite(recording.y).all()


def test_many_bad_cells_are_refused(tmp_path: Path) -> None:
    text = lines()
    for k in range(60, 75):
        cells = text[k].split(",")
        text[k] = ",".join([*cells[:2], "#REF!", *cells[3:]])
    error_of(write(tmp_path, text), "line 61", "Phase Current U", "'#REF!'", "15 of 200")


def test_bad_cells_in_unused_columns_do_not_matter(tmp_path: Path) -> None:
    text = [HEADER + ",Temperature (degC)"] + [row + (",20.5" if k % 3 else ",") for k, row in enumerate(rows())]
    assert len(read_recording(write(tmp_path, text)).t) == N


def test_bad_cell_in_the_first_row_is_cut_and_counted(tmp_path: Path) -> None:
    recording = note_of(write(tmp_path, cell(2, 2, "NaN")), "1 sample at the ends left out")
    assert recording.t[0] == pytest.approx(T[1])


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
