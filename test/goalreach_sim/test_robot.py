import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Odometry, Pose2, Twist2
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import Walls, first_crossing

CONFIG = DriveConfig(
    translation_speed_m_per_s=0.5,
    translation_acceleration_m_per_s2=1.0,
    steering_speed_rad_per_s=1.0,
    steering_acceleration_rad_per_s2=2.0,
)


def make_robot(
    x_m: float,
    y_m: float,
    heading_rad: float,
    *,
    scale: float = 1.0,
    drift_rad_per_m: float = 0.0,
    watchdog_s: float = 60.0,
) -> Robot:
    robot = Robot(
        CONFIG,
        Walls(width_m=4.0, length_m=6.0, body_radius_m=0.25),
        watchdog_s=watchdog_s,
        odometry_scale=scale,
        drift_rad_per_m=drift_rad_per_m,
    )
    robot.place(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return robot


def twist(linear_m_per_s: float, steering_rad_per_s: float = 0.0) -> Twist2:
    return Twist2(linear_m_per_s=linear_m_per_s, steering_rad_per_s=steering_rad_per_s)


def pressed(robot: Robot) -> list[int]:
    return [index for index, flag in enumerate(robot.bumpers) if flag]


def test_drives_straight_by_hand() -> None:
    robot = make_robot(2.0, 1.0, math.pi / 2)
    robot.drive(twist(0.5))
    robot.advance(2.5)  # 0.5 s of ramp: 0.125 m; 2 s at 0.5 m/s: 1 m
    assert robot.y_m == pytest.approx(2.125, abs=1e-12)
    assert robot.x_m == pytest.approx(2.0, abs=1e-12)


def test_steering_turns_neither_base_nor_turret() -> None:
    robot = make_robot(2.0, 3.0, 0.0)
    robot.drive(twist(0.0, 1.0))
    robot.advance(1.25)  # 0.5 s of ramp: 0.25 rad; 0.75 s at 1 rad/s
    assert robot.heading_rad == pytest.approx(1.0, abs=1e-12)
    assert robot.base_yaw_rad == 0.0
    assert robot.turret.position == 0.0
    assert robot.turret_joint_rad == pytest.approx(-1.0, abs=1e-12)
    assert robot.truth.pose.heading_rad == pytest.approx(1.0, abs=1e-12)


def test_full_circle_comes_back() -> None:
    robot = make_robot(2.0, 3.0, 0.0)
    robot.steering.go(1.0)
    robot.advance(0.5)
    robot.steering.velocity = 1.0
    robot.translation.velocity = 0.5
    start_m = (robot.x_m, robot.y_m)
    robot.advance(2.0 * math.pi)
    assert (robot.x_m, robot.y_m) == pytest.approx(start_m, abs=1e-10)


def test_stops_exactly_at_the_wall() -> None:
    robot = make_robot(2.0, 1.0, -math.pi / 2)
    robot.drive(twist(0.5))
    robot.advance(30.0)
    assert robot.y_m == pytest.approx(0.25, abs=1e-12)
    assert robot.y_m >= 0.25
    assert robot.translation.velocity == 0.0
    # The base looks at -90 deg, so the goal wall is straight ahead of it.
    assert pressed(robot) == [0, 1, 19]


def test_which_sensor_is_pressed_follows_from_the_base() -> None:
    robot = make_robot(2.0, 1.0, 0.2)
    robot.drive(twist(0.0, -1.0))
    robot.advance(1.5)
    robot.drive(twist(0.5))
    robot.advance(30.0)
    # The wall at -90 deg is at -90 - 11.46 = -101.46 deg from the base: 258.54 deg.
    assert pressed(robot) == [14, 15]


def test_two_walls_in_a_corner() -> None:
    robot = make_robot(1.0, 1.0, -0.75 * math.pi)
    robot.drive(twist(0.5))
    robot.advance(30.0)
    assert (robot.x_m, robot.y_m) == pytest.approx((0.25, 0.25), abs=1e-9)
    # From the base, turned by -135 deg: walls at -45 and 45 deg.
    assert pressed(robot) == [2, 3, 17, 18]


def test_blocked_robot_backs_away() -> None:
    robot = make_robot(2.0, 0.25, -math.pi / 2)
    assert any(robot.bumpers)
    robot.drive(twist(0.5))
    robot.advance(1.0)
    assert robot.y_m == 0.25
    robot.drive(twist(-0.5))
    robot.advance(1.0)
    assert robot.y_m == pytest.approx(0.25 + 0.125 + 0.25, abs=1e-12)
    assert not any(robot.bumpers)


def test_motion_along_a_touched_wall_is_free() -> None:
    robot = make_robot(1.0, 0.25, 0.0)
    robot.drive(twist(0.5))
    robot.advance(2.5)
    assert (robot.x_m, robot.y_m) == pytest.approx((2.125, 0.25), abs=1e-12)
    assert any(robot.bumpers)


def test_blocked_robot_starts_when_steering_frees_it() -> None:
    # Facing the goal wall from 30 deg below +x, steering counter-clockwise with full speed.
    robot = make_robot(1.0, 0.25, -math.radians(30))
    robot.drive(twist(0.5, 1.0))
    # 30 deg = 0.5236 rad: 0.5 s of ramp (0.25 rad), then 0.2736 s.
    robot.advance(0.5 + math.radians(30) - 0.25 - 1e-6)
    assert robot.x_m == 1.0
    assert robot.translation.velocity == 0.0
    robot.advance(1e-6 + 0.1)
    assert robot.translation.velocity == pytest.approx(0.1, abs=1e-9)
    assert robot.y_m > 0.25


def test_watchdog_ramps_to_rest_at_its_moment() -> None:
    robot = make_robot(2.0, 1.0, math.pi / 2, watchdog_s=1.0)
    robot.drive(twist(0.5))
    robot.advance(30.0)
    # 0.125 m of ramp, 0.25 m at full speed until 1 s, 0.125 m of ramp.
    assert robot.y_m == pytest.approx(1.5, abs=1e-12)
    assert robot.translation.velocity == 0.0


def test_a_command_feeds_the_watchdog() -> None:
    robot = make_robot(2.0, 1.0, math.pi / 2, watchdog_s=1.0)
    for _ in range(5):
        robot.drive(twist(0.5))
        robot.advance(0.9)
    assert robot.translation.velocity == 0.5


def test_encoders_do_not_see_slip() -> None:
    robot = make_robot(2.0, 1.0, math.pi / 2, scale=1.02, drift_rad_per_m=0.1)
    robot.drive(twist(0.5))
    robot.advance(2.5)  # 1.125 m
    assert robot.truth.pose.heading_rad == pytest.approx(math.pi / 2 + 0.1125, abs=1e-12)
    # An arc of radius 10 m over 0.1125 rad.
    assert robot.x_m == pytest.approx(2.0 - 10.0 * (1.0 - math.cos(0.1125)), abs=1e-10)
    assert robot.y_m == pytest.approx(1.0 + 10.0 * math.sin(0.1125), abs=1e-10)
    odometry = robot.odometry
    assert odometry.pose.heading_rad == pytest.approx(math.pi / 2, abs=1e-12)
    assert odometry.pose.y_m == pytest.approx(1.0 + 1.02 * 1.125, abs=1e-12)
    assert odometry.twist.linear_m_per_s == pytest.approx(0.51, abs=1e-12)


def test_backing_slips_the_same_way() -> None:
    robot = make_robot(2.0, 3.0, math.pi / 2, drift_rad_per_m=0.1)
    robot.drive(twist(-0.5))
    robot.advance(2.5)
    assert robot.base_yaw_rad == pytest.approx(math.pi / 2 + 0.1125, abs=1e-12)


@pytest.mark.parametrize('x_m', [0.2, 3.9, math.nan])
def test_a_start_in_a_wall_is_refused(x_m: float) -> None:
    robot = make_robot(1.0, 1.0, 0.0)
    with pytest.raises(ConfigurationError, match='start_pose'):
        robot.place(Pose2(x_m=x_m, y_m=1.0, heading_rad=0.0))


COMMANDS = st.lists(
    st.tuples(st.floats(-0.6, 0.6), st.floats(-1.2, 1.2), st.floats(0.05, 2.0)),
    min_size=1,
    max_size=6,
)
STARTS = st.tuples(st.floats(0.25, 3.75), st.floats(0.25, 5.75), st.floats(-4.0, 4.0))


def drive(robot: Robot, commands: list[tuple[float, float, float]], steps: int) -> None:
    for linear, steering, duration_s in commands:
        robot.drive(twist(linear, steering))
        for _ in range(steps):
            robot.advance(duration_s / steps)


@example(start=(1.0, 1.0, 0.0), commands=[(5e-324, 0.0, 1.0), (-0.5, 0.0, 1.0)], drift=0.0625)
@given(start=STARTS, commands=COMMANDS, drift=st.floats(-0.1, 0.1))
@settings(max_examples=60, deadline=None)
def test_pose_does_not_depend_on_the_step(
    start: tuple[float, float, float], commands: list[tuple[float, float, float]], drift: float
) -> None:
    coarse = make_robot(*start, drift_rad_per_m=drift, scale=1.01, watchdog_s=1.1)
    fine = make_robot(*start, drift_rad_per_m=drift, scale=1.01, watchdog_s=1.1)
    drive(coarse, commands, 1)
    drive(fine, commands, 40)
    for one, other in ((fine.truth, coarse.truth), (fine.odometry, coarse.odometry)):
        assert numbers(one) == pytest.approx(numbers(other), abs=1e-9)


def numbers(odometry: Odometry) -> tuple[float, ...]:
    pose, velocity = odometry.pose, odometry.twist
    return (
        pose.x_m,
        pose.y_m,
        math.cos(pose.heading_rad),
        math.sin(pose.heading_rad),
        velocity.linear_m_per_s,
        velocity.steering_rad_per_s,
    )


@given(start=STARTS, commands=COMMANDS)
@settings(max_examples=60, deadline=None)
def test_perfect_encoders_match_the_truth_and_walls_block(
    start: tuple[float, float, float], commands: list[tuple[float, float, float]]
) -> None:
    robot = make_robot(*start)
    for command in commands:
        drive(robot, [command], 3)
        assert robot.walls.clearance_m(robot.x_m, robot.y_m) >= 0.0
        assert numbers(robot.odometry) == pytest.approx(numbers(robot.truth), abs=1e-8)


def test_sliding_along_a_wall_into_a_corner_keeps_its_speed_until_there() -> None:
    # Against the wall at x = 0 and heading off it by less than what counts, towards y = 0.
    robot = make_robot(0.25, 2.0, -math.pi / 2 - 1e-14)
    robot.drive(twist(0.5))
    for _ in range(200):
        robot.advance(0.02)
        if robot.y_m > 0.25 + 1e-9 and robot.translation.position > 0.2:
            assert robot.translation.velocity == 0.5
    assert robot.y_m == pytest.approx(0.25, abs=1e-12)
    assert robot.translation.position == pytest.approx(1.75, abs=1e-9)


def make_walls() -> Walls:
    return Walls(width_m=4.0, length_m=6.0, body_radius_m=0.5)


def test_clearance_is_to_the_nearest_wall() -> None:
    walls = make_walls()
    assert walls.clearance_m(2.0, 3.0) == 1.5
    assert walls.clearance_m(0.75, 3.0) == 0.25
    assert walls.clearance_m(2.0, 5.75) == -0.25


@pytest.mark.parametrize(
    ('x_m', 'y_m', 'direction_rad'),
    [
        (3.5, 3.0, 0.0),
        (2.0, 5.5, math.pi / 2),
        (0.5, 3.0, math.pi),
        (2.0, 0.5, -math.pi / 2),
    ],
)
def test_each_wall_is_sensed_and_blocks(x_m: float, y_m: float, direction_rad: float) -> None:
    walls = make_walls()
    assert walls.touch_directions_rad(x_m, y_m) == (direction_rad,)

    def blocks(angle_rad: float) -> bool:
        return walls.blocks(x_m, y_m, math.cos(angle_rad), math.sin(angle_rad))

    assert blocks(direction_rad)
    assert blocks(direction_rad + 1.5)
    assert not blocks(direction_rad + math.pi / 2)
    assert not blocks(direction_rad - math.pi / 2)
    assert not blocks(direction_rad + math.pi)


def test_a_corner_is_two_contacts() -> None:
    assert make_walls().touch_directions_rad(0.5, 0.5) == (math.pi, -math.pi / 2)
    assert make_walls().touch_directions_rad(2.0, 2.0) == ()


def test_clamp_moves_no_point_of_the_free_floor() -> None:
    assert make_walls().clamp(1.0, 2.0) == (1.0, 2.0)
    assert make_walls().clamp(0.1, 9.0) == (0.5, 5.5)


def test_first_crossing_stays_outside_the_wall() -> None:
    crossing_s = first_crossing(lambda t: 0.3 - t, 1.0)
    assert crossing_s == pytest.approx(0.3, abs=1e-15)
    assert 0.3 - crossing_s >= 0.0
