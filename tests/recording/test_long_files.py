"""Files read in pieces: the same arrays, notes and messages as in one piece, in memory for what is kept."""

from __future__ import annotations

import tempfile
import tracemalloc
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.errors import LinidError
from linid.recording import read_recording, text
from linid.recording.source import open_source
from linid.recording.text import TextFile

from .expectations import error_of
from .exports import german, lines, write


def load_text(path: Path) -> TextFile:
    """The lines of a file."""
    return open_source(path).text


FLAWS = ("", "x", '"3,5"', "1e999", "1.2.3", "\x00", "38.0,1,2", "a,b,c,d,e", "1,2,3,4,5,6")
ELMO = ["[Recording Info]", "Drive,Gold Drum,", "[Data]"]
CONTROLDESK = [
    "version,1.1,,,,,",
    "path,Time,Axis/Position,Axis/I_u,Axis/I_v,Axis/I_w,Status",
    "unit,ms,mm,A,A,A,",
    "trace_values,,,,,,",
]
TWINCAT = ["Name,y,Name,a", "SymbolComment,y,,a", "Unit,mm,,A"]


def outcome(path: Path, encoding: str | None, piece: int) -> tuple[object, ...]:
    """Everything that reading gives, or the message, with pieces of that many bytes."""
    from linid.recording import ChannelMapping

    with patch.object(text, "PIECE", piece):
        try:
            r = read_recording(path, channels=ChannelMapping(encoding=encoding))
        except LinidError as error:
            return (str(error),)
    arrays = (r.t, r.y, r.v, r.phase_currents, r.drive_input)
    return (*(None if x is None else (x.shape, x.tobytes()) for x in arrays), r.notes, r.sha256)


@given(
    piece=st.integers(16, 3000),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252", "latin-1"]),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    comma=st.booleans(),
    layout=st.sampled_from(["generic", "blanks", "twincat", "elmo", "controldesk"]),
    flaws=st.lists(st.tuples(st.integers(1, 200), st.sampled_from(FLAWS), st.booleans()), max_size=3),
    end=st.sampled_from(["", "\n", "\nEOF\n", "\n\n\n", "\nComment: a\nOperator: µ", "\n" + 70 * "\x00"]),
)
@settings(max_examples=80, deadline=None)
def test_pieces_of_any_size_give_the_same(
    piece: int, encoding: str, newline: str, comma: bool, layout: str, flaws: list[tuple[int, str, bool]], end: str
) -> None:
    content = [line + (",Status (µA)" if k == 0 else ",3") for k, line in enumerate(lines())]
    if layout == "twincat":
        rows = [line.split(",") for line in content[1:]]
        content = TWINCAT + [
            ",".join([*r[:2], rows[k // 2][0], r[2]] if k < 100 else r[:2]) for k, r in enumerate(rows)
        ]
    elif layout == "elmo":
        content = ELMO + content
    elif layout == "controldesk":
        content = CONTROLDESK + ["," + line for line in content[1:]]
    for number, flaw, whole in flaws:
        cells = content[min(number, len(content) - 1)].split(",")
        cells[number % len(cells)] = flaw
        content[min(number, len(content) - 1)] = flaw if whole else ",".join(cells)
    written = "\n".join(content) + end
    written = german(written) if comma else written
    written = written.replace(",", " ").replace(";", " ") if layout == "blanks" and not comma else written
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scope.csv"
        path.write_bytes(written.replace("\n", newline).encode(encoding, errors="replace"))
        given = "latin-1" if encoding == "latin-1" else None
        assert outcome(path, given, piece) == outcome(path, given, 1 << 20)


def test_lines_of_a_long_file_are_those_of_a_short_one(tmp_path: Path) -> None:
    path = write(tmp_path, "\r\n".join([*lines(), "", "µ"]))
    short = load_text(path)
    with patch.object(text, "PIECE", 100):
        long = load_text(path)
    assert list(long.lines) == short.lines and long.lines[-1] == "µ" and long.lines[3:7] == short.lines[3:7]
    assert [long.lines[k] for k in range(len(long.lines) - 1, -1, -1)] == short.lines[::-1]
    with pytest.raises(IndexError):
        long.lines[len(short.lines)]


def test_an_error_in_a_late_piece_names_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text, "PIECE", 500)
    content = [german(line) for line in lines()]
    content[180] = content[180].replace(content[180].split(";")[1], "1.234,5", 1)
    error_of(write(tmp_path, content), "line 181, column 2", "thousands", "1.234,5")
    error_of(write(tmp_path, [*lines(), *lines()]), "line 202", "second header")
    error_of(write(tmp_path, [*lines()[:150], *lines()[1:]]), "line 151", "time goes back")


def test_damaged_text_in_a_late_piece_names_its_byte(tmp_path: Path) -> None:
    data = "\n".join(lines()).encode("utf-8-sig")
    path = write(tmp_path, data[:7000] + b"\xff" + data[7000:])
    for piece in (512, 1 << 20):
        with patch.object(text, "PIECE", piece):
            error_of(path, "utf-8-sig", "byte 7000")


def test_a_file_that_shrinks_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text, "PIECE", 500)
    path = write(tmp_path, lines())
    long = load_text(path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(LinidError, match="changed while it was read"):
        list(long.lines)


def test_memory_is_that_of_the_columns_in_use_and_a_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve columns that nobody uses cost nothing; what is left, text or whole table, would exceed the bound."""
    monkeypatch.setattr(text, "PIECE", 1 << 16)
    n = 40000
    t = np.arange(n)
    y = 100.0 + 50.0 * np.sin(2e-3 * t)
    rest = ",".join(["12.345678"] * 12)
    header = "Time (ms),Position (mm)," + ",".join(f"Spare {k}" for k in range(12))
    path = write(tmp_path, [header, *(f"{a},{b:.4f},{rest}" for a, b in zip(t, y, strict=True))])
    read_recording(path)  # what is loaded on first use does not count
    tracemalloc.start()
    recording = read_recording(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    kept = recording.t.nbytes + recording.y.nbytes
    assert peak < 6.0 * kept < path.stat().st_size
