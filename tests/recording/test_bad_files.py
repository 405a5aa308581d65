"""Files, dialects, rows and cells that are wrong: an error with line, fact and remedy, or a counted note."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from linid.recording import ChannelMapping, read_recording

from .expectations import cell, changed, error_of, note_of
from .exports import HEADER, N, T, Y, german, lines, rows, write

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
        (gzip.compress(b"1,2,3\n" * 50, mtime=0), "gzip"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (b"MATLAB 5.0 MAT-file" + bytes(100), "MATLAB"),
        (bytes(range(256)) * 20, "binary"),
    ],
    ids=["Excel", "gzip", "HDF5", "MATLAB", "binary"],
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


def test_what_lies_outside_the_window_does_not_matter(tmp_path: Path) -> None:
    text = lines()
    for k in range(150, 170):
        text[k] = text[k].replace(text[k].split(",")[1], "#REF!")
    for k in range(170, 201):
        text[k] = text[k].replace(text[k].split(",")[1], "999999")
    path = write(tmp_path, text)
    error_of(path, "'#REF!'")
    recording = read_recording(path, window=(0.0, 0.14))
    assert len(recording.t) == 141 and not any("unreadable" in note for note in recording.notes)


def test_bad_cells_in_unused_columns_do_not_matter(tmp_path: Path) -> None:
    text = [HEADER + ",Temperature (degC)"] + [row + (",20.5" if k % 3 else ",") for k, row in enumerate(rows())]
    assert len(read_recording(write(tmp_path, text)).t) == N


def test_bad_cell_in_the_first_row_is_cut_and_counted(tmp_path: Path) -> None:
    recording = note_of(write(tmp_path, cell(2, 2, "NaN")), "1 sample at the ends left out")
    assert recording.t[0] == pytest.approx(T[1])
