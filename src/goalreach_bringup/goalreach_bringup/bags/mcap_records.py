"""Records of the MCAP format (version 0) as bytes and back.

A record is an opcode, the length of its content in eight bytes, and the content. Numbers are
little-endian; strings, maps and arrays carry their length in bytes before them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
import struct
from typing import Final

__all__ = [
    'MAGIC',
    'RECORD_HEAD',
    'Opcode',
    'Reader',
    'iterate_records',
    'number_map',
    'record',
    'text',
    'text_map',
]

MAGIC: Final = b'\x89MCAP0\r\n'
RECORD_HEAD: Final = struct.Struct('<BQ')
_U16: Final = struct.Struct('<H')
_U32: Final = struct.Struct('<I')
_U64: Final = struct.Struct('<Q')
_ENTRY: Final = struct.Struct('<HQ')


class Opcode(IntEnum):
    """Kinds of records that are written or read here."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record(opcode: Opcode, *parts: bytes) -> bytes:
    """Return a record made of the parts of its content."""
    return b''.join((RECORD_HEAD.pack(opcode, sum(map(len, parts))), *parts))


def text(value: str) -> bytes:
    """Return a string with its length."""
    data = value.encode()
    return _U32.pack(len(data)) + data


def text_map(values: Mapping[str, str]) -> bytes:
    """Return a map of strings with its length."""
    data = b''.join(text(key) + text(value) for key, value in values.items())
    return _U32.pack(len(data)) + data


def number_map(values: Iterable[tuple[int, int]]) -> bytes:
    """Return a map of 16-bit to 64-bit numbers with its length."""
    data = b''.join(_ENTRY.pack(key, value) for key, value in values)
    return _U32.pack(len(data)) + data


@dataclass
class Reader:
    """Reads the fields of a record's content one after the other.

    Attributes:
        data: The content.
        position: Where the next field begins.
    """

    data: memoryview
    position: int = 0

    def u16(self) -> int:
        """Return a 16-bit number."""
        return self._number(_U16)

    def u32(self) -> int:
        """Return a 32-bit number."""
        return self._number(_U32)

    def u64(self) -> int:
        """Return a 64-bit number."""
        return self._number(_U64)

    def bytes(self, length: int) -> memoryview:
        """Return the next bytes.

        Raises:
            ValueError: There are not that many.
        """
        if self.position + length > len(self.data):
            raise ValueError('a field ends after its record')
        self.position += length
        return self.data[self.position - length : self.position]

    def text(self) -> str:
        """Return a string."""
        return str(self.bytes(self.u32()), 'utf-8')

    def text_map(self) -> dict[str, str]:
        """Return a map of strings."""
        inner = Reader(self.bytes(self.u32()))
        values = {}
        while inner.position < len(inner.data):
            key = inner.text()
            values[key] = inner.text()
        return values

    def _number(self, form: struct.Struct) -> int:
        return int(form.unpack(self.bytes(form.size))[0])


def iterate_records(data: memoryview) -> Iterator[tuple[int, int, memoryview]]:
    """Yield offset, opcode and content of the records that follow one another in a chunk.

    Raises:
        ValueError: The last one is cut short.
    """
    position = 0
    while position < len(data):
        if position + RECORD_HEAD.size > len(data):
            raise ValueError('a record is cut short')
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        begin = position + RECORD_HEAD.size
        if begin + length > len(data):
            raise ValueError('a record is cut short')
        yield position, opcode, data[begin : begin + length]
        position = begin + length
