"""Random drives that search for flaws in the physics: walls, limits, odometry, step length."""

from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import BODY_RADIUS_M, LENGTH_M, WIDTH_M
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import Walls

_COMMANDS = 5
_STEPS = 8
"""Commands of a drive and steps of each command; chosen."""

_TOP_SPEED_M_PER_S = 20.0
"""Far above the robot's 0.6 m/s: walls must hold at any speed."""


@dataclass(frozen=True, kw_only=True)
class DriveStudy:
    """The worst of all drives; each value is zero up to rounding.

    Attributes:
        drives: Number of drives.
        bumps: Number of drives that ended against a wall.
        overlap_m: Deepest overlap of the body with a wall.
        speed_excess: Speed above the limit of an axis (m/s or rad/s).
        acceleration_excess: Gain of speed in a step beyond acceleration times time.
        odometry_error_m: Distance between truth and perfect encoders, per metre driven.
        step_error: Distance (m) or angle (rad) between a drive in long and in short steps.
    """

    drives: int
    bumps: int
    overlap_m: float
    speed_excess: float
    acceleration_excess: float
    odometry_error_m: float
    step_error: float


@dataclass(frozen=True, kw_only=True)
class _Drive:
    start: Pose2
    top_speed_m_per_s: float
    drift_rad_per_m: float
    commands: tuple[tuple[Twist2, float], ...]


def study_drives(drives: int, rng: np.random.Generator) -> DriveStudy:
    """Drive at random and return the worst of each flaw.

    Each drive has a random start (one in four against a wall), a random top speed up to twenty
    metres a second, random commands of random durations, and is driven three times: in short
    steps with perfect encoders and no slip, and with slip in short and in long steps.

    Args:
        drives: Number of drives.
        rng: Source of randomness.
    """
    bumps = 0
    worst = {
        'overlap_m': 0.0,
        'speed_excess': 0.0,
        'acceleration_excess': 0.0,
        'odometry_error_m': 0.0,
        'step_error': 0.0,
    }
    for _ in range(drives):
        drive = _draw(rng)
        ideal = _follow(drive, 0.0, _STEPS, worst)
        fine = _follow(drive, drive.drift_rad_per_m, _STEPS, worst)
        coarse = _follow(drive, drive.drift_rad_per_m, 1, worst)
        bumps += any(fine.bumpers)
        driven_m = sum(drive.top_speed_m_per_s * duration_s for _, duration_s in drive.commands)
        error_m = _difference(ideal.truth.pose, ideal.odometry.pose) / max(driven_m, 1.0)
        _raise_to(worst, 'odometry_error_m', error_m)
        _raise_to(worst, 'step_error', _difference(fine.truth.pose, coarse.truth.pose))
    return DriveStudy(drives=drives, bumps=bumps, **worst)


def _draw(rng: np.random.Generator) -> _Drive:
    x, y, heading, speed, drift, edge = rng.random(6).tolist()
    if edge < 0.25:
        x = round(x)
    top_speed_m_per_s = 0.1 * (_TOP_SPEED_M_PER_S / 0.1) ** speed
    commands = tuple(
        (
            Twist2(
                linear_m_per_s=1.2 * top_speed_m_per_s * (2.0 * linear - 1.0),
                steering_rad_per_s=1.3 * (2.0 * steering - 1.0) if steering > 0.4 else 0.0,
            ),
            0.01 + 2.0 * duration,
        )
        for linear, steering, duration in rng.random((_COMMANDS, 3)).tolist()
    )
    return _Drive(
        start=Pose2(
            x_m=BODY_RADIUS_M + x * (WIDTH_M - 2.0 * BODY_RADIUS_M),
            y_m=BODY_RADIUS_M + y * (LENGTH_M - 2.0 * BODY_RADIUS_M),
            heading_rad=math.tau * heading,
        ),
        top_speed_m_per_s=top_speed_m_per_s,
        drift_rad_per_m=0.1 * (2.0 * drift - 1.0),
        commands=commands,
    )


def _follow(drive: _Drive, drift_rad_per_m: float, steps: int, worst: dict[str, float]) -> Robot:
    walls = Walls(width_m=WIDTH_M, length_m=LENGTH_M, body_radius_m=BODY_RADIUS_M)
    robot = Robot(DriveConfig(), walls, watchdog_s=1.5, drift_rad_per_m=drift_rad_per_m)
    robot.translation.max_speed = drive.top_speed_m_per_s
    robot.translation.acceleration = 2.0 * drive.top_speed_m_per_s
    robot.place(drive.start)
    for command, duration_s in drive.commands:
        robot.drive(command)
        for _ in range(steps):
            _step(robot, duration_s / steps, worst)
    return robot


def _step(robot: Robot, dt_s: float, worst: dict[str, float]) -> None:
    axes = (robot.translation, robot.steering)
    before = [abs(axis.velocity) for axis in axes]
    robot.advance(dt_s)
    _raise_to(worst, 'overlap_m', -robot.walls.clearance_m(robot.x_m, robot.y_m))
    for axis, speed in zip(axes, before, strict=True):
        gain = abs(axis.velocity) - speed
        _raise_to(worst, 'speed_excess', abs(axis.velocity) - axis.max_speed)
        _raise_to(worst, 'acceleration_excess', gain - axis.acceleration * dt_s)


def _difference(one: Pose2, other: Pose2) -> float:
    distance_m = math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
    return max(distance_m, abs(angle_difference(one.heading_rad, other.heading_rad)))


def _raise_to(worst: dict[str, float], name: str, value: float) -> None:
    worst[name] = max(worst[name], value)
