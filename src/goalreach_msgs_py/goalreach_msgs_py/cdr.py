"""CDR, the encoding of ROS 2 messages: fields in order, aligned to their size, either byte order.

`CdrWriter` and `CdrReader` are what the `x_to_raw` and `x_from_raw` conversions are made of. They
pass numbers straight between values and bytes, without a message object in between.
"""

from functools import lru_cache
import struct
from typing import Any

from goalreach_msgs_py.errors import GoalreachError, one_line

_NS_PER_S = 1_000_000_000
_LITTLE_ENDIAN = b'\x00\x01\x00\x00'
_ORIGIN = len(_LITTLE_ENDIAN)
"""Alignment counts from here."""
_STAMP = struct.Struct('<iI')
_BIG_STAMP = struct.Struct('>iI')
_STAMP_END = _ORIGIN + _STAMP.size


class MessageError(GoalreachError):
    """A message whose content cannot be used; the text names field and value."""

    def __init__(self, text: str) -> None:
        """Keep the text to one line: what came over the wire may be long."""
        super().__init__(one_line(text))


@lru_cache
def _little(numbers: str) -> tuple[struct.Struct, int]:
    """Return the packer of some numbers, and the size to which the first is aligned."""
    return struct.Struct(f'<{numbers}'), struct.calcsize(f'={numbers[-1]}')


@lru_cache
def _big(numbers: str) -> tuple[struct.Struct, int]:
    return struct.Struct(f'>{numbers}'), _little(numbers)[1]


_LAYOUTS = {b'\x00\x00': _big, b'\x00\x01': _little}
_LENGTH = _little('I')[0]


@lru_cache(maxsize=256)
def _encode(text: str) -> bytes:
    """Return a text with its length and its final zero; most texts are the same at every tick."""
    body = text.encode()
    return b'%b%b\0' % (_LENGTH.pack(len(body) + 1), body)


class CdrWriter:
    """Appends the fields of one message, little endian.

    Args:
        stamp_ns: Stamp with which the message begins, nanoseconds; None where it has none.
        frame_id: Frame that completes the header, or None where the message has no header.

    >>> writer = CdrWriter(stamp_ns=5, frame_id='map')
    >>> writer.numbers('2d', 1.0, 2.0)
    >>> CdrReader(writer.raw()).numbers('2d')
    (1.0, 2.0)
    """

    def __init__(self, stamp_ns: int | None = None, frame_id: str | None = None) -> None:
        self._raw = bytearray(_LITTLE_ENDIAN)
        if stamp_ns is not None:
            self._raw += _STAMP.pack(*divmod(stamp_ns, _NS_PER_S))
        if frame_id is not None:
            self._raw += _encode(frame_id)

    def numbers(self, numbers: str, *values: float) -> None:
        """Append numbers; `struct` writes their count and kind, for example '7d'."""
        packer, size = _little(numbers)
        self._align(size)
        self._raw += packer.pack(*values)

    def zeros(self, numbers: str) -> None:
        """Append numbers that are all zero, described as in `numbers`."""
        packer, size = _little(numbers)
        self._align(size)
        self._raw += bytes(packer.size)

    def text(self, *texts: str) -> None:
        """Append texts."""
        for text in texts:
            self._align(_LENGTH.size)
            self._raw += _encode(text)

    def raw(self, data: bytes | memoryview = b'') -> bytes:
        """Return the message, with bytes appended to it as they are."""
        return b''.join((self._raw, data))

    def _align(self, size: int) -> None:
        missing = (_ORIGIN - len(self._raw)) % size
        if missing:
            self._raw += bytes(missing)


class CdrReader:
    """Reads the fields of one message in their order; its sender may use either byte order.

    Args:
        raw: The message.
        has_header: Whether it begins with a header, which is then skipped.

    Raises:
        MessageError: By every method, where the message ends too early or is not plain CDR.
    """

    def __init__(self, raw: bytes, *, has_header: bool = True) -> None:
        layout = _LAYOUTS.get(raw[:2])
        if layout is None:
            raise MessageError(f'a message of {len(raw)} bytes that is not plain CDR')
        self._raw = raw
        self._layout = layout
        self._at = _ORIGIN
        if has_header:
            self._at = _STAMP_END
            self.skip_text()

    def numbers(self, numbers: str) -> tuple[Any, ...]:
        """Return numbers of one kind, described as in `CdrWriter.numbers`."""
        packer, size = self._layout(numbers)
        at = self._at + (_ORIGIN - self._at) % size
        self._at = at + packer.size
        try:
            return packer.unpack_from(self._raw, at)
        except struct.error:
            raise self._truncated() from None

    def skip(self, numbers: str) -> None:
        """Pass over numbers of one kind."""
        self.numbers(numbers)

    def skip_text(self) -> None:
        """Pass over a text."""
        (size,) = self.numbers('I')
        self._at += size

    def count(self, least: int = 1) -> int:
        """Return the length of a sequence, of which each element takes `least` bytes or more.

        A sequence that does not fit the message is refused.
        """
        (count,) = self.numbers('I')
        if count * least > len(self._raw) - self._at:
            raise self._truncated()
        return int(count)

    def sequence(self, kind: str) -> tuple[Any, ...]:
        """Return a sequence of numbers of one kind, for example 'd'."""
        count = self.count()
        return self.numbers(f'{count}{kind}') if count else ()

    def data(self) -> memoryview:
        """Return a sequence of bytes, which shares the memory of the message."""
        size = self.count()
        self._at += size
        return memoryview(self._raw)[self._at - size : self._at]

    def text(self) -> str:
        """Return a text."""
        return self.texts(1)[0]

    def texts(self, count: int) -> list[str]:
        """Return several texts that follow one another."""
        raw, at, texts = self._raw, self._at, []
        length = self._layout('I')[0]
        try:
            for _ in range(count):
                at += -at % 4
                (size,) = length.unpack_from(raw, at)
                begin, at = at + 4, at + 4 + size
                if not size or at > len(raw):
                    raise self._truncated()
                texts.append(raw[begin : at - 1].decode())
        except struct.error:
            raise self._truncated() from None
        except UnicodeDecodeError:
            raise MessageError('a text that is not UTF-8') from None
        self._at = at
        return texts

    def _truncated(self) -> MessageError:
        return MessageError(f'a message of {len(self._raw)} bytes, which is too short')


def stamp_of(raw: bytes) -> int:
    """Return the stamp of a message that begins with one, nanoseconds.

    Raises:
        MessageError: It is too short to have one.
    """
    if len(raw) < _STAMP_END:
        raise MessageError(f'a message of {len(raw)} bytes, which is too short')
    stamp = _STAMP if raw[1] & 1 else _BIG_STAMP
    sec, nanosec = stamp.unpack_from(raw, _ORIGIN)
    return int(sec * _NS_PER_S + nanosec)


def with_stamp(raw: bytes, stamp_ns: int) -> bytes:
    """Return a little-endian message that begins with a stamp, with another stamp."""
    return b''.join((raw[:_ORIGIN], _STAMP.pack(*divmod(stamp_ns, _NS_PER_S)), raw[_STAMP_END:]))
