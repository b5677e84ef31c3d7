"""Verdicts on small motions (signs and scales), and the plan and commands of a square drive."""

from collections.abc import Iterator
from dataclasses import dataclass
import itertools
import math
from typing import Final

import numpy as np

from goalreach_bringup.robot_check.verdicts import OK, WARN, WRONG, Verdict
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.steering import HeadingFollower
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2, PoseEstimate, Twist2

TURN_RAD: Final = math.radians(10.0)
DRIVE_M: Final = 0.1
DRIVE, TURN = 'linear.x', 'angular.z'
_STILL: Final = 0.2
_RANGE: Final = (0.7, 1.4)
"""Parts of a commanded motion: less is none; outside the range its scale is wrong. Chosen."""
_SHRUNK: Final = -0.003
_CLEARANCE_M: Final = 0.15
"""Distance of the body from walls and obstacles, for a robot not yet calibrated. Chosen."""
_TURNS: Final = sorted((math.radians(15.0 * k) for k in range(-9, 9)), key=abs)
"""First turns: one of the two headings of a square is no farther. Chosen."""
_KNOWN_M: Final = 0.2
"""Sigma of x and y from which a pose is unknown. Chosen."""
_RIGHT_ANGLE_RAD: Final = math.pi / 2
_SIDES: Final = 4
_SAMPLES: Final = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """Measurements of a robot at rest.

    Attributes:
        head: Joint angles.
        pose: Pose by odometry.
        rays: (n, 2) tangents of the angles to LEDs, right and down in the image.
    """

    head: HeadAngles
    pose: Pose2
    rays: FloatArray


def judge_motion(subject: str, before: Measurement, after: Measurement) -> Iterator[Verdict]:
    """Yield the verdicts on a motion of 10 degrees or 0.1 m.

    The subject is a joint, or `linear.x` or `angular.z`.
    """
    level, text, cure = _compare(_reported(subject, before, after), subject)
    yield Verdict(subject=subject, level=level, text=f'reported {text}', cure=cure)
    seen = len(before.rays) == len(after.rays) > (subject == DRIVE)
    if not seen:
        text = 'not measured in the images: other LEDs are visible after than before'
        yield Verdict(subject=subject, level=WARN, text=text, cure='let it face the LEDs')
    elif level == OK and subject == DRIVE:
        growth = np.ptp(after.rays[:, 0]) / np.ptp(before.rays[:, 0]) - 1.0
        if growth < _SHRUNK:
            text = f'the LEDs move together by {-growth:.1%}: it drives backwards'
            cure = 'make linear.x and odometry positive ahead, where the camera looks'
            yield Verdict(subject=subject, level=WRONG, text=text, cure=cure)
    elif level == OK:
        level, text, cure = _compare(_seen_rad(subject, before, after), subject)
        cure = cure and f'the camera may be mirrored or turned, or K be wrong; else {cure}'
        yield Verdict(subject=subject, level=level, text=f'seen {text}', cure=cure)


def _reported(subject: str, before: Measurement, after: Measurement) -> float:
    """Return how far the robot moved by its encoders."""
    if subject == TURN:
        return angle_difference(after.pose.heading_rad, before.pose.heading_rad)
    if subject == DRIVE:
        x_m, y_m = after.pose.x_m - before.pose.x_m, after.pose.y_m - before.pose.y_m
        heading_rad = before.pose.heading_rad
        return x_m * math.cos(heading_rad) + y_m * math.sin(heading_rad)
    name = subject.replace('_joint', '_rad')
    moved = float(getattr(after.head, name) - getattr(before.head, name))
    return math.remainder(moved, math.tau) if abs(moved) <= math.tau else moved  # degrees


def _seen_rad(subject: str, before: Measurement, after: Measurement) -> float:
    """Return how far it turned left, or up, by the LEDs; a head may turn against its base."""
    column = int(subject == 'tilt_joint')
    turned_rad = np.mean(np.arctan(after.rays[:, column]) - np.arctan(before.rays[:, column]))
    if subject == TURN:
        turned_rad += before.head.turret_rad + before.head.pan_rad
        turned_rad -= after.head.turret_rad + after.head.pan_rad
    return float(turned_rad)


def _compare(moved: float, subject: str) -> tuple[str, str, str]:
    """Return level, text and cure."""
    commanded, unit = (DRIVE_M, 'm') if subject == DRIVE else (TURN_RAD, 'rad')
    ratio, text = moved / commanded, f'{moved:+.3f} {unit} of {commanded:+.3f}'
    if abs(ratio) < _STILL:
        return WRONG, text, 'it does not follow its command: is it enabled?'
    if ratio < 0.0:
        return WRONG, text, 'the sign is wrong: counter-clockwise, upward and ahead are positive'
    if not _RANGE[0] <= ratio <= _RANGE[1]:
        degrees = _RANGE[0] <= math.radians(ratio) <= _RANGE[1]
        return WRONG, text, 'send radians, not degrees' if degrees else 'the scale is wrong'
    return OK, text, ''


def is_known(estimate: PoseEstimate) -> bool:
    """Return whether the position is certain enough to drive by."""
    return bool(estimate.covariance[[0, 1], [0, 1]].max() < _KNOWN_M**2)


def plan_square(
    arena: Arena, pose: Pose2, side_m: float, body_radius_m: float
) -> tuple[float, float]:
    """Return the turns of a square drive from a pose in `map`, with the smallest first turn.

    Returns:
        The turn to the first side, and that from side to side, radians.

    Raises:
        ConfigurationError: No square fits.
    """
    radius_m = body_radius_m + _CLEARANCE_M
    for turn, corner in itertools.product(_TURNS, (_RIGHT_ANGLE_RAD, -_RIGHT_ANGLE_RAD)):
        at, place = pose.heading_rad + turn, complex(pose.x_m, pose.y_m)
        places = [place]
        for side, _ in itertools.product(range(_SIDES), range(_SAMPLES)):
            azimuth = at + side * corner
            step = side_m / _SAMPLES * complex(math.cos(azimuth), math.sin(azimuth))
            places.append(places[-1] + step)
        if all(arena.is_free(p.real, p.imag, body_radius_m=radius_m) for p in places):
            return turn, corner
    allowed = f'smaller, or the robot elsewhere: none fits at ({pose.x_m:.2f}, {pose.y_m:.2f})'
    raise ConfigurationError('--side', side_m, allowed)


class SquareDrive:
    """Commands of a drive around a square by odometry, which ends with its first heading."""

    def __init__(
        self,
        odometry: Pose2,
        turns_rad: tuple[float, float],
        side_m: float,
        config: ControllerConfig,
    ) -> None:
        first_rad, corner_rad = turns_rad
        sides_rad = (first_rad + side * corner_rad for side in range(_SIDES))
        self._headings_rad = [odometry.heading_rad + turn for turn in (*sides_rad, 0.0)]
        self._side_m, self._config = side_m, config
        self._corner, self._follower = odometry, HeadingFollower()

    def command(self, odometry: Pose2) -> Twist2 | None:
        """Return the velocities from a pose by odometry; None at the end."""
        driven_m = math.hypot(odometry.x_m - self._corner.x_m, odometry.y_m - self._corner.y_m)
        if driven_m >= self._side_m and len(self._headings_rad) > 1:
            self._corner = odometry
            del self._headings_rad[0]
        self._follower.turn_to(self._headings_rad[0])
        command = self._follower.command(odometry, self._config)
        ends = len(self._headings_rad) == 1
        return None if ends and command.linear_m_per_s > 0.0 else command
