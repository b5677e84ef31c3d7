"""How odometry moves the state vector, and the derivative of that."""

from __future__ import annotations

import math

import numpy as np

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.measurement_model import DRIFT, HEADING, HEIGHT, SCALE

__all__ = ['OdometryMotion']


class OdometryMotion:
    """Moves the pose by what the encoders counted, corrected by their believed errors.

    A turn of all that is known, or a change of its size, about the origin shifts a position by
    what it is away from there. For it to remain such a change, the derivatives by heading and
    scale look at the way between positions as they were predicted, corrections included.

    Args:
        size: Length of the state vector.
    """

    def __init__(self, size: int) -> None:
        self._transition = np.eye(size)
        self._predicted_m = (0.0, 0.0)

    def begin_at(self, x_m: float, y_m: float) -> None:
        """Take a position as predicted."""
        self._predicted_m = (x_m, y_m)

    def move(self, mean: FloatArray, before: Pose2, after: Pose2) -> float:
        """Move the mean in its place.

        Args:
            mean: The state vector.
            before: Odometry pose at the last image.
            after: Odometry pose now, in the same frame.

        Returns:
            The distance that odometry counted, metres.
        """
        dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
        turn = angle_difference(after.heading_rad, before.heading_rad)
        distance = math.hypot(dx, dy)
        x_m, y_m, heading, _, _, scale, drift = mean[:HEIGHT].tolist()
        between = heading - before.heading_rad + 0.5 * drift * distance
        cosine, sine = math.cos(between), math.sin(between)
        east, north = cosine * dx - sine * dy, sine * dx + cosine * dy
        x_m, y_m = x_m + (1.0 + scale) * east, y_m + (1.0 + scale) * north
        mean[:3] = x_m, y_m, wrap_angle(heading + turn + drift * distance)
        matrix = self._transition
        matrix[0, DRIFT], matrix[1, DRIFT] = -0.5 * distance * north, 0.5 * distance * east
        matrix[2, DRIFT] = distance
        east, north = x_m - self._predicted_m[0], y_m - self._predicted_m[1]
        matrix[0, HEADING], matrix[1, HEADING] = -north, east
        matrix[0, SCALE], matrix[1, SCALE] = east, north
        self._predicted_m = (x_m, y_m)
        return distance

    def carry(self, covariance: FloatArray) -> FloatArray:
        """Return a covariance after the last move: only the pose has moved."""
        pose = self._transition[:3]
        moved = pose.dot(covariance)
        carried = covariance.copy()
        carried[:3] = moved
        carried[:, :3] = moved.T
        carried[:3, :3] = moved.dot(pose.T)
        return carried
