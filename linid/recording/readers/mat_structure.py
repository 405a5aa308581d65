"""Whether a level-5 .mat file is as its tags say: scipy follows wrong lengths into memory that is not its own.

Layout: MathWorks, MAT-File Format (R2023b), version 5. A data element is a tag (type, bytes) and its data, padded to
eight bytes; an array is an element of elements: flags, dimensions, name, and what it holds.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass

_WIDTHS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_COMPLEX = 0x0800
_DEEPEST = 30


class StructureError(ValueError):
    """The file is not as its tags say."""


@dataclass(frozen=True)
class _Element:
    """type of the data, the data, and where in its parent the next element begins."""

    type: int
    data: memoryview
    after: int


def check_structure(data: bytes, most: int) -> None:
    """Raises StructureError where a length, a type or a count of a level-5 file cannot be; most: bytes that all of its
    packed parts may unpack to.
    """
    if 0 in data[:4]:
        return  # of level 4: no lengths within lengths
    if len(data) < 128:
        raise StructureError("ends within its header")
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise StructureError("does not say in which order its bytes stand")
    view, at, unpacked = memoryview(data), 128, 0
    while at < len(view):
        one = _element(view, at, order)
        if one.type == _COMPRESSED:
            inner = zlib.decompressobj()
            try:
                plain = inner.decompress(bytes(one.data), most - unpacked + 1)
            except zlib.error as error:
                raise StructureError(f"packed data are damaged ({error})") from None
            unpacked += len(plain)
            if unpacked > most:
                raise StructureError(f"unpacks to more than {most >> 20} MiB")
            packed = _element(memoryview(plain), 0, order)
            if packed.type == _MATRIX:
                _matrix(packed.data, order, 0)
        elif one.type == _MATRIX:
            _matrix(one.data, order, 0)
        at = one.after


def _element(view: memoryview, at: int, order: str) -> _Element:
    if at + 8 > len(view):
        raise StructureError("ends within a tag")
    kind, size = struct.unpack_from(f"{order}II", view, at)
    if kind >> 16:  # a small element: its length and data share the tag
        size, kind = kind >> 16, kind & 0xFFFF
        if size > 4 or kind not in _WIDTHS:
            raise StructureError("has a small element of wrong length or type")
        return _Element(kind, view[at + 4 : at + 4 + size], at + 8)
    if kind not in _WIDTHS and kind not in (_MATRIX, _COMPRESSED):
        raise StructureError(f"has data of the unknown type {kind}")
    if at + 8 + size > len(view):
        raise StructureError("ends within its data")
    padded = size if kind == _COMPRESSED else -(-size // 8) * 8
    return _Element(kind, view[at + 8 : at + 8 + size], at + 8 + padded)


def _numbers(one: _Element, order: str) -> tuple[int, ...]:
    """The whole numbers of an element."""
    code = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I"}.get(one.type)
    if code is None or len(one.data) % _WIDTHS[one.type]:
        raise StructureError("has flags or dimensions of a wrong type")
    return struct.unpack(f"{order}{len(one.data) // _WIDTHS[one.type]}{code}", one.data)


def _matrix(view: memoryview, order: str, depth: int) -> None:
    if not len(view):
        return  # an empty array
    if depth > _DEEPEST:
        raise StructureError("is nested too deeply")
    flags = _element(view, 0, order)
    values = _numbers(flags, order)
    if flags.type != 6 or len(values) != 2:
        raise StructureError("has an array without flags")
    kind = values[0] & 0xFF
    if not 1 <= kind <= _OPAQUE:
        raise StructureError(f"has an array of the unknown class {kind}")
    if kind == _OPAQUE:
        return  # MATLAB's own; no tool reads its insides
    dimensions = _element(view, flags.after, order)
    shape = _numbers(dimensions, order)
    name = _element(view, dimensions.after, order)
    if dimensions.type not in (5, 6) or len(shape) < 2 or min(shape) < 0 or name.type not in (1, 16):
        raise StructureError("has an array without dimensions or name")
    count, at = math.prod(shape), name.after
    if kind in (_CELL, _STRUCT, _OBJECT, _FUNCTION):
        _container(view, at, order, kind, count, depth)
    elif kind not in (_CHAR, _SPARSE):
        for _ in range(2 if values[0] & _COMPLEX else 1):
            part = _element(view, at, order)
            if part.type not in _WIDTHS or len(part.data) != count * _WIDTHS[part.type]:
                raise StructureError(f"has an array of {count} numbers with data for others")
            at = part.after
    else:
        while at < len(view):
            part = _element(view, at, order)
            if part.type not in _WIDTHS:
                raise StructureError("has a text or sparse array of broken data")
            at = part.after


def _container(view: memoryview, at: int, order: str, kind: int, count: int, depth: int) -> None:
    """Arrays within an array, as many as it declares."""
    fields = 1
    if kind == _OBJECT:
        at = _element(view, at, order).after
    if kind in (_STRUCT, _OBJECT):
        length = _element(view, at, order)
        names = _element(view, length.after, order)
        width = _numbers(length, order)
        if len(width) != 1 or width[0] < 1 or len(names.data) % width[0]:
            raise StructureError("has a struct without names of its fields")
        fields, at = len(names.data) // width[0], names.after
    if count * fields * 8 > len(view):
        raise StructureError(f"has a container of {count} arrays without them")
    for _ in range(1 if kind == _FUNCTION else count * fields):
        part = _element(view, at, order)
        if part.type != _MATRIX:
            raise StructureError("has a container of something else than arrays")
        _matrix(part.data, order, depth + 1)
        at = part.after
