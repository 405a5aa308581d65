"""Writing result files whole or not at all, and keeping a list of them in the folder of their run."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import json
import math
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from linid.arrays import Array
from linid.digests import file_digest
from linid.errors import UsageError

LIST_FILE = ".linid_files"
_NO_NUMBER = re.compile("-?(?:nan|inf)")
ANY = "*"  # in place of a hash: a file that grows, such as a log
_ACTIVE: list[FileList] = []


class FileList:
    """The files that runs wrote into a folder, with the SHA-256 of every content that they gave them.

    Kept in `LIST_FILE`, a line per content, written before the file itself: a run that is killed leaves nothing that is
    not listed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self._known: dict[str, set[str]] = {}
        with contextlib.suppress(OSError):
            for line in (self.folder / LIST_FILE).read_text(encoding="utf-8").splitlines():
                self._take(line)

    def _take(self, line: str) -> None:
        try:
            entry = json.loads(line)
            self._known.setdefault(str(entry["file"]), set()).add(str(entry["sha256"]))
        except (ValueError, KeyError, TypeError):
            return  # the last line of a run that was killed

    @property
    def files(self) -> tuple[str, ...]:
        """Paths relative to the folder."""
        return tuple(self._known)

    def note(self, path: Path, digest: str) -> None:
        """List a content that is about to be written; raises UsageError for a file that is there and is not listed."""
        name = path.resolve().relative_to(self.folder).as_posix()
        if name not in self._known and path.exists():
            raise UsageError(
                str(path), "is in the way: a file that no run of linid wrote there", "Move it, or choose another --out."
            )
        if digest in self._known.get(name, ()):
            return
        self._known.setdefault(name, set()).add(digest)
        with (self.folder / LIST_FILE).open("a", encoding="utf-8") as file:
            file.write(json.dumps({"file": name, "sha256": digest}) + "\n")

    def own(self) -> list[Path]:
        """The listed files that are there as a run left them; raises UsageError for one that was changed since."""
        found = []
        for name, digests in self._known.items():
            path = self.folder / name
            if not path.is_file() or path.is_symlink():
                continue
            if ANY not in digests and file_digest(path) not in digests:
                raise UsageError(
                    str(path), "has been changed since a run of linid wrote it", "Move it, or choose another --out."
                )
            found.append(path)
        return found

    def half_written(self) -> Iterator[Path]:
        """What a run that was killed left of files that it was writing."""
        for name in self._known:
            path = self.folder / name
            yield from path.parent.glob(f".{glob_escaped(path.name)}.linid-*")


def glob_escaped(name: str) -> str:
    """A name as a pattern that matches itself."""
    return re.sub(r"([*?\[])", r"[\1]", name)


@contextlib.contextmanager
def nothing_partial(path: Path) -> Iterator[None]:
    """Raises what the operating system says against writing `path` as an OSError that names it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def start_listing(folder: Path) -> FileList:
    """From now on list what this process writes below a folder."""
    stop_listing(folder)
    found = FileList(folder)
    _ACTIVE.append(found)
    return found


def stop_listing(folder: Path) -> None:
    """No longer list what is written below a folder."""
    resolved = folder.resolve()
    _ACTIVE[:] = [one for one in _ACTIVE if one.folder != resolved]


def listing_of(path: Path) -> FileList | None:
    """The list of the innermost open run that a path lies in."""
    resolved = path.resolve()
    inside = [one for one in _ACTIVE if resolved.is_relative_to(one.folder)]
    return max(inside, key=lambda one: len(one.folder.parts), default=None)


def write_atomic(path: Path, content: bytes) -> Path:
    """Write `content` to `path` through a temporary file beside it, so that a reader never sees half a file.

    Inside the folder of an open run the file is listed first. Raises OSError naming the path where it cannot be
    written, UsageError where somebody else's file is in the way.
    """
    path = Path(path)
    with nothing_partial(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        listing = listing_of(path)
        if listing is not None:
            listing.note(path, hashlib.sha256(content).hexdigest())
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.linid-")
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            umask = os.umask(0)
            os.umask(umask)
            os.chmod(temporary, 0o666 & ~umask)  # mkstemp makes it private; a report is not
            os.replace(temporary, path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    return path


def file_stems(names: Iterable[str]) -> list[str]:
    """A stable, distinct and portable file stem for each recording name."""
    stems: list[str] = []
    taken: set[str] = set()
    for name in names:
        base = re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("._")[:100] or "recording"
        stem, count = base, 1
        while stem.lower() in taken:
            count += 1
            stem = f"{base}_{count}"
        taken.add(stem.lower())
        stems.append(stem)
    return stems


def finite(value: Any) -> Any:
    """The same value with None for every number that JSON cannot hold, and lists for tuples."""
    if isinstance(value, Mapping):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(one) for one in value]
    if isinstance(value, float):  # also numpy's double
        return float(value) if math.isfinite(value) else None
    return value


def spreadsheet_safe(cell: object) -> object:
    """A cell as a spreadsheet takes it for what it is: text that would begin a formula gets an apostrophe in front
    (OWASP, CSV injection); numbers stay numbers."""
    if not isinstance(cell, str) or not cell.startswith(("=", "+", "-", "@", "\t", "\r")):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def csv_text(header: Sequence[str], rows: Iterable[Iterable[Any]], digits: int = 17) -> str:
    """A CSV file; digits: of numbers, all of them by default; what is None or no number becomes an empty cell."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_cell(value, digits) for value in row] for row in rows)
    return stream.getvalue()


def columns_csv_text(header: Sequence[str], columns: Sequence[Array], digits: int) -> str:
    """`csv_text` of columns (n,) of floating-point numbers, in an eighth of the time."""
    form = ",".join([f"%.{digits}g"] * len(columns))
    lines = [form % numbers for numbers in zip(*(column.tolist() for column in columns), strict=True)]
    return csv_text(header, ()) + _NO_NUMBER.sub("", "\n".join([*lines, ""]))


def _cell(value: Any, digits: int) -> Any:
    value = spreadsheet_safe(finite(value))
    return f"{value:.{digits}g}" if isinstance(value, float) and digits < 17 else value
