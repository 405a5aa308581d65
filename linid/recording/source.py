"""A recording on disk as readers see it: a regular file, unpacked if it came as .gz or .zip, with its first bytes."""

from __future__ import annotations

import gzip
import hashlib
import io
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

from linid.errors import DataError
from linid.recording.text import TextFile, decoded

HEAD = 65536  # bytes at the beginning that show what a file is
# Of a packed recording: a hostile archive unpacks to anything. 1e7 rows of six columns take this much.
MOST_UNPACKED = 1 << 29


@dataclass(frozen=True)
class Source:
    """path: as the user named it; name: of the content (without .gz, or of the archive's member); opened: opens the
    content at its beginning; size: bytes; head: its first bytes; notes: what was done to get at it; encoding: of its
    text, where the user names one."""

    path: Path
    name: str
    opened: Callable[[], BinaryIO]
    size: int
    head: bytes
    notes: tuple[str, ...] = ()
    encoding: str | None = None

    @property
    def suffix(self) -> str:
        """The suffix of the content's name, in lower case."""
        return Path(self.name).suffix.lower()

    @property
    def place(self) -> str:
        """The path as messages name it."""
        return str(self.path)

    def content(self) -> bytes:
        """All bytes."""
        with reading(self.path), self.opened() as file:
            return file.read()

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file as it lies on disk, in hexadecimal."""
        digest = hashlib.sha256()
        with reading(self.path), self.path.open("rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
        return digest.hexdigest()

    @cached_property
    def text(self) -> TextFile:
        """The content as decoded lines; see `text.decoded`."""
        with reading(self.path):
            found = decoded(self.path, self.opened, self.size, self.head, self.encoding)
        if not self.notes:  # the same bytes: the pass over them has told it
            self.__dict__["sha256"] = found.sha256
        return found.with_notes(self.notes)


def open_source(path: Path, encoding: str | None = None) -> Source:
    """The content of a file; encoding: of its text, else it is told by the bytes.

    Raises DataError for what is missing, unreadable, empty or no regular file.
    """
    with reading(path):
        about = path.stat()
        if stat.S_ISDIR(about.st_mode):
            raise IsADirectoryError
        if not stat.S_ISREG(about.st_mode):
            raise DataError(
                str(path), "is a pipe or a device, a recording is a regular file", "Write it to a file first."
            )
        with path.open("rb") as file:
            head = file.read(HEAD)
    if not head:
        raise DataError(str(path), "the file is empty (0 bytes)", "Export the recording again.")
    if head.startswith(b"\x1f\x8b"):
        name = path.stem if path.suffix.lower() == ".gz" else path.name
        return _unpacked(path, name, "gzip", _gunzip(path), encoding)
    if head.startswith(b"PK\x03\x04"):
        return _from_archive(path, encoding)
    return Source(path, path.name, lambda: path.open("rb"), about.st_size, head, encoding=encoding)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Raises what the operating system says against reading the file as a DataError."""
    try:
        yield
    except FileNotFoundError:
        raise DataError(str(path), "file not found", "Check the path.") from None
    except IsADirectoryError:
        raise DataError(str(path), "is a folder, a file is expected", "Name one recording in it.") from None
    except PermissionError:
        raise DataError(str(path), "no permission to read the file", "Change its permissions.") from None
    except OSError as error:
        raise DataError(_short(path), f"cannot be read: {error.strerror or error}", "Check the path.") from None
    except ValueError as error:  # a NUL in the path
        if isinstance(error, UnicodeError):
            raise
        raise DataError(_short(path), f"is no path: {error}", "Check the path.") from None


def _short(path: Path) -> str:
    text = str(path)
    return text if len(text) <= 300 else f"{text[:150]}...{text[-100:]}"


def _unpacked(path: Path, name: str, how: str, data: bytes, encoding: str | None) -> Source:
    if not data:
        raise DataError(str(path), f"the {how} file holds nothing", "Export the recording again.")
    notes = (f"unpacked from {how}: {name}",)
    return Source(path, name, lambda: io.BytesIO(data), len(data), data[:HEAD], notes, encoding)


def _gunzip(path: Path) -> bytes:
    with reading(path), gzip.open(path) as file:
        try:
            data = file.read(MOST_UNPACKED + 1)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise DataError(str(path), f"is a damaged gzip file ({error})", "Pack or copy it again.") from None
    return _not_too_much(path, data)


def _not_too_much(path: Path, data: bytes) -> bytes:
    if len(data) > MOST_UNPACKED:
        raise DataError(
            str(path), f"unpacks to more than {MOST_UNPACKED >> 20} MiB", "Unpack it first; a plain file may be longer."
        )
    return data


def _from_archive(path: Path, encoding: str | None) -> Source:
    """The only file of a ZIP archive; an Excel workbook is one too, and is refused as such."""
    try:
        with reading(path), zipfile.ZipFile(path) as archive:
            members = [
                one for one in archive.infolist() if not one.is_dir() and not one.filename.startswith("__MACOSX/")
            ]
            names = [one.filename for one in members]
            if "[Content_Types].xml" in names:
                raise DataError(str(path), "is an Excel workbook, not a text export", "Save the sheet as CSV first.")
            if len(members) != 1:
                listed = ", ".join(names[:5]) + (" ..." if len(names) > 5 else "")
                raise DataError(
                    str(path),
                    f"is a ZIP archive of {len(members)} files ({listed}), expected one recording",
                    "Unpack it and name the recordings.",
                )
            if members[0].flag_bits & 1:
                raise DataError(str(path), "is an encrypted ZIP archive", "Unpack it first.")
            with archive.open(members[0]) as file:
                data = _not_too_much(path, file.read(MOST_UNPACKED + 1))
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
        raise DataError(
            str(path),
            f"is an Excel workbook or ZIP archive that cannot be unpacked ({error})",
            "Save the sheet as CSV, or unpack the archive first.",
        ) from None
    return _unpacked(path, names[0], "ZIP", data, encoding)
