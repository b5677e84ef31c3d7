"""The filter's process model: odometry moves the pose, constants fade towards their prior."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference, deg, wrap_angle
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.measurement_model import DRIFT, HEADING, HEIGHT, LEVEL, SCALE, SLIP

_GROWN = 1.05
"""A smaller growth of variances is none. Chosen."""


@dataclass(frozen=True, kw_only=True)
class FilterConfig(Configuration):
    """Process noise and gates of the filter."""

    slip_m_per_sqrt_m: float = parameter(
        0.0002,
        'Random part of the odometry, m per square root of a metre (1 sigma; chosen: small beside '
        'the errors of scale and drift, which are states; with five times as much the covariance '
        'was a tenth too large)',
        within=(0.0, 1.0),
    )
    heading_walk_rad_per_sqrt_m: float = parameter(
        deg(0.004),
        'Random part of the heading, rad per square root of a metre (1 sigma; chosen as above)',
        within=(0.0, 1.0),
    )
    heading_walk_rad_per_sqrt_rad: float = parameter(
        0.0,
        'Random part of the heading, rad per square root of a radian turned (1 sigma; none for a '
        'synchro drive; 0.01 where two wheels turn the base, for radii wrong by 0.5 %)',
        within=(0.0, 1.0),
    )
    slip_sigma_s: float = parameter(
        0.005,
        'Sideways slip: speed across the wheels over speed times turning rate, s (1 sigma; '
        'chosen: 5 mm/s in a bend of 1 m/s^2)',
        within=(0.0, 1.0),
    )
    delay_sigma_s: float = parameter(
        0.075,
        'Error of camera_delay_s where images, odometry and joints have stamps of their own, s (1 '
        'sigma; chosen: webcams are 0 to 0.15 s late); 0: none, it is not estimated',
        within=(0.0, 1.0),
    )
    mount_sigma_m: float = parameter(
        0.002, 'Error of the place of the lens on the head, m (1 sigma; chosen)', within=(0.0, 1.0)
    )
    level_sigma_rad: float = parameter(
        0.0015,
        'Error of the level of the base about either horizontal axis, rad (1 sigma; chosen: radii '
        'of wheels wrong by 0.5 %, or a floor by 1.5 mm in 1 m)',
        within=(0.0, 0.2),
    )
    memory_s: float = parameter(
        3000.0,
        'Time constant with which biases and calibration return to their prior, and with '
        'calibrate a covariance that grew, s (chosen: small errors that repeat from image to '
        'image then do not cause false certainty; after a minute the covariance is larger than '
        'the errors, and after a day too small beside an LED)',
        within=(1.0, 1e9),
    )
    led_gate: float = parameter(
        16.0, 'Largest squared distance of one LED from its prediction, 2 dof', within=(1.0, None)
    )
    joint_gate: float = parameter(
        32.0,
        'Largest squared distance of all LEDs of an image together (p = 2e-5)',
        within=(1.0, None),
    )

    def sigmas_after_landmarks(self, *, delay: bool) -> list[float]:
        """Return the standard deviations of the states after the landmarks."""
        sigmas = [*[self.mount_sigma_m] * 2, self.slip_sigma_s, *[self.level_sigma_rad] * 2]
        return [self.delay_sigma_s, *sigmas] if delay else sigmas


@dataclass(frozen=True, kw_only=True)
class OdometryConfig(Configuration):
    """What is known of the errors of the odometry."""

    scale: float = parameter(1.0, 'Distance driven over that of odom', within=(0.1, 10.0))
    turn_scale: float = parameter(1.0, 'Angle turned over that of odom', within=(0.1, 10.0))
    drift_rad_per_m: float = parameter(
        0.0, 'Turn of the base while it drives that odom lacks, rad/m', within=(-1.0, 1.0)
    )


class OdometryModel:
    """Propagates pose and covariance by the odometry, corrected by its estimated errors.

    A rotation or a change of scale of the whole map about the origin shifts a position in
    proportion to its distance from there. To preserve that, the derivatives by heading and scale
    use the displacement between predicted positions, corrections included.

    The level is that of the base: in `map` it turns with a base that turns.
    """

    def __init__(
        self, size: int, config: OdometryConfig | None = None, *, base_turns: bool = False
    ) -> None:
        self._config, self._base_turns = config or OdometryConfig(), base_turns
        self._transition = np.eye(size)
        self._predicted_m = (0.0, 0.0)

    def set_known_errors(self, mean: FloatArray) -> None:
        """Set scale and drift of a state vector to those that are known."""
        mean[SCALE], mean[DRIFT] = self._config.scale - 1.0, self._config.drift_rad_per_m

    def restart(self, x_m: float, y_m: float) -> None:
        """Set the predicted position, metres in `map`."""
        self._predicted_m = (x_m, y_m)

    def propagate_mean(
        self, mean: FloatArray, before: Pose2, after: Pose2, dt_s: float = math.inf
    ) -> tuple[float, float]:
        """Move the mean in place; return the distance by odometry, metres, and the turn, radians.

        Odometry poses are those at the last image and now; in the time between them wheels slip
        outward by their speed times the turn.
        """
        dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
        read = angle_difference(after.heading_rad, before.heading_rad)
        turn = self._config.turn_scale * read
        distance = math.hypot(dx, dy)
        x_m, y_m, heading, _, _, scale, drift = mean[:HEIGHT].tolist()
        between = heading - before.heading_rad + 0.5 * (turn - read + drift * distance)
        cosine, sine = math.cos(between), math.sin(between)
        east, north = cosine * dx - sine * dy, sine * dx + cosine * dy
        bend, slip = turn / dt_s, float(mean[SLIP])
        x_m += (1.0 + scale) * east + slip * bend * north
        y_m += (1.0 + scale) * north - slip * bend * east
        mean[:3] = x_m, y_m, wrap_angle(heading + turn + drift * distance)
        matrix = self._transition
        matrix[0, DRIFT], matrix[1, DRIFT] = -0.5 * distance * north, 0.5 * distance * east
        matrix[2, DRIFT] = distance
        matrix[0, SLIP], matrix[1, SLIP] = bend * north, -bend * east
        east, north = x_m - self._predicted_m[0], y_m - self._predicted_m[1]
        matrix[0, HEADING], matrix[1, HEADING] = -north, east
        matrix[0, SCALE], matrix[1, SCALE] = east, north
        self._predicted_m = (x_m, y_m)
        if self._base_turns:
            cosine, sine = math.cos(turn), math.sin(turn)
            matrix[LEVEL:, LEVEL:] = [[cosine, -sine], [sine, cosine]]
            mean[LEVEL:] = matrix[LEVEL:, LEVEL:].dot(mean[LEVEL:])
        return distance, turn

    def propagate_covariance(self, covariance: FloatArray) -> FloatArray:
        """Return the covariance after the last motion, without process noise."""
        if self._base_turns:
            turned: FloatArray = self._transition.dot(covariance).dot(self._transition.T)
            return turned
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
    a^2 P + (1 - a^2) P0, for the states that fade. Errors that repeat from image to image then do
    not accumulate into false certainty, and no estimate drifts without bound. Where all constants
    fade, so does the growth of P0.

    Attributes:
        growth: Factor on the given prior variances, where the model did not fit; else 1.
    """

    def __init__(
        self, mean: FloatArray, prior: FloatArray, fading: NDArray[np.bool_], memory_s: float
    ) -> None:
        self._mean = mean.copy()
        self._given = prior.copy()
        self._fading = fading
        self._recovers = bool(fading[prior.diagonal() > 0.0].all())
        self._memory_s = memory_s
        self.growth = 1.0

    def fade(
        self, mean: FloatArray, covariance: FloatArray, dt_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance after some time; an infinite time restores the prior."""
        fraction = math.exp(-dt_s / self._memory_s)
        if fraction > 0.0 and self._recovers:
            growth = 1.0 + fraction * (self.growth - 1.0)
            self.growth = growth if growth > _GROWN else 1.0
        keep = np.where(self._fading, fraction, 1.0)
        kept = np.outer(keep, keep)
        gained = (1.0 - kept) * (self.growth * self._given)
        return self._mean + keep * (mean - self._mean), kept * covariance + gained
