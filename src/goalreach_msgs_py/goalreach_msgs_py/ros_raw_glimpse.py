"""What a node said lately, message by message, in one message: std_msgs/UInt8MultiArray.

Each dimension of its layout is a message: the label is the topic, the size is that of the message
among the data, and the stride is the message's number, by which one sees how many there were. A
message of no bytes is told, not shown.
"""

from __future__ import annotations

from collections.abc import Sequence
import struct

from goalreach_msgs_py.cdr import LITTLE_ENDIAN, pack_text
from goalreach_msgs_py.ros_common_messages import MessageError

__all__ = ['Glimpsed', 'glimpse_from_raw', 'glimpse_to_raw']

Glimpsed = tuple[str, int, bytes]
"""Topic, number and bytes of a message."""

_COUNT = struct.Struct('<I')
_PAIR = struct.Struct('<2I')
_NO_OFFSET = 0
_NUMBERS = 1 << 32


def glimpse_to_raw(messages: Sequence[Glimpsed]) -> bytes:
    """Return messages in one."""
    parts = [LITTLE_ENDIAN, _COUNT.pack(len(messages))]
    labels: dict[str, bytes] = {}
    for topic, number, message in messages:
        label = labels.get(topic) or labels.setdefault(topic, pack_text(topic))
        parts += (label, _PAIR.pack(len(message), number % _NUMBERS))
    size = sum(len(message) for _, _, message in messages)
    parts.append(_PAIR.pack(_NO_OFFSET, size))
    parts += (message for _, _, message in messages)
    return b''.join(parts)


def glimpse_from_raw(raw: bytes) -> list[Glimpsed]:
    """Return the messages that one holds, as they were sent.

    Raises:
        MessageError: It is not as `glimpse_to_raw` makes it.
    """
    try:
        return _read(raw)
    except (ValueError, struct.error) as error:
        raise MessageError(f'not a glimpse: {error}') from None


def _read(raw: bytes) -> list[Glimpsed]:
    if not raw.startswith(LITTLE_ENDIAN):
        raise ValueError('another byte order')
    (count,) = _COUNT.unpack_from(raw, len(LITTLE_ENDIAN))
    at = len(LITTLE_ENDIAN) + _COUNT.size
    heads: list[tuple[str, int, int]] = []
    for _ in range(count):
        (length,) = _COUNT.unpack_from(raw, at)
        at += _COUNT.size
        topic = raw[at : at + length - 1].decode()
        at += (length + 3) // 4 * 4
        heads.append((topic, *_PAIR.unpack_from(raw, at)))
        at += _PAIR.size
    at += _PAIR.size
    if at + sum(size for _, size, _ in heads) > len(raw):
        raise ValueError('cut off')
    messages: list[Glimpsed] = []
    for topic, size, number in heads:
        messages.append((topic, number, raw[at : at + size]))
        at += size
    return messages
