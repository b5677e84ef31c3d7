"""The image sensor of the MuJoCo world's camera: colour, noise, grey values."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
import math
from typing import Any

import cv2
import numpy as np

DARK_DN, SPARE = 8.0, 1 << 17  # grey value without light; noise beyond one image
WARM = (0.8, 0.95, 1.0)  # blue, green and red of a grey surface


def blur_and_shrink(tile: Any, sigma_px: float, size: int) -> Any:
    """Return a square tile of grey values blurred and shrunk to `size` rows, in parts of 255.

    It is shrunk before, too, while its blur stays four pixels wide or more: that is quicker.
    """
    coarse = 2.0 ** max(0, math.floor(math.log2(sigma_px / 4)))
    shrink = partial(cv2.resize, interpolation=cv2.INTER_AREA)
    tile = shrink(tile.astype(np.float32), [round(len(tile) / coarse)] * 2)
    return shrink(cv2.GaussianBlur(tile, (0, 0), sigma_px / coarse), [size, size]) / 255


class Sensor:
    """Makes images of exposures; its noise is drawn once, and read at a random offset."""

    def __init__(self, shape: tuple[int, ...], rng: Any) -> None:
        self.shape, self.rng = shape, rng
        self.noise = rng.normal(DARK_DN, 1, math.prod(shape) + SPARE).astype(np.float32)

    def expose(self, film: Sequence[Any]) -> Any:
        """Return the image of the mean of some exposures, as (rows, columns) or with colours."""
        light = np.mean(film, axis=0)
        if len(self.shape) > light.ndim:
            light = cv2.merge([light * share for share in WARM])
        noise = self.noise[self.rng.integers(SPARE) :][: light.size].reshape(self.shape)
        return cv2.add(light, noise, dtype=cv2.CV_8U)  # rounded and saturated
