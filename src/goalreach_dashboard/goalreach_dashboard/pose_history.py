"""True, estimated and odometric poses of the robot joined by stamp, and the trails they leave."""

from collections import OrderedDict
import math
from typing import Final

from goalreach_msgs_py.alignment import moved_on
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import Pose2, PoseEstimate

_SPACING_M: Final = 0.02
_MAX_TRAIL_POINTS: Final = 3000
_MAX_STAMPS: Final = 256
_MAX_SPEED_M_PER_S: Final = 2.0
_TOLERANCE_M: Final = 0.1


class Trail:
    """A path as the text of an SVG polyline, in centimetres, y downward from the arena's far wall.

    Attributes:
        text: The `points` attribute; it only grows, until the trail is too long.
    """

    def __init__(self, length_m: float) -> None:
        self._length_m = length_m
        self.text = ''
        self._count = 0
        self._last: tuple[float, float] | None = None

    def add(self, x_m: float, y_m: float) -> None:
        """Add a point 2 cm or more from the last; 3000 points lose their older half."""
        if self._last is not None and math.dist(self._last, (x_m, y_m)) < _SPACING_M:
            return
        self._last = (x_m, y_m)
        self.text += f'{100.0 * x_m:.1f},{100.0 * (self._length_m - y_m):.1f} '
        self._count += 1
        if self._count >= _MAX_TRAIL_POINTS:
            kept = self.text.split()[self._count // 2 :]
            self.text = ' '.join(kept) + ' '
            self._count = len(kept)


class PoseHistory:
    """True, estimated and odometric poses, compared where their stamps are equal.

    Each is None before it comes. Odometry is drawn in `map` as if it had been exact where the path
    began.

    Attributes:
        truths: The last 256 true poses by their stamps.
        compared: True pose of the estimate's stamp, or None where it was not received.
        error: Distance of the estimate from the truth of the same stamp, m, and difference of
            their headings, rad; or None.
        trail: True path since the robot was placed.
        estimate_trail: Estimated path since then.
        last_trail: Text of the true path before that, empty where there was none.
    """

    def __init__(self, length_m: float) -> None:
        self._length_m = length_m
        self.truth: Pose2 | None = None
        self.truth_ns = 0
        self.estimate: PoseEstimate | None = None
        self.estimate_ns = 0
        self.compared: Pose2 | None = None
        self.error: tuple[float, float] | None = None
        self.odometry: Pose2 | None = None
        self.trail = Trail(length_m)
        self.estimate_trail = Trail(length_m)
        self.last_trail = ''
        self.truths: OrderedDict[int, Pose2] = OrderedDict()
        self._anchor: tuple[Pose2, Pose2] | None = None

    def add_truth(self, stamp_ns: int, pose: Pose2) -> None:
        """Add the true pose of a stamp; a jump starts new trails."""
        if self.truth is not None and self._has_jumped(self.truth, stamp_ns, pose):
            self.last_trail = self.trail.text
            self.trail, self.estimate_trail = Trail(self._length_m), Trail(self._length_m)
            self.truths.clear()
            self._anchor = None
        self.truth, self.truth_ns = pose, stamp_ns
        self.truths[stamp_ns] = pose
        if len(self.truths) > _MAX_STAMPS:
            self.truths.popitem(last=False)
        self.trail.add(pose.x_m, pose.y_m)

    def _has_jumped(self, last: Pose2, stamp_ns: int, pose: Pose2) -> bool:
        if stamp_ns < self.truth_ns:
            return True
        distance_m = math.dist((last.x_m, last.y_m), (pose.x_m, pose.y_m))
        elapsed_s = (stamp_ns - self.truth_ns) * 1e-9
        return distance_m > _TOLERANCE_M + _MAX_SPEED_M_PER_S * elapsed_s

    def add_estimate(self, stamp_ns: int, estimate: PoseEstimate, *, trusted: bool) -> None:
        """Add the estimate of a stamp; one that is trusted belongs on the trail."""
        self.estimate, self.estimate_ns = estimate, stamp_ns
        pose, truth = estimate.pose, self.truths.get(stamp_ns)
        self.compared, self.error = truth, None
        if truth is not None:
            error_m = math.dist((truth.x_m, truth.y_m), (pose.x_m, pose.y_m))
            self.error = error_m, angle_difference(pose.heading_rad, truth.heading_rad)
        if trusted and (truth is not None or self.truth is None):  # not of the previous path
            self.estimate_trail.add(pose.x_m, pose.y_m)

    def add_odometry(self, stamp_ns: int, pose: Pose2) -> None:
        """Add the pose by the encoders, in `odom`."""
        truth = self.truths.get(stamp_ns)
        if self._anchor is None and truth is not None:
            self._anchor = (truth, pose)
        self.odometry = None if self._anchor is None else moved_on(*self._anchor, pose)
