"""TwinCAT Scope's binary export (.svb): a main header, one header per channel, then each channel's samples.

Layout: Beckhoff, TE13xx Scope View, "Export to svb": little-endian, texts in UTF-8 after their length (Int32), times in
ticks of 100 ns. The main header holds its size (Int64), name, start and end (Int64), number of channels (Int32); a
channel's its size (Int64), name, net id, port (Int32), sample time (Int64), symbol based (Byte), symbol, comment, index
group and offset (Int64), data type (text), its number and size in bytes (Int32), samples, bytes and first byte in the
file (Int64), offset and scale factor (Real64), bit mask (Int64). A sample is a time stamp (UInt32) and a value, or,
exported without times, the value alone.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from linid.errors import DataError
from linid.recording.mapping import ChannelMapping
from linid.recording.readers.reader import Reader
from linid.recording.source import Source
from linid.recording.table import Column, Table, Used, array_column

_TICK = 1e-4  # ms
_MOST_CHANNELS = 4096
_LONGEST_TEXT = 65536
_TYPES = {
    "BIT": "u1",
    "BOOL": "u1",
    "BYTE": "u1",
    "USINT": "u1",
    "UINT8": "u1",
    "SINT": "i1",
    "INT8": "i1",
    "WORD": "<u2",
    "UINT": "<u2",
    "UINT16": "<u2",
    "INT": "<i2",
    "INT16": "<i2",
    "DWORD": "<u4",
    "UDINT": "<u4",
    "UINT32": "<u4",
    "DINT": "<i4",
    "INT32": "<i4",
    "LWORD": "<u8",
    "ULINT": "<u8",
    "UINT64": "<u8",
    "LINT": "<i8",
    "INT64": "<i8",
    "REAL": "<f4",
    "REAL32": "<f4",
    "LREAL": "<f8",
    "REAL64": "<f8",
}


@dataclass(frozen=True)
class _Channel:
    """A channel's header; sample_time: ticks; begin: byte of its first sample."""

    name: str
    symbol: str
    sample_time: int
    type: str
    width: int
    samples: int
    bytes: int
    begin: int
    offset: float
    scale: float


class _Bytes:
    """Reads the headers' fields one after the other; DataError where the file ends or a length makes no sense."""

    def __init__(self, data: bytes, place: str) -> None:
        self.data, self.place, self.at = data, place, 0

    def number(self, form: str) -> float:
        size = struct.calcsize(form)
        if self.at + size > len(self.data):
            raise self.damaged("ends within its headers")
        (value,) = struct.unpack_from(f"<{form}", self.data, self.at)
        self.at += size
        return value  # type: ignore[no-any-return]

    def whole(self, form: str) -> int:
        return int(self.number(form))

    def text(self) -> str:
        size = self.whole("i")
        if not 0 <= size <= _LONGEST_TEXT or self.at + size > len(self.data):
            raise self.damaged(f"declares a text of {size} bytes")
        text = self.data[self.at : self.at + size].decode("utf-8", "replace")
        self.at += size
        return text.rstrip("\x00")

    def damaged(self, what: str) -> DataError:
        return DataError(
            f"{self.place}, byte {self.at}",
            f"{what}: no TwinCAT svb export, or a damaged one",
            "Export again with the header in the same file, or as CSV.",
        )


def _recognises(source: Source) -> bool:
    if source.suffix == ".svb":
        return True
    if len(source.head) < 36:
        return False
    header, name = struct.unpack_from("<qi", source.head)
    return 0 <= name <= 1024 and header in (32 + name, 24 + name)


def _read(source: Source, mapping: ChannelMapping, used: Used | None = None) -> Table:
    del mapping, used
    data = source.content()
    reader = _Bytes(data, source.place)
    channels = _headers(reader)
    columns: list[Column] = []
    notes = list(source.notes)
    for group, channel in enumerate(channels):
        columns += _columns(reader, channel, group)
    if scaled := [c.name for c in channels if (c.offset, c.scale) not in ((0.0, 1.0), (0.0, 0.0))]:
        notes.append(
            f"the header declares scaling ({', '.join(scaled[:4])}); the values are used as they stand in the file "
            "(give `scale` in the mapping if the export was unscaled)"
        )
    return Table(source.path, "svb", tuple(columns), source.sha256, dialect="binary", notes=tuple(notes))


def _headers(reader: _Bytes) -> list[_Channel]:
    reader.whole("q")  # size of this header
    reader.text()
    reader.whole("q"), reader.whole("q")
    count = reader.whole("i")
    if not 1 <= count <= _MOST_CHANNELS:
        raise reader.damaged(f"declares {count} channels")
    return [_channel(reader) for _ in range(count)]


def _channel(reader: _Bytes) -> _Channel:
    begin = reader.at
    size = reader.whole("q")
    name = reader.text()
    reader.text(), reader.whole("i")  # net id, port
    sample_time = reader.whole("q")
    reader.whole("b")
    symbol = reader.text()
    reader.text(), reader.whole("q"), reader.whole("q")  # comment, index group, index offset
    kind = reader.text()
    reader.whole("i")
    width = reader.whole("i")
    samples, length, first = reader.whole("q"), reader.whole("q"), reader.whole("q")
    offset, scale = reader.number("d"), reader.number("d")
    reader.whole("q")
    # Newer versions append to the header; its size says where the next one begins.
    if begin + size > reader.at and begin + size <= len(reader.data):
        reader.at = begin + size
    return _Channel(name, symbol, sample_time, kind, width, samples, length, first, offset, scale)


def _columns(reader: _Bytes, channel: _Channel, group: int) -> list[Column]:
    """Time and values of one channel."""
    value = _TYPES.get(channel.type.strip().upper())
    if value is None or np.dtype(value).itemsize != channel.width:
        raise reader.damaged(f"channel '{channel.name}' has the type {channel.type!r} of {channel.width} bytes")
    timed = np.dtype([("t", "<u4"), ("x", value)])
    bare = np.dtype([("x", value)])
    n = channel.samples
    if n < 0 or channel.begin < 0 or channel.begin + n * bare.itemsize > len(reader.data):
        raise reader.damaged(f"channel '{channel.name}' declares {n} samples from byte {channel.begin} on")
    with_times = channel.bytes == n * timed.itemsize or (
        channel.bytes != n * bare.itemsize and channel.begin + n * timed.itemsize <= len(reader.data)
    )
    layout = timed if with_times else bare
    if channel.begin + n * layout.itemsize > len(reader.data):
        raise reader.damaged(f"channel '{channel.name}' is cut short")
    rows = np.frombuffer(reader.data, layout, n, channel.begin)
    ticks = rows["t"].astype(np.float64) if with_times else channel.sample_time * np.arange(n, dtype=np.float64)
    if n > 1 and not with_times and channel.sample_time <= 0:
        raise reader.damaged(f"channel '{channel.name}' has neither time stamps nor a sample time")
    aliases = (channel.symbol,) if channel.symbol else ()
    return [
        array_column(f"Time {group + 1}", ticks * _TICK, unit="ms", group=group, time=True),
        array_column(channel.name, rows["x"], group=group, time=False, aliases=aliases),
    ]


READER = Reader("svb", "TwinCAT Scope's binary export (.svb)", _recognises, _read)
