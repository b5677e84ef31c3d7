import pytest

from goalreach_lab.localization.waypoint_robot import WaypointRobot
from goalreach_msgs_py.noise import noise_preset


def test_a_kidnapped_robot_has_no_sign_of_it() -> None:
    robot = WaypointRobot((3, 1), noise=noise_preset('nominal'))
    before = robot.step().frame
    robot.kidnap()
    frame = robot.simulator.sense()
    assert frame.odometry.pose == before.odometry.pose
    assert frame.joints.turret_rad == pytest.approx(before.joints.turret_rad)
    assert frame.truth.pose.x_m != before.truth.pose.x_m
