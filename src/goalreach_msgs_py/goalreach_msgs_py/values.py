"""The values passed between the parts of the system, in the order of the data flow."""

from dataclasses import dataclass
import enum

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Pose2:
    """A planar pose: position in metres, heading in radians, counter-clockwise from +x."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, kw_only=True)
class Twist2:
    """A planar velocity: along the drive heading, m/s, and of the steering axis, rad/s."""

    linear_m_per_s: float
    steering_rad_per_s: float


@dataclass(frozen=True, kw_only=True)
class Odometry:
    """Pose in `odom` and velocity, as measured by the wheel encoders."""

    pose: Pose2
    twist: Twist2


@dataclass(frozen=True, kw_only=True)
class HeadAngles:
    """Joint angles between base and camera, radians.

    Zero with the camera level along the drive heading; turret and pan count counter-clockwise
    seen from above, tilt counts upward.
    """

    turret_rad: float
    pan_rad: float
    tilt_rad: float


@dataclass(frozen=True, kw_only=True)
class Scan:
    """Ranges around the robot's axis.

    Attributes:
        first_rad: Bearing of the first ray, counter-clockwise from the front.
        step_rad: Bearing from one ray to the next.
        ranges_m: Ranges; infinite where nothing was seen.
        on_base: Whether bearings count from the front of the base, which does not turn with the
            wheels; otherwise from the drive heading.
    """

    first_rad: float
    step_rad: float
    ranges_m: tuple[float, ...]
    on_base: bool = True


@dataclass(frozen=True, kw_only=True)
class LandmarkObservation:
    """One LED in an image: pixel coordinates of its centre, and its peak grey value.

    Pixel (0, 0) is the centre of the top-left pixel; u to the right, v down.
    """

    u_px: float
    v_px: float
    peak_dn: float


@dataclass(frozen=True, kw_only=True)
class PoseEstimate:
    """A mean pose in `map` with its covariance, (3, 3) of x (m), y (m), heading (rad)."""

    pose: Pose2
    covariance: FloatArray


Region = tuple[int, int]
"""A region as indices (i, j): i in (LEFT-SIDE, FRONT, RIGHT-SIDE), j in (NEAR, MEDIUM, FAR)."""


class Confidence(enum.Enum):
    """Reliability of a state; maps to the levels of diagnostic_msgs."""

    OK = 'ok'
    UNCERTAIN = 'uncertain'
    STALE = 'stale'


@dataclass(frozen=True, kw_only=True)
class RegionState:
    """The state of section "The State Set" and its fuzzy extension.

    Attributes:
        region: The crisp region (i, j) that holds the estimated position.
        mu_x: Memberships of x in the columns (LEFT-SIDE, FRONT, RIGHT-SIDE), each in [0, 1].
        mu_y: Memberships of y in the rows (NEAR, MEDIUM, FAR).
        pose: The estimated pose the state was computed from.
        goal_probability: Probability that the true position lies in the goal region, given the
            pose's covariance.
        confidence: OK, or UNCERTAIN where the covariance is too large, or STALE.
    """

    region: Region
    mu_x: tuple[float, ...]
    mu_y: tuple[float, ...]
    pose: Pose2
    goal_probability: float
    confidence: Confidence


class PathOutcome(enum.Enum):
    """Outcome of a path as the controller sees it, without the truth."""

    GOAL = 'goal'
    BUMP = 'bump'
    FORBIDDEN = 'forbidden'
    TIMEOUT = 'timeout'


@dataclass(frozen=True, kw_only=True)
class Transition:
    """One finished action: the tuple that equation (1) learns from.

    Attributes:
        state: Region in which the action was chosen.
        action: Index k of the heading; of eight, k * 45 degrees.
        reward: In the paper +1 goal, -1 bump, 0 otherwise.
        next_state: Region in which the action ended.
        temperature: Boltzmann temperature of equation (2) at the choice; 0 where greedy.
        trial: Trial, from 0.
        path: Path within the run, from 0.
        outcome: How the path ended, or None where it goes on.
    """

    state: Region
    action: int
    reward: float
    next_state: Region
    temperature: float
    trial: int
    path: int
    outcome: PathOutcome | None
