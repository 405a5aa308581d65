"""What the reader must say about a bad file."""

from __future__ import annotations

from pathlib import Path

import pytest

from linid.errors import DataError
from linid.recording import read_recording

from .exports import lines


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
