"""A file on disk -> decoded lines, with its SHA-256; refuses what is not a text export."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from linid.errors import ConfigError, DataError

_MAGIC = {
    b"PK\x03\x04": ("an Excel workbook or ZIP archive", "Save the sheet as CSV (or unpack the archive) first."),
    b"\xd0\xcf\x11\xe0": ("an old Excel or Office file", "Save the sheet as CSV first."),
    b"\x1f\x8b": ("a gzip archive", "Unpack it first."),
    b"\x89HDF": ("an HDF5 file", "Export the channels as CSV, or save as a MATLAB v7 .mat file."),
    b"MATLAB 5.0": ("a MATLAB file", "Give it the suffix .mat."),
    b"%PDF": ("a PDF", "Export the data as CSV."),
}


@dataclass(frozen=True)
class TextFile:
    """Decoded lines of an export (without line ends) and what was noticed while decoding."""

    path: Path
    lines: list[str]
    encoding: str
    sha256: str
    notes: tuple[str, ...]


def read_bytes(path: Path) -> bytes:
    """The file's content; DataError for a missing, unreadable or empty file and for a folder."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise DataError(str(path), "file not found", "Check the path.") from None
    except IsADirectoryError:
        raise DataError(str(path), "is a folder, a file is expected", "Name one recording in it.") from None
    except PermissionError:
        raise DataError(str(path), "no permission to read the file", "Change its permissions.") from None
    except OSError as error:
        raise DataError(str(path), f"cannot be read: {error.strerror}", "Check the path.") from None
    if not data:
        raise DataError(str(path), "the file is empty (0 bytes)", "Export the recording again.")
    return data


def sha256_of(data: bytes) -> str:
    """SHA-256 of the file's content, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def load_text(path: Path, encoding: str | None = None) -> TextFile:
    """Decode an export: UTF-8, UTF-16 or Windows-1252, or the given `encoding`; binary files are refused."""
    data = read_bytes(path)
    digest = sha256_of(data)
    notes: list[str] = []
    text, used = _decode(path, data, encoding, notes)
    stripped = text.rstrip("\x00")
    if len(stripped) < len(text):
        notes.append(f"{len(text) - len(stripped)} NUL bytes at the end of the file left out")
    if "\x00" in stripped:
        count = stripped.count("\x00")
        notes.append(f"{count} NUL byte{'s' * (count > 1)} inside the file; the cells there are unreadable")
        stripped = stripped.replace("\x00", "\ufffd")
    lines = stripped.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not any(line.strip() for line in lines):
        raise DataError(str(path), "the file holds only blank lines", "Export the recording again.")
    return TextFile(path, lines, used, digest, tuple(notes))


def _decode(path: Path, data: bytes, encoding: str | None, notes: list[str]) -> tuple[str, str]:
    if encoding is not None:
        try:
            return data.decode(encoding), encoding
        except LookupError:
            raise ConfigError(
                "channels.encoding", f"unknown encoding '{encoding}'", "Use utf-8, utf-16 or cp1252."
            ) from None
        except UnicodeDecodeError as error:
            raise DataError(
                str(path), f"is not {encoding} text (byte {error.start})", "Remove `encoding` from the mapping."
            ) from None
    for magic, (kind, remedy) in _MAGIC.items():
        if data.startswith(magic):
            raise DataError(str(path), f"is {kind}, not a text export", remedy)
    for bom, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(bom):
            return _strict(path, data, name), name
    wide = _utf16_without_bom(data)
    if wide:
        return _strict(path, data, wide), wide
    _refuse_binary(path, data)
    try:
        return data.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        notes.append("decoded as Windows-1252 (the file is not UTF-8)")
        return data.decode("cp1252", errors="replace"), "cp1252"


def _strict(path: Path, data: bytes, name: str) -> str:
    try:
        return data.decode(name)
    except UnicodeDecodeError as error:
        raise DataError(
            str(path), f"is damaged {name} text (byte {error.start})", "Export the recording again."
        ) from None


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
    sample = data[:65536].rstrip(b"\x00")
    control = sum(sample.count(bytes([code])) for code in (*range(9), 11, *range(14, 27), 28, 29, 30, 31, 127))
    if not sample or control > max(2, 0.02 * len(sample)):
        raise DataError(
            str(path), "is a binary file, not a text export", "Export the recording as CSV (or .mat with that suffix)."
        )
