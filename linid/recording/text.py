"""A file on disk -> decoded lines, with its SHA-256; refuses what is not a text export."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from linid.errors import ConfigError, DataError
from linid.recording.pieces import LongText, Opened, Scan, scan

_MAGIC = {
    b"PK\x03\x04": ("an Excel workbook or ZIP archive", "Save the sheet as CSV (or unpack the archive) first."),
    b"\xd0\xcf\x11\xe0": ("an old Excel or Office file", "Save the sheet as CSV first."),
    b"\x1f\x8b": ("a gzip archive", "Unpack it first."),
    b"\x89HDF": ("an HDF5 file", "Export the channels as CSV, or save as a MATLAB v7 .mat file."),
    b"MATLAB 5.0": ("a MATLAB file", "Give it the suffix .mat."),
    b"%PDF": ("a PDF", "Export the data as CSV."),
}
PIECE = 1 << 23  # bytes; longer files are read in pieces of this size
_HEAD = 65536  # bytes at the beginning that show what a file is


@dataclass(frozen=True)
class TextFile:
    """Decoded lines of an export (without line ends) and what was noticed while decoding."""

    path: Path
    lines: Sequence[str]
    encoding: str
    sha256: str
    notes: tuple[str, ...]


def read_bytes(path: Path) -> bytes:
    """The file's content; DataError for a missing, unreadable or empty file and for a folder."""
    with _readable(path):
        data = path.read_bytes()
    if not data:
        raise DataError(str(path), "the file is empty (0 bytes)", "Export the recording again.")
    return data


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """What the operating system says against reading the file, as a DataError."""
    try:
        yield
    except FileNotFoundError:
        raise DataError(str(path), "file not found", "Check the path.") from None
    except IsADirectoryError:
        raise DataError(str(path), "is a folder, a file is expected", "Name one recording in it.") from None
    except PermissionError:
        raise DataError(str(path), "no permission to read the file", "Change its permissions.") from None
    except OSError as error:
        raise DataError(str(path), f"cannot be read: {error.strerror}", "Check the path.") from None


def sha256_of(data: bytes) -> str:
    """SHA-256 of the file's content, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def load_text(path: Path, encoding: str | None = None) -> TextFile:
    """Decode an export: UTF-8, UTF-16 or Windows-1252, or the given `encoding`; binary files are refused.

    The lines of a file of more than `PIECE` bytes are not kept but decoded again, a piece at a time, where they are
    used. Raises DataError for a file that cannot be read, is binary, damaged or blank; ConfigError for an unknown
    `encoding`.
    """
    with _readable(path):
        long = path.is_file() and path.stat().st_size > PIECE
    data = b"" if long else read_bytes(path)

    def opened() -> BinaryIO:
        return path.open("rb") if long else io.BytesIO(data)

    with _readable(path):
        found, notes = _scanned(path, opened, encoding)
    if found.nuls_at_end:
        notes.append(f"{found.nuls_at_end} NUL bytes at the end of the file left out")
    if found.nuls_inside:
        s = "s" * (found.nuls_inside > 1)
        notes.append(f"{found.nuls_inside} NUL byte{s} inside the file; the cells there are unreadable")
    if found.blank:
        raise DataError(str(path), "the file holds only blank lines", "Export the recording again.")
    lines = LongText(opened, found, str(path))
    return TextFile(path, lines if long else list(lines), found.encoding, found.sha256, tuple(notes))


def _scanned(path: Path, opened: Opened, given: str | None) -> tuple[Scan, list[str]]:
    """The file in its encoding, and a note where it had to be tried."""
    with opened() as file:
        used = _encoding(path, file.read(_HEAD), given)
    try:
        return scan(opened, used or "utf-8", PIECE), []
    except UnicodeDecodeError as error:
        if given is not None:
            raise DataError(
                str(path), f"is not {given} text (byte {error.start})", "Remove `encoding` from the mapping."
            ) from None
        if used is not None:
            raise DataError(
                str(path), f"is damaged {used} text (byte {error.start})", "Export the recording again."
            ) from None
    return scan(opened, "cp1252", PIECE, errors="replace"), ["decoded as Windows-1252 (the file is not UTF-8)"]


def _encoding(path: Path, head: bytes, given: str | None) -> str | None:
    """The encoding given, or shown by the file's first bytes; None: UTF-8 as long as it fits."""
    if given is not None:
        try:
            b"".decode(given)
        except LookupError:
            raise ConfigError(
                "channels.encoding", f"unknown encoding '{given}'", "Use utf-8, utf-16 or cp1252."
            ) from None
        return given
    for magic, (kind, remedy) in _MAGIC.items():
        if head.startswith(magic):
            raise DataError(str(path), f"is {kind}, not a text export", remedy)
    for bom, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if head.startswith(bom):
            return name
    wide = _utf16_without_bom(head)
    if wide is None:
        _refuse_binary(path, head)
    return wide


def _utf16_without_bom(data: bytes) -> str | None:
    sample = data[:4096]
    if len(sample) < 8:
        return None
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    half = len(sample) / 2
    if odd > 0.7 * half and even < 0.1 * half:
        return "utf-16-le"
    if even > 0.7 * half and odd < 0.1 * half:
        return "utf-16-be"
    return None


def _refuse_binary(path: Path, data: bytes) -> None:
    sample = data[:_HEAD].rstrip(b"\x00")
    control = sum(sample.count(bytes([code])) for code in (*range(9), 11, *range(14, 27), 28, 29, 30, 31, 127))
    if not sample or control > max(2, 0.02 * len(sample)):
        raise DataError(
            str(path), "is a binary file, not a text export", "Export the recording as CSV (or .mat with that suffix)."
        )
