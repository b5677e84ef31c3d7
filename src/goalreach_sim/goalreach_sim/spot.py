"""A point of light on the sensor: a Gaussian integrated over each pixel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray

__all__ = ['add_light', 'pixel_shares', 'spot_window']

_DARK_DN = 0.05
"""Where a spot is fainter than this it is cut off; a tenth of rounding, chosen."""

_FULL_DN = 255.0
_SQRT2 = math.sqrt(2.0)


def pixel_shares(centre_px: float, sigma_px: float, first: int, last: int) -> FloatArray:
    """Return the share of a one-dimensional Gaussian that falls on each pixel.

    Args:
        centre_px: Its centre; pixel i reaches from i - 0.5 to i + 0.5.
        sigma_px: Its standard deviation.
        first: First pixel.
        last: Pixel after the last.

    Returns:
        (last - first,) shares, their sum at most one.
    """
    scale = 1.0 / (sigma_px * _SQRT2)
    edge_px, erf = centre_px + 0.5, math.erf
    values = np.array([0.5 * erf((i - edge_px) * scale) for i in range(first, last + 1)])
    shares: FloatArray = values[1:] - values[:-1]
    return shares


def spot_window(
    u_px: float, v_px: float, sigma_px: float, flux_dn: float, shape: tuple[int, int]
) -> tuple[slice, slice]:
    """Return the rows and columns of an image that a spot reaches; empty where there are none.

    Args:
        u_px: Centre, column.
        v_px: Centre, row.
        sigma_px: Standard deviation.
        flux_dn: Sum of its grey values.
        shape: Rows and columns of the image.
    """
    peak_dn = flux_dn / (2.0 * math.pi * sigma_px * sigma_px)
    if peak_dn <= _DARK_DN:
        return slice(0, 0), slice(0, 0)
    reach_px = sigma_px * math.sqrt(2.0 * math.log(peak_dn / _DARK_DN)) + 1.0
    rows = slice(
        max(math.floor(v_px - reach_px), 0), min(math.ceil(v_px + reach_px) + 1, shape[0])
    )
    columns = slice(
        max(math.floor(u_px - reach_px), 0), min(math.ceil(u_px + reach_px) + 1, shape[1])
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return slice(0, 0), slice(0, 0)
    return rows, columns


def add_light(window: NDArray[np.uint8], light_dn: FloatArray) -> None:
    """Add light to a part of an image in place; it rounds, and saturates at 255."""
    light_dn += window
    np.rint(light_dn, out=light_dn)
    np.maximum(light_dn, 0.0, out=light_dn)  # np.clip costs several times as much as these two
    np.minimum(light_dn, _FULL_DN, out=light_dn)
    window[...] = light_dn
