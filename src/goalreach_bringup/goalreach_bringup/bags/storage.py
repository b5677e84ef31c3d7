"""What the two storage formats have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from goalreach_bringup.bags.topic import BagTopic

__all__ = ['STORAGES', 'StorageFile', 'StorageOptions']

STORAGES: Final = ('mcap', 'sqlite3')


@dataclass(frozen=True, kw_only=True)
class StorageOptions:
    """How a bag is kept.

    Attributes:
        storage: 'mcap' or 'sqlite3'.
        zstd: Whether to compress: MCAP by the chunk, SQLite by the message, as rosbag2 does.
        max_bytes: Size at which a new file is begun, or None.
        max_duration_ns: Time after which a new file is begun, or None.
    """

    storage: str = 'mcap'
    zstd: bool = False
    max_bytes: int | None = None
    max_duration_ns: int | None = None


class StorageFile(Protocol):
    """One file of a bag being written.

    What has been flushed survives the death of the process. Every method may raise OSError; the
    file then still ends after what was flushed before.
    """

    @property
    def size(self) -> int:
        """Bytes so far, those in memory included."""
        ...

    @property
    def wants_flush(self) -> bool:
        """Whether so much is pending that it should be flushed."""
        ...

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add a topic before its first message."""
        ...

    def write(self, number: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message."""
        ...

    def flush(self) -> None:
        """Hand what is pending to the operating system."""
        ...

    def drop_pending(self) -> None:
        """Forget what is pending: there is no room for it."""
        ...

    def finish(self, metadata: str) -> None:
        """Flush, add the bag's summary, and close."""
        ...

    def close(self) -> None:
        """Close without a summary."""
        ...
