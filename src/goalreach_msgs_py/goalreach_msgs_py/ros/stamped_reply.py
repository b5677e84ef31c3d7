"""How every node of the graph answers a stamp."""

from __future__ import annotations

from typing import Any

from rclpy.publisher import Publisher

from goalreach_msgs_py.ros.throttled import Glimpse


class Outbox:
    """Publishes the answer to one stamp and can repeat it.

    A simulator in lockstep that hears nothing sends its last tick again; the answer then is
    repeated, not computed anew, so a lost message costs time and nothing else.

    Args:
        glimpse: Shows the answers to those who look on.
    """

    def __init__(self, glimpse: Glimpse) -> None:
        """Start with nothing sent."""
        self._glimpse = glimpse
        self._stamp_ns: int | None = None
        self._sent: list[tuple[Publisher[Any], object]] = []

    def open(self, stamp_ns: int) -> bool:
        """Begin the answer to a stamp; return False where it was only to be repeated."""
        if stamp_ns == self._stamp_ns:
            for publisher, message in self._sent:
                publisher.publish(message)
            return False
        self._stamp_ns = stamp_ns
        self._sent.clear()
        return True

    def send(self, publisher: Publisher[Any], message: object) -> None:
        """Publish a message as part of the answer."""
        self._sent.append((publisher, message))
        publisher.publish(message)

    def close(self) -> None:
        """End the answer to a stamp."""
        self._glimpse.look(self._sent)
