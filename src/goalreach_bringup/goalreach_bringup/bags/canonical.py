"""Serialized messages without chance in them.

Between the fields of a CDR message there are bytes that only align what follows. DDS leaves in
them whatever the memory held, so the same message is not the same bytes twice.
"""

from __future__ import annotations

from typing import Final

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

__all__ = ['Canonical']

_ALIGNMENT: Final = 4
"""A message may end with bytes that bring its length to a multiple of this."""


class Canonical:
    """Zeroes the bytes between fields."""

    def __init__(self) -> None:
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)

    def bytes_of(self, type_name: str, data: bytes) -> bytes:
        """Return a message with zeros between its fields; unchanged where that cannot be done.

        Args:
            type_name: `package/msg/Name`.
            data: The message.
        """
        if type_name not in self._store.fielddefs:
            return data
        try:
            message = self._store.deserialize_cdr(data, type_name)
            result = bytes(self._store.serialize_cdr(message, type_name))
        except Exception:  # noqa: BLE001 - whatever bad bytes lead to: they are kept
            return data
        missing = len(data) - len(result)
        return result + bytes(missing) if 0 <= missing < _ALIGNMENT else data
