"""Writing `metadata.yaml`, the file that makes a directory a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import yaml

from goalreach_bringup.bags.metadata import BagMetadata
from goalreach_msgs_py.atomic_file import write_text_atomically

__all__ = ['METADATA_NAME', 'metadata_text', 'write_metadata']

METADATA_NAME: Final = 'metadata.yaml'
_ROOT: Final = 'rosbag2_bagfile_information'


def metadata_text(metadata: BagMetadata) -> str:
    """Return the summary as the YAML text that is kept inside a storage file too."""
    return str(yaml.safe_dump(metadata.to_document(), sort_keys=False))


def write_metadata(directory: Path, metadata: BagMetadata) -> None:
    """Write the summary beside the storage files.

    Raises:
        FileFormatError: It cannot be written.
    """
    document = {_ROOT: metadata.to_document()}
    write_text_atomically(directory / METADATA_NAME, yaml.safe_dump(document, sort_keys=False))
