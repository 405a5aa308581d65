"""What a reader of one export format is, and what every one must keep to."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from linid.errors import ConfigError, DataError, LinidError
from linid.recording.mapping import ChannelMapping
from linid.recording.source import Source
from linid.recording.table import Table, Used

Recognises = Callable[[Source], bool]
Read = Callable[[Source, ChannelMapping, Used | None], Table]


@dataclass(frozen=True)
class Reader:
    """One export format.

    name: as `layout:` in a mapping states it; about: one line for users; recognises: whether a source is of this
    format, told by its first bytes or lines, not raising on any content (a text reader may let `Source.text` raise);
    read: source, mapping and the columns in use (see `registry.read_table`) -> table, raising DataError with place,
    fact and remedy for what it cannot read; extra: the extra of linid that brings its library ("": none needed).
    """

    name: str
    about: str
    recognises: Recognises
    read: Read
    extra: str = ""


def check_reader(reader: object, place: str) -> Reader:
    """A reader as registered, if it is one; raises ConfigError otherwise."""
    if not isinstance(reader, Reader):
        raise ConfigError(place, f"is a {type(reader).__name__}, expected a linid Reader", "Correct the package.")
    if not re.fullmatch(r"[a-z][a-z0-9_]{1,30}", reader.name):
        raise ConfigError(place, f"the format name {reader.name!r} is no plain word", "Use a-z, 0-9 and _.")
    if not reader.about.strip() or "\n" in reader.about:
        raise ConfigError(place, f"format {reader.name!r} says nothing about itself", "Give `about` in one line.")
    return reader


def library(name: str, source: Source, extra: str = "formats") -> Any:
    """The module of a format's own library; raises DataError naming the extra where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        raise DataError(
            source.place,
            f"needs the library {name.split('.')[0]}, which is not installed",
            f'Install it: pip install "linid[{extra}]".',
        ) from None


@contextmanager
def whole(source: Source, what: str) -> Iterator[None]:
    """What a format's own library raises on a damaged file, which may be anything, as a DataError."""
    try:
        yield
    except LinidError:
        raise
    except Exception as error:
        fact = (str(error).splitlines() or [type(error).__name__])[0][:200]
        raise DataError(source.place, f"is a damaged {what} file ({fact})", "Save or copy it again.") from None
