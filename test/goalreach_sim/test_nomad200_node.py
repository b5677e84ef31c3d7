"""The robot's node over real DDS: driving, contact, watchdog, services, parameters, clock."""

from collections.abc import Callable
import functools
import itertools
import math
from pathlib import Path
import time

import cv2
from geometry_msgs.msg import TwistStamped
import numpy as np
import pytest
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, LaserScan

from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS, stamp_from_msg
from ros_robot import RobotGraph, robot_graph

pytestmark = pytest.mark.graph


def drive_until(robot: RobotGraph, linear: float, condition: Callable[[], bool]) -> None:
    """Send a command with every tick until a condition holds."""
    for _ in range(2000):
        if condition():
            return
        robot.drive(linear, 0.0, robot.clock_ns[-1])
        robot.wait_for_ticks(1)
    pytest.fail(f'2000 ticks were not enough:\n{robot.log}')


def pressed(scan: LaserScan) -> list[int]:
    return [i for i, reading in enumerate(scan.ranges) if math.isfinite(reading)]


def test_the_watchdog_stops_a_robot_without_commands(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=4.0, start_pose='[1.778, 4.5, -1.5708]') as robot:
        robot.wait_for_ticks(2)
        drive_until(robot, 0.3, lambda: robot.pose.y_m < 4.2)
        assert robot.speed_m_per_s == pytest.approx(0.3)
        last_y_m = robot.pose.y_m
        robot.wait(lambda: robot.speed_m_per_s == 0.0)
        stopped_y_m = robot.pose.y_m
        robot.wait_for_ticks(10)
        assert robot.pose.y_m == stopped_y_m
        # 0.4 s, 0.01 m to brake, and commands that were still under way.
        assert 0.05 < last_y_m - stopped_y_m < 1.0
        assert 'Traceback' not in robot.log


def test_bumpers_report_contact_and_the_wall_blocks(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=4.0, start_pose='[1.0, 0.4, -1.4708]') as robot:
        robot.wait_for_ticks(2)
        assert not pressed(robot.scans[-1])
        drive_until(robot, 0.5, lambda: bool(pressed(robot.scans[-1])))
        robot.wait_for_ticks(5)
        scan = robot.scans[-1]
        # The wall is 5.7 degrees to the right of sensor 0, which looks along the first heading.
        assert pressed(scan) == [0, 19]
        assert scan.ranges[0] == pytest.approx(0.225)
        assert len(scan.ranges) == 20
        assert scan.angle_increment == pytest.approx(math.radians(18.0))
        assert robot.pose.y_m == pytest.approx(0.225, abs=1e-6)
        drive_until(robot, -0.3, lambda: robot.pose.y_m > 0.25)
        robot.wait_for_ticks(1)
        assert not pressed(robot.scans[-1])


def _stands_at(robot: RobotGraph, x_m: float, y_m: float) -> bool:
    return (robot.pose.x_m, robot.pose.y_m) == pytest.approx((x_m, y_m))


def test_resets_move_the_robot_but_not_the_clock(tmp_path: Path) -> None:
    places = [(1.0, 1.0, 0.0), (2.5, 4.0, 1.0), (0.5, 2.0, -2.0)]
    with robot_graph(tmp_path, speed=4.0) as robot:
        for x_m, y_m, heading_rad in places:
            robot.wait_for_ticks(3)
            assert robot.set_parameter('start_pose', [x_m, y_m, heading_rad]).successful
            answer = robot.reset()
            assert answer.success
            assert answer.message.startswith(f'at {x_m:.3f} m, {y_m:.3f} m')
            robot.wait(functools.partial(_stands_at, robot, x_m, y_m))
            assert robot.pose.heading_rad == pytest.approx(heading_rad)
        clock_ns = list(robot.clock_ns)
        stamps_ns = [stamp_from_msg(message.header.stamp) for message in robot.truth]
    for times_ns in (clock_ns, stamps_ns):
        assert all(later > earlier for earlier, later in itertools.pairwise(times_ns))


def test_refuses_parameters_with_a_reason(tmp_path: Path) -> None:
    with robot_graph(tmp_path) as robot:
        for name, value, said in [
            ('start_pose', [0.1, 1.0, 0.0], 'on the free floor'),
            ('start_pose', [1.0, 1.0], 'start_pose = '),
            ('start_pose', [1.0, math.nan, 0.0], 'start_pose'),
            ('speed', -1.0, 'speed'),
            ('speed', 1000.0, 'speed'),
            ('watchdog_s', 1.0, 'read-only'),
            ('seed', 3, 'read-only'),
        ]:
            result = robot.set_parameter(name, value)
            assert not result.successful, name
            assert said in result.reason
        assert robot.reset().success
        robot.wait_for_ticks(2)
        assert robot.pose.y_m == pytest.approx(4.5)


