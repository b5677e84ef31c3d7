"""Points of light in an image, and what counts as one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.values import FloatArray

__all__ = ['DetectionConfig', 'Spots']


@dataclass(frozen=True, kw_only=True)
class DetectionConfig:
    """What counts as an LED in an image."""

    minimum_peak_dn: float = parameter(
        20.0,
        'Least peak of a spot above the background, grey values (chosen)',
        minimum=3.0,
        maximum=255.0,
    )
    centroid_sigma_px: float = parameter(
        0.025,
        'Error of a bright spot per axis, px (1 sigma): sampling and saturation (measured while '
        'driving: 0.008 to 0.010; chosen larger, since it repeats from image to image: with 0.010 '
        'a filter that calibrates itself is overconfident after ten minutes)',
        minimum=0.001,
        maximum=5.0,
    )
    maximum_spots: int = parameter(
        5, 'Most spots looked at in a whole frame (chosen)', minimum=2, maximum=8
    )
    window_half_px: int = parameter(
        20, 'Smallest half-width of a tracking window, px (chosen)', minimum=8, maximum=100
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)


class Spots(NamedTuple):
    """Points of light in one image.

    Attributes:
        pixels_px: (n, 2) centres (u, v); pixel (0, 0) is the top-left pixel's centre.
        sigmas_px: (n,) standard deviation of the centre, per axis.
        peaks_dn: Greatest grey value of each.
        lit: Whether there is light at all.
        good: Whether it looks like an LED seen through this lens.
    """

    pixels_px: FloatArray
    sigmas_px: FloatArray
    peaks_dn: list[int]
    lit: list[bool]
    good: list[bool]

    def pick(self, rows: list[int]) -> Spots:
        """Return some of the spots."""
        if rows == list(range(len(self.peaks_dn))):
            return self
        return Spots(
            self.pixels_px[rows],
            self.sigmas_px[rows],
            [self.peaks_dn[row] for row in rows],
            [self.lit[row] for row in rows],
            [self.good[row] for row in rows],
        )

    def followed_by(self, other: Spots) -> Spots:
        """Return these spots and then the others."""
        return Spots(
            np.concatenate([self.pixels_px, other.pixels_px]),
            np.concatenate([self.sigmas_px, other.sigmas_px]),
            self.peaks_dn + other.peaks_dn,
            self.lit + other.lit,
            self.good + other.good,
        )
