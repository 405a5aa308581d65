"""The explicit list of all readers; the first that recognises a file reads it, unless the mapping names one.

Readers of other packages come before those of linid: an entry point of the group `linid.readers` names a `Reader`.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint
from pathlib import Path

from linid.entry_points import loaded, of_group
from linid.errors import ConfigError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers import (
    codesys,
    controldesk,
    elmo,
    generic,
    halscope,
    hdf5,
    matlab,
    mdf,
    parquet,
    svb,
    tdms,
    twincat,
)
from linid.recording.readers.reader import Reader, check_reader
from linid.recording.source import open_source
from linid.recording.table import Table, Used

GROUP = "linid.readers"

# Told by bytes first, then by marks in the text; what nothing marks is generic.
BUILT_IN: tuple[Reader, ...] = (
    matlab.READER,
    hdf5.READER,
    mdf.READER,
    tdms.READER,
    parquet.READER,
    svb.READER,
    twincat.READER,
    controldesk.READER,
    elmo.READER,
    halscope.READER,
    codesys.READER,
    generic.READER,
)


def collect(built_in: Iterable[Reader], others: Iterable[EntryPoint]) -> tuple[Reader, ...]:
    """All readers in order; raises ConfigError for a malformed one or a name that is taken already."""
    own = tuple(built_in)
    owners = {reader.name: "linid" for reader in own}
    found: list[Reader] = []
    for one, place in loaded(others):
        reader = check_reader(one, place)
        if reader.name in owners:
            raise ConfigError(
                place, f"the format name {reader.name!r} is taken by {owners[reader.name]}", "Rename it, or uninstall."
            )
        owners[reader.name] = place
        found.append(reader)
    return (*found, *(check_reader(reader, "linid") for reader in own))


@cache
def readers() -> tuple[Reader, ...]:
    """All readers, those of other packages first."""
    return collect(BUILT_IN, of_group(GROUP))


def read_table(path: Path, mapping: ChannelMapping, used: Used | None = None) -> Table:
    """Read any supported export; the format is recognised by its marks unless the mapping names it.

    used: numbers of the columns in use, told from the table before it has values (default: all); of a long file, only
    these are kept. Raises DataError for what cannot be read.
    """
    source = open_source(path, mapping.encoding)
    if mapping.layout is not None:
        reader = find_reader("channels.layout", mapping.layout)
    else:
        reader = next(one for one in readers() if one.recognises(source))
    return reader.read(source, mapping, used)


def find_reader(place: str, name: str) -> Reader:
    """The reader called `name`; raises ConfigError with the known ones otherwise."""
    for reader in readers():
        if reader.name == name:
            return reader
    raise ConfigError(place, f"there is no format {name!r}", f"Known: {', '.join(r.name for r in readers())}.")
