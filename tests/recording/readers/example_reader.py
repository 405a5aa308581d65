"""A reader as another package would bring it: `key=value` lines, announced by `#kv`.

Its pyproject.toml would say: [project.entry-points."linid.readers"]  kv = "example_reader:READER".
"""

from __future__ import annotations

import numpy as np

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Table, Used, array_column


def _recognises(source: Source) -> bool:
    return source.head.startswith(b"#kv")


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    rows = [dict(cell.split("=") for cell in line.split()) for line in source.text.lines[1:] if line.strip()]
    try:
        columns = [array_column(name, np.array([float(row[name]) for row in rows])) for name in rows[0]]
    except (KeyError, ValueError, IndexError) as error:
        raise DataError(source.place, f"is a damaged kv file ({error})", "Export it again.") from None
    return Table(source.path, "kv", tuple(columns), source.sha256, source.text.encoding)


READER = Reader("kv", "key=value lines after #kv", _recognises, _read)
NO_READER = "nothing"
RIVAL = Reader("twincat", "takes a name of linid's own", _recognises, _read)
