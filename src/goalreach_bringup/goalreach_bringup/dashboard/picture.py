"""Camera images for a browser."""

from __future__ import annotations

import base64

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ['data_url']

_QUALITY = 70


def data_url(image: NDArray[np.uint8]) -> str:
    """Return a grey image as a `data:` URL that holds it as JPEG.

    Args:
        image: (height, width), grey values.
    """
    _, encoded = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return 'data:image/jpeg;base64,' + base64.b64encode(encoded.tobytes()).decode('ascii')
