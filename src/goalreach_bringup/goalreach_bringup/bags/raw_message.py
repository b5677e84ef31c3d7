"""What can be read from a serialized message without knowing its type."""

from __future__ import annotations

from typing import Any, Final

from goalreach_msgs_py import cdr

__all__ = ['begins_with_stamp', 'stamp_of']

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
    stamp_ns = cdr.stamp_of(data)
    if stamp_ns is None:
        raise ValueError('too short for a stamp')
    return stamp_ns
