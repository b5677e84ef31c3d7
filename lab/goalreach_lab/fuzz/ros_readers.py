"""Every reader of ours."""

from __future__ import annotations

from pathlib import Path

from goalreach_lab.fuzz.configurations import configuration_readers
from goalreach_lab.fuzz.reader import Reader
from goalreach_lab.fuzz.ros_messages import message_readers
from goalreach_lab.fuzz.sound_file import bag_readers, document_readers


def all_readers(folder: Path) -> list[Reader]:
    """Return every reader.

    Args:
        folder: Where bad files are written.
    """
    return [
        *document_readers(folder),
        *bag_readers(folder),
        *configuration_readers(),
        *message_readers(),
    ]
