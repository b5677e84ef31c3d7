"""Messages of one size in CDR, the encoding of DDS: numbers at known places among fixed bytes.

To build an object of a generated message class, or to have rclpy fill one, costs ten times as much
as the same numbers packed where CDR has them. What goes over the wire is the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
import struct
from typing import Any

LITTLE_ENDIAN = b'\x00\x01\x00\x00'
"""What precedes a message that is encoded as here."""

STAMP_END = 12
"""A message of ours begins with its stamp; here it ends."""

PADDING = 4
"""DDS may lengthen a message to the next multiple of this many bytes."""

_NS_PER_S = 1_000_000_000
_ORIGIN = _STAMP_AT = len(LITTLE_ENDIAN)
_LENGTH = struct.Struct('<I')
_LITTLE_STAMP = struct.Struct('<iI')
_BIG_STAMP = struct.Struct('>iI')


@dataclass(frozen=True)
class Run:
    """Numbers of one kind in a row that differ from message to message.

    Attributes:
        numbers: Their format for `struct`, as '7d'.
    """

    numbers: str


class Fixed(Run):
    """Numbers that are the same in every message.

    Args:
        numbers: Their format for `struct`.
        values: The numbers.
    """

    def __init__(self, numbers: str, *values: float) -> None:
        """Keep the numbers."""
        super().__init__(numbers)
        self.values = values


class CdrLayout:
    """Where the numbers of a message are that begins with a stamp and never changes its size.

    Args:
        fields: What follows the stamp: texts, fixed numbers and runs.

    Attributes:
        template: A message with zeros for stamp and runs.

    >>> layout = CdrLayout('map', Run('2d'))
    >>> layout.unpack(layout.pack(5, (1.0, 2.0)))
    (1.0, 2.0)
    """

    def __init__(self, *fields: str | Run) -> None:
        """Lay the fields out."""
        self._runs: list[tuple[struct.Struct, int]] = []
        self._fixed: list[tuple[int, bytes]] = []
        raw = bytearray(LITTLE_ENDIAN.ljust(STAMP_END, b'\0'))
        begin = STAMP_END
        for field in fields:
            if isinstance(field, str):
                _align(raw, _LENGTH.size)
                raw += _LENGTH.pack(len(field.encode()) + 1) + field.encode() + b'\0'
                continue
            _align(raw, struct.calcsize(f'<{field.numbers[-1]}'))
            packer = struct.Struct(f'<{field.numbers}')
            if isinstance(field, Fixed):
                raw += packer.pack(*field.values)
                continue
            self._runs.append((packer, len(raw)))
            self._fixed.append((begin, bytes(raw[begin:])))
            raw += bytes(packer.size)
            begin = len(raw)
        self._fixed.append((begin, bytes(raw[begin:])))
        self.template = bytes(raw)

    def pack(self, stamp_ns: int, *runs: Iterable[float]) -> bytes:
        """Return the message with that stamp and these numbers, run by run."""
        raw = bytearray(self.template)
        set_stamp(raw, stamp_ns)
        for (packer, at), numbers in zip(self._runs, runs, strict=True):
            packer.pack_into(raw, at, *numbers)
        return bytes(raw)

    def fits(self, raw: bytes, more: int = 0) -> bool:
        """Return whether a message is the template, but for stamp and runs.

        Args:
            raw: The message.
            more: How many bytes should follow what is laid out.
        """
        return (
            0 <= len(raw) - len(self.template) - more < PADDING
            and raw.startswith(LITTLE_ENDIAN)
            and all(raw.startswith(part, at) for at, part in self._fixed)
        )

    def unpack(self, raw: bytes, run: int = 0) -> tuple[Any, ...]:
        """Return the numbers of one run of a message that fits."""
        packer, at = self._runs[run]
        return packer.unpack_from(raw, at)


def _align(raw: bytearray, size: int) -> None:
    raw += bytes(-(len(raw) - _ORIGIN) % size)


def pack_text(text: str) -> bytes:
    """Return a text: its length, itself, and zeros up to a multiple of four bytes."""
    body = text.encode()
    return _LENGTH.pack(len(body) + 1) + body + bytes(4 - len(body) % 4)


def set_stamp(raw: bytearray, stamp_ns: int) -> None:
    """Write the stamp of a message that begins with it."""
    _LITTLE_STAMP.pack_into(raw, _STAMP_AT, *divmod(stamp_ns, _NS_PER_S))


def stamp_of(raw: bytes) -> int | None:
    """Return the stamp of a message that begins with it, ns; None where it is too short."""
    if len(raw) < STAMP_END:
        return None
    stamp = _LITTLE_STAMP if raw[1] & 1 else _BIG_STAMP
    sec, nanosec = stamp.unpack_from(raw, _STAMP_AT)
    return int(sec * _NS_PER_S + nanosec)


def without_stamp(raw: bytes) -> bytes:
    """Return a message with the stamp 0, so that messages which are otherwise the same are so."""
    return raw[:_STAMP_AT] + bytes(STAMP_END - _STAMP_AT) + raw[STAMP_END:]
