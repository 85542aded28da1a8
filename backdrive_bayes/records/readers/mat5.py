"""MATLAB level 5 files, read with every length checked: damaged ones crash the interpreter in a reader that trusts them.

Format: MathWorks, "MAT-File Format", level 5: elements of a tag (type, bytes) and data; a matrix element holds flags, dimensions,
a name and values, a structure's values are matrices again.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.readers import limits

HEADER_BYTES = 128
_ORDERS = {b"IM": "<", b"MI": ">"}
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_STRUCT, _NUMERIC, _COMPLEX = 2, range(6, 16), 0x0800
_NOTHING = memoryview(b"")


@dataclass(frozen=True)
class Leaf:
    """A numeric variable, or a numeric field of a structure as 'structure.field', of ``shape``; ``values`` reads it."""

    name: str
    shape: tuple[int, ...]
    number: str
    content: memoryview

    @property
    def values(self) -> np.ndarray:
        """The values in the order of the file, shape (values,); ValueError where they are not as many as the dimensions say."""
        found = np.frombuffer(self.content, self.number)
        if found.size != math.prod(self.shape):
            raise ValueError(f"{found.size} values in a matrix of dimensions {self.shape}")
        return found


def is_level_5(start: bytes) -> bool:
    """Whether a file's first bytes are a level 5 header."""
    return len(start) >= HEADER_BYTES and start[126:128] in _ORDERS


def leaves(data: bytes) -> list[Leaf]:
    """All real numeric arrays of a file; ValueError where its bytes contradict each other."""
    order, inflated = _ORDERS[bytes(data[126:128])], 0
    found: list[Leaf] = []
    for kind, content in _elements(memoryview(data)[HEADER_BYTES:], order):
        if kind == _COMPRESSED:
            whole = _inflated(content, limits.MAX_BYTES - inflated)
            inflated += len(whole)
            kind, content = next(_elements(whole, order), (0, whole))
        if kind == _MATRIX:
            _collect(content, order, "", 0, found)
    return found


def _elements(view: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and data of the elements in a stretch of bytes."""
    at = 0
    while at + 8 <= len(view):
        kind, size = (int(v) for v in np.frombuffer(view[at : at + 8], f"{order}u4"))
        small = kind >> 16  # four bytes of data or less stand within the tag
        if small:
            kind, size, begin, end = kind & 0xFFFF, small, at + 4, at + 8
        else:
            begin, end = at + 8, at + 8 + (size if kind == _COMPRESSED else -(-size // 8) * 8)
        if begin + size > len(view) or (small and size > 4):
            raise ValueError(f"an element of {size} bytes where {len(view) - begin} are left")
        yield kind, view[begin : begin + size]
        at = end


def _inflated(content: memoryview, most: int) -> memoryview:
    bound = min(most, max(limits.FREE_INFLATED_BYTES, limits.MAX_INFLATION * len(content)))
    inflater = zlib.decompressobj()
    try:
        data = inflater.decompress(content, max(bound, 1))
    except zlib.error as error:
        raise ValueError(str(error)) from error
    if not inflater.eof:
        raise ValueError("a compressed variable that is cut, or far larger than its size in the file")
    return memoryview(data)


def _collect(view: memoryview, order: str, prefix: str, depth: int, found: list[Leaf]) -> None:
    """Add the numeric arrays in one matrix element, those in structures below it as well."""
    parts = _elements(view, order)
    head = [content for _, content in zip(range(3), (content for _, content in parts), strict=False)]
    if len(head) < 3 or len(head[0]) < 4:
        raise ValueError("a matrix without flags, dimensions or name")
    flags, shape = int(np.frombuffer(head[0][:4], f"{order}u4")[0]), _shape(head[1], order)
    name, kind = prefix + bytes(head[2]).decode("utf-8", "replace"), flags & 0xFF
    if kind == _STRUCT and math.prod(shape) == 1 and depth < limits.MOST_DEPTH:
        _collect_fields(parts, order, name, depth, found)
    elif kind in _NUMERIC and not flags & _COMPLEX:
        number, content = next(parts, (0, _NOTHING))
        if number in _NUMBERS and len(content) % np.dtype(_NUMBERS[number]).itemsize == 0:
            found.append(Leaf(name, shape, order + _NUMBERS[number], content))
    if len(found) > limits.MOST_ARRAYS:
        raise ValueError(f"more than {limits.MOST_ARRAYS} arrays")


def _shape(content: memoryview, order: str) -> tuple[int, ...]:
    shape = tuple(int(n) for n in np.frombuffer(content[: len(content) // 4 * 4], f"{order}i4"))
    if not 1 < len(shape) < 10 or min(shape) < 0:
        raise ValueError(f"a matrix of dimensions {shape[:10]}")
    return shape


def _collect_fields(parts, order: str, name: str, depth: int, found: list[Leaf]) -> None:
    length, names = next(parts, (0, _NOTHING))[1], next(parts, (0, _NOTHING))[1]
    size = int(np.frombuffer(length[:4], f"{order}i4")[0]) if len(length) >= 4 else 0
    if not 0 < size <= 1024 or len(names) % size:
        raise ValueError(f"a structure of {len(names)} bytes of names, {size} each")
    for at in range(0, len(names), size):
        field = bytes(names[at : at + size]).split(b"\0")[0].decode("utf-8", "replace")
        kind, content = next(parts, (0, _NOTHING))
        if kind != _MATRIX:
            raise ValueError(f"no matrix for field '{field}'")
        if len(content):
            _collect(content, order, f"{name}.{field}", depth + 1, found)
