"""What can be read from a serialized message without knowing its type."""

from __future__ import annotations

import struct
from typing import Any, Final

__all__ = ['begins_with_stamp', 'stamp_of']

_ENCAPSULATION: Final = 4
_STAMP: Final = 8
_NS_PER_S: Final = 1_000_000_000
_CLOCK: Final = 'rosgraph_msgs/msg/Clock'


def begins_with_stamp(type_name: str, message_class: Any) -> bool:  # noqa: ANN401 - generated
    """Return whether a type begins with a header, or is the clock.

    Log and ParameterEvent begin with a time too, but one of the wall clock.

    Args:
        type_name: `package/msg/Name`.
        message_class: Its Python class.
    """
    fields = list(message_class.get_fields_and_field_types().values())
    return type_name == _CLOCK or (bool(fields) and fields[0] == 'std_msgs/Header')


def stamp_of(data: bytes) -> int:
    """Return the stamp at the beginning of a CDR message, nanoseconds.

    Raises:
        ValueError: The message is too short.
    """
    if len(data) < _ENCAPSULATION + _STAMP:
        raise ValueError('too short for a stamp')
    form = '<iI' if data[1] & 1 else '>iI'
    seconds, nanoseconds = struct.unpack_from(form, data, _ENCAPSULATION)
    return int(seconds) * _NS_PER_S + int(nanoseconds)
