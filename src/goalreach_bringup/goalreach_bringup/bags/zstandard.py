"""Zstandard: in the standard library from Python 3.14 on, a package of its own before."""

from __future__ import annotations

import importlib
import sys
from typing import Any, Final

__all__ = ['compress', 'decompress']

_NAME: Final = 'compression.zstd' if sys.version_info >= (3, 14) else 'backports.zstd'
_zstd: Final[Any] = importlib.import_module(_NAME)
_LEVEL: Final = 1
"""Chosen: a camera's noise does not shrink much more at higher levels, which cost far more."""


def compress(data: bytes) -> bytes:
    """Return the data compressed."""
    return bytes(_zstd.compress(data, level=_LEVEL))


def decompress(data: bytes) -> bytes:
    """Return compressed data as it was.

    Raises:
        ValueError: It is no Zstandard frame.
    """
    try:
        return bytes(_zstd.decompress(data))
    except (_zstd.ZstdError, EOFError) as error:
        raise ValueError(str(error)) from None
