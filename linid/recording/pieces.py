"""The lines of a file that may be too long to be held at once: found in one pass, decoded again where they are used."""

from __future__ import annotations

import codecs
import hashlib
import io
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, BinaryIO, overload

from linid.errors import DataError

Opened = Callable[[], BinaryIO]
LONGEST_LINE = 1 << 26  # bytes: an endless line would be held whole


class LineError(ValueError):
    """A line, given by its number (from 1), is longer than any export's."""


@dataclass(frozen=True)
class Piece:
    """A stretch of a file: first line (from 0), first byte and number of bytes, the decoder's state there, and the
    text before it that belongs to its first line."""

    line: int
    offset: int
    size: int
    state: tuple[bytes, int]
    before: str


@dataclass(frozen=True)
class Scan:
    """All pieces of a file and what the whole of it showed; lines: their number, nuls: zero characters."""

    pieces: tuple[Piece, ...]
    encoding: str
    errors: str
    lines: int
    blank: bool
    nuls_inside: int
    nuls_at_end: int
    sha256: str


def scan(opened: Opened, encoding: str, size: int, errors: str = "strict") -> Scan:
    """Find the pieces of a text file, each of about `size` bytes and at least one line end.

    opened: opens the file at its beginning; errors: of the decoder. Raises OSError, LineError,
    and UnicodeDecodeError with the byte's place in the file.
    """
    digest = hashlib.sha256()
    decoder = _decoder(encoding, errors)
    pieces: list[Piece] = []
    begun = Piece(0, 0, 0, decoder.getstate(), "")
    parts: list[str] = []
    blank, nuls, offset, last = True, 0, 0, False
    with opened() as file:
        while not last:
            data = file.read(size)
            last = len(data) < size
            offset += len(data)
            digest.update(data)
            try:
                part = decoder.decode(data, last)
            except UnicodeDecodeError as error:
                error.start += offset - len(error.object)  # a mark at the beginning is not in it
                raise
            nuls += part.count("\x00")
            parts.append(part)
            begun = replace(begun, size=begun.size + len(data))
            if begun.size > LONGEST_LINE:
                raise LineError(begun.line + 1)
            if "\n" not in part and not last:
                continue
            text = begun.before + "".join(parts)
            parts.clear()
            pieces.append(begun)
            whole, _, rest = (text, "", "") if last else text.rpartition("\n")
            blank = blank and not whole.rstrip("\x00" if last else "").strip()
            begun = Piece(begun.line + whole.count("\n") + 1, offset, 0, decoder.getstate(), rest)
    at_end = len(text) - len(text.rstrip("\x00"))
    return Scan(tuple(pieces), encoding, errors, begun.line, blank, nuls - at_end, at_end, digest.hexdigest())


def _decoder(encoding: str, errors: str) -> Any:
    """An incremental decoder that turns all line ends into \\n."""
    return io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(errors), translate=True)


class LongText(Sequence[str]):
    """The lines of a scanned file (without line ends); one piece of them is held at a time.

    place: the file's name in messages. Raises DataError where the file is no longer as it was scanned.
    """

    def __init__(self, opened: Opened, found: Scan, place: str) -> None:
        self._opened, self._found, self._place = opened, found, place
        self._starts = [piece.line for piece in found.pieces]
        self._stops = [*self._starts[1:], found.lines]
        self._held: tuple[int, list[str]] = (-1, [])

    def __len__(self) -> int:
        return self._found.lines

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> list[str]: ...
    def __getitem__(self, index: int | slice) -> str | list[str]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        k = index + len(self) if index < 0 else index
        if not 0 <= k < len(self):
            raise IndexError(index)
        number = bisect_right(self._starts, k) - 1
        return self._lines(number)[k - self._starts[number]]

    def __iter__(self) -> Iterator[str]:
        for number in range(len(self._starts)):
            yield from self._lines(number)

    def texts(self, first: int, end: int) -> Iterator[tuple[int, int, str]]:
        """See `texts`; raises DataError where the text is no longer what it was."""
        for number, (start, stop) in enumerate(zip(self._starts, self._stops, strict=True)):
            if first <= start and stop <= end:
                yield start, stop, self._text(number)
            elif start < end and first < stop:
                a, b = max(first, start), min(end, stop)
                yield a, b, "\n".join(self._text(number).split("\n")[a - start : b - start])

    def _lines(self, number: int) -> list[str]:
        if self._held[0] != number:
            self._held = (-1, [])
            self._held = (number, self._text(number).split("\n"))
        return self._held[1]

    def _text(self, number: int) -> str:
        piece = self._found.pieces[number]
        last = number == len(self._found.pieces) - 1
        decoder = _decoder(self._found.encoding, self._found.errors)
        decoder.setstate(piece.state)
        with self._opened() as file:
            file.seek(piece.offset)
            data = file.read(piece.size)
        text: str = piece.before + decoder.decode(data, last and len(data) == piece.size)
        text = text.rstrip("\x00") if last else text.rpartition("\n")[0]
        if len(data) != piece.size or text.count("\n") + 1 != self._stops[number] - self._starts[number]:
            raise DataError(self._place, "the file changed while it was read", "Wait until its export is complete.")
        return text.replace("\x00", "\ufffd")


def texts(lines: Sequence[str], first: int, end: int) -> Iterator[tuple[int, int, str]]:
    """The lines from `first` to before `end` a piece at a time: its first line, the one after it, and its lines joined
    by \\n; a list is one piece."""
    if isinstance(lines, LongText):
        yield from lines.texts(first, end)
    else:
        yield first, end, "\n".join(lines[first:end])