def test_a_pause_holds_the_clock_and_services_answer_in_it(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=4.0) as robot:
        robot.wait_for_ticks(3)
        answer = robot.pause(on=True)
        assert (answer.success, answer.message) == (True, 'paused')
        robot.serve_until(lambda: False, 0.2)
        held_ns = robot.clock_ns[-1]
        robot.serve_until(lambda: False, 0.5)
        assert robot.clock_ns[-1] == held_ns
        assert robot.reset().success
        assert robot.pause(on=False).message == 'running'
        robot.wait_for_ticks(3)
        # No time is made up for: the next tick is one period later.
        index = robot.clock_ns.index(held_ns)
        assert robot.clock_ns[index + 1] == held_ns + 40_000_000


def is_last(robot: RobotGraph, stamp_ns: int) -> bool:
    return robot.clock_ns[-1] == stamp_ns


def test_a_step_advances_a_paused_clock_by_one_period(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=4.0) as robot:
        robot.wait_for_ticks(3)
        assert not robot.step().success  # it runs
        robot.pause(on=True)
        robot.serve_until(lambda: False, 0.2)
        held_ns = robot.clock_ns[-1]
        for number in (1, 2):
            assert robot.step().success
            stepped_ns = held_ns + 40_000_000 * number
            robot.wait(functools.partial(is_last, robot, stepped_ns))


def test_the_speed_may_change_while_it_runs(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=0.01) as robot:
        # At 0.01 a tick comes every four seconds; at 20 there are 500 in a second.
        robot.wait(lambda: bool(robot.clock_ns))
        assert robot.set_parameter('speed', 20).successful
        robot.wait_for_ticks(100)
        assert robot.set_parameter('speed', 0.01).successful
        robot.serve_until(lambda: False, 0.2)
        count = len(robot.clock_ns)
        robot.serve_until(lambda: False, 0.5)
        assert len(robot.clock_ns) - count <= 1
        # On a busy machine a listener may miss some of 500 messages a second.
        spacing_ns = {b - a for a, b in itertools.pairwise(robot.clock_ns)}
        assert min(spacing_ns) == 40_000_000
        assert all(step_ns % 40_000_000 == 0 for step_ns in spacing_ns)


def test_a_command_that_is_not_a_number_is_refused(
    tmp_path: Path,
) -> None:
    with robot_graph(tmp_path, speed=4.0) as robot:
        robot.wait_for_ticks(2)
        drive_until(robot, math.nan, lambda: '/cmd_vel: ' in robot.log)
        robot.wait_for_ticks(3)
        assert robot.speed_m_per_s == 0.0
        assert 'Traceback' not in robot.log


def test_a_command_that_comes_late_is_refused_by_name(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=4.0) as robot:
        robot.wait_for_ticks(30)
        sent = 0
        while sent < 5 or '/cmd_vel: a command 1.' not in robot.log:  # the first may go unheard
            robot.drive(0.3, 0.0, robot.clock_ns[-1] - 1_000_000_000)
            robot.wait_for_ticks(1)
            sent += 1
        assert robot.speed_m_per_s == 0.0
        robot.drive(0.3, 0.0, 0)  # no stamp: now
        robot.wait(lambda: robot.speed_m_per_s > 0.0)


@pytest.mark.parametrize('topic', ['/cmd_vel', '/wheels'])
def test_while_two_nodes_drive_none_is_obeyed(topic: str, tmp_path: Path) -> None:
    with robot_graph(tmp_path, [f'/cmd_vel:={topic}'], speed=2.0) as robot:
        robot.drive_by(topic)
        robot.wait_for_ticks(2)
        drive_until(robot, 0.2, lambda: robot.speed_m_per_s > 0.1)
        stranger = Node('stranger', context=robot.node.context, enable_rosout=False)
        stranger.create_publisher(TwistStamped, topic, RELIABLE_QOS)
        told = "2 nodes drive: ['/onlooker', '/stranger']"
        drive_until(robot, 0.2, lambda: robot.speed_m_per_s == 0.0 and told in robot.log)
        stranger.destroy_node()
        drive_until(robot, 0.2, lambda: robot.speed_m_per_s > 0.1)


def test_images_are_compressed_for_subscribers_ten_times_a_second(tmp_path: Path) -> None:
    with robot_graph(tmp_path, speed=1.0) as robot:
        robot.wait_for_ticks(2)
        images: list[CompressedImage] = []
        began_s = time.monotonic()
        subscription = robot.node.create_subscription(
            CompressedImage, '/camera/image_raw/compressed', images.append, SENSOR_QOS
        )
        robot.wait(lambda: len(images) >= 5)
        assert time.monotonic() - began_s > 0.39
        robot.node.destroy_subscription(subscription)
    pixels = cv2.imdecode(np.frombuffer(images[0].data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels is not None
    assert (images[0].format, pixels.shape) == ('jpeg', (480, 640))
    assert images[0].header.frame_id == 'camera_optical_frame'
    assert stamp_from_msg(images[0].header.stamp) in robot.clock_ns
