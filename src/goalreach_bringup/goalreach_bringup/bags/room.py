"""Room on the disk, looked at before it is needed: a bag must still be closed when it is gone."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

__all__ = ['require_room']

_MARGIN_BYTES: Final = 256 * 1024
"""Left for summary and metadata, and for others who write. Chosen."""


def require_room(path: Path, needed: int) -> None:
    """Look whether a file can grow.

    Args:
        path: The file.
        needed: By how many bytes.

    Raises:
        OSError: ENOSPC, before anything was written.
    """
    status = os.statvfs(path.parent)
    if status.f_bavail * status.f_frsize < needed + _MARGIN_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
