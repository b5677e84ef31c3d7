"""What a gate between two nodes does to the messages that pass it."""

from __future__ import annotations

import struct

import numpy as np

_ENCAPSULATION = 4
_NS_PER_S = 1_000_000_000


class Gate:
    """Lets serialized messages pass, or does something to them.

    Args:
        rng: Which messages are lost.

    Attributes:
        effect: 'late', 'lost', 'twice', 'order', 'shift', or empty: they pass as they are.
        amount: Delay in seconds, share that is lost, or shift of the stamps in seconds.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._held: bytes | None = None
        self.effect = ''
        self.amount = 0.0

    def set(self, effect: str, amount: float) -> None:
        """Begin an effect, or end it with an empty text."""
        self.effect, self.amount = effect, amount
        self._held = None

    def arrive(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Return which messages are to go on, and when, for one that arrived.

        Args:
            data: The message as it was serialized.
            now_s: The time now, seconds of any clock.
        """
        match self.effect:
            case 'late':
                return [(now_s + self.amount, data)]
            case 'lost':
                return [] if self._rng.random() < self.amount else [(now_s, data)]
            case 'twice':
                return [(now_s, data), (now_s, data)]
            case 'order':
                held, self._held = self._held, None if self._held is not None else data
                return [] if held is None else [(now_s, data), (now_s, held)]
            case 'shift':
                return [(now_s, shift_stamp(data, self.amount))]
        return [(now_s, data)]


def shift_stamp(data: bytes, shift_s: float) -> bytes:
    """Return a serialized message with the stamp of its header changed; not below zero.

    Args:
        data: CDR of a message that begins with a header or a time.
        shift_s: By how many seconds.
    """
    order = '<' if data[1] & 1 else '>'
    sec, nanosec = struct.unpack_from(f'{order}iI', data, _ENCAPSULATION)
    stamp_ns = max(0, sec * _NS_PER_S + nanosec + round(shift_s * _NS_PER_S))
    changed = bytearray(data)
    struct.pack_into(
        f'{order}iI', changed, _ENCAPSULATION, stamp_ns // _NS_PER_S, stamp_ns % _NS_PER_S
    )
    return bytes(changed)
