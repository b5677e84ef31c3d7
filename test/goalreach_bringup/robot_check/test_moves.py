"""A square fits where the robot stands, or is refused; and it is driven."""

from __future__ import annotations

from dataclasses import replace
import itertools
import math

import numpy as np
import pytest

from goalreach_bringup.robot_check.moves import (
    TURN_RAD,
    Measurement,
    SquareDrive,
    is_known,
    judge_motion,
    plan_square,
)
from goalreach_bringup.robot_check.verdicts import OK
from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import HeadAngles, Pose2, PoseEstimate

RADIUS_M = 0.225
ARENA = Arena()
DT_S = 0.04


def drive(start: Pose2, turns_rad: tuple[float, float], side_m: float) -> list[Pose2]:
    """Return the poses of a robot that follows commands at once."""
    config = ControllerConfig(cruise_speed_m_per_s=0.3, steering_limit_rad_per_s=0.5)
    square, path = SquareDrive(start, turns_rad, side_m, config), [start]
    while (command := square.command(at := path[-1])) is not None:
        assert len(path) < 5000
        heading = at.heading_rad + DT_S * command.steering_rad_per_s
        step_m = DT_S * command.linear_m_per_s
        x_m, y_m = at.x_m + step_m * math.cos(heading), at.y_m + step_m * math.sin(heading)
        path.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading))
    return path


@pytest.mark.parametrize('heading_deg', [-90.0, 0.0, 77.0, 180.0])
@pytest.mark.parametrize(('x_m', 'y_m'), [(0.45, 0.45), (1.778, 2.5), (3.1, 4.6)])
def test_a_square_stays_inside_and_ends_where_it_began(
    x_m: float, y_m: float, heading_deg: float
) -> None:
    start = Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg))
    path = drive(start, plan_square(ARENA, start, 1.0, RADIUS_M), 1.0)
    assert all(ARENA.is_free(p.x_m, p.y_m) for p in path)
    end = path[-1]
    assert math.hypot(end.x_m - x_m, end.y_m - y_m) < 0.1
    assert math.cos(end.heading_rad - start.heading_rad) > math.cos(0.05)
    length_m = sum(math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in itertools.pairwise(path))
    assert length_m == pytest.approx(4.0, abs=0.15)


def test_the_least_turn_comes_first() -> None:
    start = Pose2(x_m=1.778, y_m=3.0, heading_rad=-math.pi / 2)
    assert plan_square(ARENA, start, 1.0, RADIUS_M) == (0.0, math.pi / 2)
    right = Pose2(x_m=3.0, y_m=3.0, heading_rad=-math.pi / 2)
    assert plan_square(ARENA, right, 1.0, RADIUS_M) == (0.0, -math.pi / 2)


@pytest.mark.parametrize(
    ('heading_deg', 'turn_deg', 'corner_deg'),
    [(0, 0, 90), (-90, 90, 90), (180, -90, -90), (225, -135, -90), (240, 120, 90)],
)
def test_the_one_square_in_a_corner_is_found_from_each_heading(
    heading_deg: int, turn_deg: int, corner_deg: int
) -> None:
    """It is the square of 1 m to the upper right, driven either way."""
    obstacles = tuple(Obstacle(x_m=x, y_m=y, radius_m=0.2) for x, y in ((2.1, 0.95), (0.95, 2.1)))
    start = Pose2(x_m=0.45, y_m=0.45, heading_rad=math.radians(heading_deg))
    turns_rad = plan_square(Arena(obstacles=obstacles), start, 1.0, RADIUS_M)
    assert np.degrees(turns_rad) == pytest.approx([turn_deg, corner_deg])


@pytest.mark.parametrize(
    ('sigmas', 'known'),
    [((0.19, 0.19, 3.0), True), ((0.21, 0.1, 0.1), False), ((0.1, 0.21, 0.1), False)],
)
def test_a_pose_is_known_by_its_position(sigmas: tuple[float, ...], known: object) -> None:
    pose = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.0)
    estimate = PoseEstimate(pose=pose, covariance=np.diag(np.square(sigmas)))
    assert is_known(estimate) is known


def test_the_drive_stays_ended_wherever_the_robot_is_pushed() -> None:
    start = Pose2(x_m=1.778, y_m=2.5, heading_rad=0.0)
    config = ControllerConfig()
    square = SquareDrive(start, (0.0, math.pi / 2), 0.5, config)
    for corner in ((0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0)):
        square.command(replace(start, x_m=start.x_m + corner[0], y_m=start.y_m + corner[1]))
    assert square.command(start) is None
    assert square.command(replace(start, x_m=3.0)) is None


def test_a_square_that_fits_nowhere_is_refused() -> None:
    start = Pose2(x_m=1.778, y_m=2.5, heading_rad=0.0)
    with pytest.raises(ConfigurationError, match=r'--side = 3\.0: must be smaller'):
        plan_square(ARENA, start, 3.0, RADIUS_M)
    full = Arena(
        obstacles=tuple(
            Obstacle(x_m=1.778 + 0.7 * a, y_m=2.5 + 0.7 * b, radius_m=0.2)
            for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))
        )
    )
    with pytest.raises(ConfigurationError, match='none fits at'):
        plan_square(full, start, 1.0, RADIUS_M)


def test_a_joint_that_reports_angles_around_half_a_turn_has_its_sign() -> None:
    before, after = (
        Measurement(
            pose=Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0),
            head=HeadAngles(turret_rad=turret, pan_rad=0.0, tilt_rad=0.0),
            rays=np.empty((0, 2)),
        )
        for turret in (3.1, wrap_angle(3.1 + TURN_RAD))
    )
    first, *_ = judge_motion('turret_joint', before, after)
    assert first.level == OK
