import math

import pytest

from goalreach_msgs_py.values import Pose2
from goalreach_sim.path_integral import Motion
from goalreach_sim.sensors import WheelOdometry


def test_scale_error_stretches_the_path() -> None:
    odometry = WheelOdometry(1.1)
    odometry.define(Pose2(x_m=1.0, y_m=2.0, heading_rad=math.pi / 2), 0.3)
    odometry.count(Motion(0.3, 0.0, 0.0, 0.5, 0.0), 2.0)
    pose = odometry.pose(0.3)
    assert pose.x_m == pytest.approx(1.0, abs=1e-15)
    assert pose.y_m == pytest.approx(3.1, abs=1e-15)
    assert pose.heading_rad == pytest.approx(math.pi / 2, abs=1e-15)


def test_heading_follows_the_steering() -> None:
    odometry = WheelOdometry(1.0)
    odometry.define(Pose2(x_m=0.0, y_m=0.0, heading_rad=3.0), 1.0)
    assert odometry.pose(1.5).heading_rad == pytest.approx(3.5 - 2 * math.pi, abs=1e-15)
