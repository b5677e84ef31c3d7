"""Replies of a node to the stamp of its input, with retransmission."""

from __future__ import annotations

from typing import Any

from rclpy.publisher import Publisher


class StampedReply:
    """Publishes a node's reply to one stamp and can retransmit it.

    A simulator in lockstep that receives no answer sends its last tick again; the reply is then
    retransmitted, not computed anew, so a lost message costs time only.
    """

    def __init__(self) -> None:
        """Start with an empty reply."""
        self._stamp_ns: int | None = None
        self._sent: list[tuple[Publisher[Any], object]] = []

    def begin(self, stamp_ns: int) -> bool:
        """Begin the reply to a stamp.

        Args:
            stamp_ns: Stamp of the input, nanoseconds.

        Returns:
            True where the reply is to be computed; False where the stamp is that of the last
            reply, which has been retransmitted.
        """
        if stamp_ns == self._stamp_ns:
            for publisher, message in self._sent:
                publisher.publish(message)
            return False
        self._stamp_ns = stamp_ns
        self._sent.clear()
        return True

    def send(self, publisher: Publisher[Any], message: object) -> None:
        """Publish a message as part of the reply."""
        self._sent.append((publisher, message))
        publisher.publish(message)
