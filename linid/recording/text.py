"""The bytes of an export -> decoded lines; refuses what is no text."""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from linid.errors import ConfigError, DataError
from linid.recording.pieces import LONGEST_LINE, LineError, LongText, Opened, Scan, scan

_MAGIC = {
    b"\xd0\xcf\x11\xe0": ("an old Excel or Office file", "Save the sheet as CSV first."),
    b"\x89HDF": ("an HDF5 file", "Export the channels as CSV, or save as a MATLAB v7 .mat file."),
    b"MATLAB 5.0": ("a MATLAB file", "Give it the suffix .mat."),
    b"%PDF": ("a PDF", "Export the data as CSV."),
}
_UTF16_HEAD, _FEWEST_BYTES = 4096, 8  # bytes that are looked at, and that tell anything
_ZEROS, _NO_ZEROS = 0.7, 0.1  # of every other byte: UTF-16 of Latin letters has its zeros in one half
_CONTROL = 0.02  # of the bytes: text has hardly any control characters
PIECE = 1 << 23  # bytes; longer files are read in pieces of this size


@dataclass(frozen=True)
class TextFile:
    """Decoded lines of an export (without line ends) and what was noticed while decoding."""

    path: Path
    lines: Sequence[str]
    encoding: str
    sha256: str
    notes: tuple[str, ...]

    def with_notes(self, before: tuple[str, ...]) -> TextFile:
        """The same with other notes before its own."""
        return replace(self, notes=(*before, *self.notes))


def decoded(path: Path, opened: Opened, size: int, head: bytes, encoding: str | None = None) -> TextFile:
    """Decode an export: UTF-8, UTF-16 or Windows-1252, or the given `encoding`; binary files are refused.

    opened: opens the content at its beginning; size: of it in bytes; head: its first bytes. The lines of more than
    `PIECE` bytes are not kept but decoded again, a piece at a time, where they are used. Raises DataError for what is
    binary, damaged or blank, ConfigError for an unknown `encoding`.
    """
    long = size > PIECE
    found, notes = _scanned(path, opened, head, encoding)
    if found.nuls_at_end:
        notes.append(f"{found.nuls_at_end} NUL bytes at the end of the file left out")
    if found.nuls_inside:
        s = "s" * (found.nuls_inside > 1)
        notes.append(f"{found.nuls_inside} NUL byte{s} inside the file; the cells there are unreadable")
    if found.blank:
        raise DataError(str(path), "the file holds only blank lines", "Export the recording again.")
    lines = LongText(opened, found, str(path))
    return TextFile(path, lines if long else list(lines), found.encoding, found.sha256, tuple(notes))


def _scanned(path: Path, opened: Opened, head: bytes, given: str | None) -> tuple[Scan, list[str]]:
    """The file in its encoding, and a note where it had to be tried."""
    used = _encoding(path, head, given)
    try:
        return scan(opened, used or "utf-8", PIECE), []
    except LineError as error:
        raise DataError(
            f"{path}, line {error}", f"is longer than {LONGEST_LINE >> 20} MiB", "This is no text export of samples."
        ) from None
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
            known = codecs.lookup(given)
            " ".encode(given)  # refuses codecs that are none of text
        except (LookupError, ValueError, UnicodeError):
            known = None
        if known is None or known.incrementaldecoder is None:
            raise ConfigError("channels.encoding", f"unknown encoding '{given[:60]}'", "Use utf-8, utf-16 or cp1252.")
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
    sample = data[:_UTF16_HEAD]
    if len(sample) < _FEWEST_BYTES:
        return None
    even, odd = sample[0::2].count(0), sample[1::2].count(0)
    half = len(sample) / 2
    if odd > _ZEROS * half and even < _NO_ZEROS * half:
        return "utf-16-le"
    if even > _ZEROS * half and odd < _NO_ZEROS * half:
        return "utf-16-be"
    return None


def _refuse_binary(path: Path, data: bytes) -> None:
    sample = data.rstrip(b"\x00")
    control = sum(sample.count(bytes([code])) for code in (*range(9), 11, *range(14, 27), 28, 29, 30, 31, 127))
    if not sample or control > max(2, _CONTROL * len(sample)):
        raise DataError(
            str(path), "is a binary file, not a text export", "Export the recording as CSV (or .mat with that suffix)."
        )
