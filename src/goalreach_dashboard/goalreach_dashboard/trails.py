"""Where the robot is, was, and believes it is: what the arena's picture is drawn from."""

from __future__ import annotations

from collections import OrderedDict
import math
from typing import Final

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import HeadAngles, Pose2, PoseEstimate

_SPACING_M: Final = 0.02
_TRAIL_POINTS: Final = 3000
_STAMPS: Final = 256
_FASTEST_M_PER_S: Final = 2.0
_SLACK_M: Final = 0.1
_NS: Final = 1e-9


class Trail:
    """A path as the text of an SVG polyline, in centimetres, y downward.

    Attributes:
        text: The `points` attribute; it only ever grows, until the trail is cleared or too long.
    """

    def __init__(self, length_m: float) -> None:
        """Start with nothing.

        Args:
            length_m: Length of the arena along y: the picture's y is measured from the far wall.
        """
        self._length_m = length_m
        self.clear()

    def clear(self) -> None:
        """Forget the path."""
        self.text = ''
        self._count = 0
        self._last: tuple[float, float] | None = None

    def add(self, x_m: float, y_m: float) -> None:
        """Add a point 2 cm from the last; a trail of 3000 points loses its older half."""
        if self._last is not None and math.dist(self._last, (x_m, y_m)) < _SPACING_M:
            return
        self._last = (x_m, y_m)
        self.text += f'{100.0 * x_m:.1f},{100.0 * (self._length_m - y_m):.1f} '
        self._count += 1
        if self._count >= _TRAIL_POINTS:
            kept = self.text.split()[self._count // 2 :]
            self.text = ' '.join(kept) + ' '
            self._count = len(kept)


class RobotPicture:
    """Truth, estimate and odometry, joined by their stamps.

    Odometry is drawn in `map` as if it had been right where the path began.

    Args:
        length_m: Length of the arena along y.

    Attributes:
        truth: True pose, or None.
        truth_ns: Its stamp.
        estimate: Estimated pose, or None.
        estimate_ns: Its stamp.
        compared: True pose of the estimate's stamp, or None where it was not heard.
        error_m: Distance of the estimate from the truth of the same stamp, or None.
        error_rad: The same of the heading.
        odometry: Pose by the encoders, laid into `map`, or None.
        head: Joint angles, or None.
        bumpers: Pressed sensors (20,).
        trail: True path since the robot was placed.
        estimate_trail: Estimated path since then.
    """

    def __init__(self, length_m: float) -> None:
        """Know nothing yet."""
        self.truth: Pose2 | None = None
        self.truth_ns = 0
        self.estimate: PoseEstimate | None = None
        self.estimate_ns = 0
        self.compared: Pose2 | None = None
        self.error_m: float | None = None
        self.error_rad: float | None = None
        self.odometry: Pose2 | None = None
        self.head: HeadAngles | None = None
        self.bumpers: tuple[bool, ...] = (False,) * 20
        self.trail = Trail(length_m)
        self.estimate_trail = Trail(length_m)
        self._truths: OrderedDict[int, Pose2] = OrderedDict()
        self._anchor: tuple[Pose2, Pose2] | None = None

    def add_truth(self, stamp_ns: int, pose: Pose2) -> None:
        """Take the true pose of a stamp; a jump begins new trails."""
        if self.truth is not None and self._jumped(stamp_ns, pose):
            self.trail.clear()
            self.estimate_trail.clear()
            self._truths.clear()
            self._anchor = None
        self.truth, self.truth_ns = pose, stamp_ns
        self._truths[stamp_ns] = pose
        if len(self._truths) > _STAMPS:
            self._truths.popitem(last=False)
        self.trail.add(pose.x_m, pose.y_m)

    def _jumped(self, stamp_ns: int, pose: Pose2) -> bool:
        if self.truth is None or stamp_ns < self.truth_ns:
            return True
        away_m = math.dist((self.truth.x_m, self.truth.y_m), (pose.x_m, pose.y_m))
        return away_m > _SLACK_M + _FASTEST_M_PER_S * (stamp_ns - self.truth_ns) * _NS

    def truth_at(self, stamp_ns: int) -> Pose2 | None:
        """Return the true pose of a stamp, if it is among the last 256."""
        return self._truths.get(stamp_ns)

    def add_estimate(self, stamp_ns: int, estimate: PoseEstimate, *, sure: bool) -> None:
        """Take the estimate of a stamp.

        Args:
            stamp_ns: The stamp.
            estimate: The estimate.
            sure: Whether it belongs on the trail.
        """
        self.estimate, self.estimate_ns = estimate, stamp_ns
        truth = self.compared = self._truths.get(stamp_ns)
        if truth is not None:
            pose = estimate.pose
            self.error_m = math.dist((truth.x_m, truth.y_m), (pose.x_m, pose.y_m))
            self.error_rad = angle_difference(pose.heading_rad, truth.heading_rad)
        if sure and (truth is not None or self.truth is None):  # not of the path before
            self.estimate_trail.add(estimate.pose.x_m, estimate.pose.y_m)

    def add_odometry(self, stamp_ns: int, pose: Pose2) -> None:
        """Take the pose by the encoders, in `odom`."""
        truth = self._truths.get(stamp_ns)
        if self._anchor is None and truth is not None:
            self._anchor = (truth, pose)
        if self._anchor is None:
            self.odometry = None
            return
        start, zero = self._anchor
        turn_rad = start.heading_rad - zero.heading_rad
        dx_m, dy_m = pose.x_m - zero.x_m, pose.y_m - zero.y_m
        cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
        self.odometry = Pose2(
            x_m=start.x_m + cosine * dx_m - sine * dy_m,
            y_m=start.y_m + sine * dx_m + cosine * dy_m,
            heading_rad=wrap_angle(pose.heading_rad + turn_rad),
        )
