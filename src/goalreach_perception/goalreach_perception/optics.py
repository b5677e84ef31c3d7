"""Between the pixels of a real lens and those of the ideal one that the model computes."""

from __future__ import annotations

import cv2
import numpy as np

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import Lens

__all__ = ['Optics']


class Optics:
    """One camera's lens with its distortion, prepared once.

    Args:
        camera: The camera as its CameraInfo describes it.

    Attributes:
        camera: The same.
        lens: Its ideal part.
    """

    def __init__(self, camera: PinholeCamera) -> None:
        self.camera = camera
        self.lens = Lens.of_camera(camera)
        self._distorted = any(camera.distortion)

    def to_ideal(self, pixels_px: FloatArray) -> FloatArray:
        """Return the (n, 2) pixels an ideal lens would have shown."""
        if not self._distorted or len(pixels_px) == 0:
            return pixels_px
        fx, fy = self.lens.focal_px
        cx, cy = self.lens.centre_px
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        points = pixels_px.reshape(-1, 1, 2)
        coefficients = np.array(self.camera.distortion)
        ideal = cv2.undistortPoints(points, matrix, coefficients, P=matrix)
        return ideal.reshape(-1, 2).astype(np.float64)

    def to_raw(self, pixels_px: FloatArray) -> FloatArray:
        """Return the (n, 2) pixels at which this lens shows ideal ones."""
        if not self._distorted:
            return pixels_px
        rays = np.ones((len(pixels_px), 3))
        rays[:, :2] = (pixels_px - self.lens.centre_px) / self.lens.focal_px
        return self.camera.project(rays)
