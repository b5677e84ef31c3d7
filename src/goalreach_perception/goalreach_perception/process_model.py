"""The filter's process model: odometry moves the pose, constants fade towards their prior."""

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.measurement_model import DRIFT, HEADING, HEIGHT, SCALE


class OdometryModel:
    """Propagates pose and covariance by the odometry, corrected by its estimated errors.

    A rotation or a change of scale of the whole map about the origin shifts a position in
    proportion to its distance from there. To preserve that, the derivatives by heading and scale
    use the displacement between predicted positions, corrections included.

    Args:
        size: Length of the state vector.
    """

    def __init__(self, size: int) -> None:
        self._transition = np.eye(size)
        self._predicted_m = (0.0, 0.0)

    def restart(self, x_m: float, y_m: float) -> None:
        """Set the predicted position, metres in `map`."""
        self._predicted_m = (x_m, y_m)

    def propagate_mean(self, mean: FloatArray, before: Pose2, after: Pose2) -> float:
        """Move the mean in place.

        Args:
            mean: The state vector.
            before: Odometry pose at the last image.
            after: Odometry pose now, in the same frame.

        Returns:
            The distance by odometry, metres.
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

    def propagate_covariance(self, covariance: FloatArray) -> FloatArray:
        """Return the covariance after the last motion, without process noise."""
        pose = self._transition[:3]
        moved = pose.dot(covariance)
        propagated = covariance.copy()
        propagated[:3] = moved
        propagated[:, :3] = moved.T
        propagated[:3, :3] = moved.dot(pose.T)
        return propagated


class FadingMemory:
    """Models constants as Ornstein-Uhlenbeck processes around their prior.

    With a = exp(-dt / memory), the mean m becomes m0 + a (m - m0) and the covariance P becomes
    a^2 P + (1 - a^2) P0. Errors that repeat from image to image then do not accumulate into false
    certainty, and no estimate drifts without bound.

    Args:
        mean: (n,) prior mean.
        sigmas: (n,) prior standard deviations.
        fading: (n,) whether each state fades.
        memory_s: Time constant.
    """

    def __init__(
        self, mean: FloatArray, sigmas: FloatArray, fading: NDArray[np.bool_], memory_s: float
    ) -> None:
        self._mean = mean.copy()
        self._variance = sigmas**2
        self._fading = fading
        self._memory_s = memory_s

    def fade(
        self, mean: FloatArray, covariance: FloatArray, dt_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance after some time; an infinite time restores the prior."""
        keep = np.where(self._fading, math.exp(-dt_s / self._memory_s), 1.0)
        gained = np.diag((1.0 - keep * keep) * self._variance)
        return self._mean + keep * (mean - self._mean), np.outer(keep, keep) * covariance + gained
