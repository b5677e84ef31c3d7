"""The paper's inches and the host language's tenths, beside SI."""

from __future__ import annotations

import math

__all__ = ['INCH_M', 'deg', 'inches']

INCH_M = 0.0254
"""One inch in metres (exact by definition)."""


def inches(value_in: float) -> float:
    """Return a length given in inches as metres.

    >>> inches(140)
    3.556
    """
    return round(value_in * INCH_M, 12)


def deg(value_deg: float) -> float:
    """Return an angle given in degrees as radians."""
    return math.radians(value_deg)
