import math

import pytest

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_sim.contact import Walls
from goalreach_sim.nomad200 import (
    STATE_BUMPER,
    STATE_CONF_TURRET,
    STATE_CONF_X,
    STATE_LENGTH,
    STATE_MOTOR_STATUS,
    STATE_SIM_SPEED,
    STATE_VEL_STEER,
    STATE_VEL_TRANS,
    STATE_VEL_TURRET,
    Nomad200,
)
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig

PERIOD_S = 0.04


def make_nomad(scale: float = 1.0) -> tuple[Nomad200, Robot]:
    walls = Walls(width_m=140 * INCH_M, length_m=200 * INCH_M, body_radius_m=10 * INCH_M)
    robot = Robot(DriveConfig(), walls, watchdog_s=math.inf, odometry_scale=scale)
    nomad = Nomad200(robot, lambda: robot.advance(PERIOD_S), PERIOD_S)
    nomad.place_robot(700, 1000, 0, 0)
    return nomad, robot


def wait(nomad: Nomad200, timeout_s: int = 60) -> bool:
    return nomad.ws(translation=True, steering=True, turret=True, timeout_s=timeout_s)


def configuration(nomad: Nomad200) -> list[int]:
    return nomad.state[STATE_CONF_X : STATE_CONF_TURRET + 1]


def test_state_vector_has_its_length_and_speed() -> None:
    nomad, _ = make_nomad()
    assert len(nomad.state) == STATE_LENGTH == 45
    assert nomad.state[STATE_SIM_SPEED] == 10
    assert configuration(nomad) == [700, 1000, 0, 0]


def test_relative_move_in_tenths() -> None:
    nomad, robot = make_nomad()
    nomad.pr(100, 0, 0)
    assert wait(nomad)
    assert configuration(nomad) == [800, 1000, 0, 0]
    assert robot.x_m == pytest.approx(80 * INCH_M, abs=1e-12)


def test_axes_are_independent() -> None:
    nomad, robot = make_nomad()
    nomad.pr(0, 900, -450)
    assert wait(nomad)
    assert configuration(nomad) == [700, 1000, 900, 3150]
    assert robot.base_yaw_rad == 0.0
    nomad.pr(-50, 0, 0)
    assert wait(nomad)
    assert configuration(nomad) == [700, 950, 900, 3150]


def test_velocities_and_motor_bits() -> None:
    nomad, robot = make_nomad()
    nomad.vm(100, 0, -200)
    robot.advance(1.0)
    nomad.gs()
    assert nomad.state[STATE_VEL_TRANS] == 100
    assert nomad.state[STATE_VEL_STEER] == 0
    assert nomad.state[STATE_VEL_TURRET] == -200
    assert nomad.state[STATE_MOTOR_STATUS] == 0b101
    # A third of a second of ramp at 30 in/s^2: 1.667 in, then 6.667 in.
    assert nomad.state[STATE_CONF_X] == 783
    nomad.st()
    assert wait(nomad)
    assert nomad.state[STATE_MOTOR_STATUS] == 0
    assert nomad.state[STATE_CONF_X] == 800


def test_speed_and_acceleration_of_moves() -> None:
    nomad, robot = make_nomad()
    nomad.sp(50, 100, 100)
    nomad.ac(100, 300, 300)
    nomad.pr(100, 0, 0)  # 0.5 s up (1.25 in), 1.5 s at 5 in/s (7.5 in), 0.5 s down
    robot.advance(1.75)
    nomad.gs()
    assert nomad.state[STATE_VEL_TRANS] == 50
    assert nomad.state[STATE_CONF_X] == 775  # 1.25 in of ramp, 6.25 in
    robot.advance(0.75)
    nomad.gs()
    assert nomad.state[STATE_MOTOR_STATUS] == 0
    assert nomad.state[STATE_CONF_X] == 800


def test_speed_zero_means_no_move() -> None:
    nomad, _ = make_nomad()
    nomad.sp(0, 100, 100)
    nomad.pr(100, 100, 0)
    assert wait(nomad)
    assert configuration(nomad) == [700, 1000, 100, 0]


def test_waiting_ends_at_the_timeout() -> None:
    nomad, _ = make_nomad()
    nomad.vm(10, 0, 0)
    assert not wait(nomad, timeout_s=1)
    assert nomad.ws(translation=False, steering=True, turret=True, timeout_s=1)


def test_watchdog_stops_all_motion() -> None:
    nomad, robot = make_nomad()
    nomad.conf_tm(1)
    nomad.vm(60, 0, 200)
    robot.advance(10.0)
    # 0.2 s ramps: 0.6 in up, 0.8 s at 6 in/s, 0.6 in down.
    assert robot.x_m == pytest.approx(76.0 * INCH_M, abs=1e-12)
    assert not robot.turret.is_moving
    nomad.conf_tm(0)
    nomad.vm(10, 0, 0)
    robot.advance(5.0)
    assert robot.translation.is_moving


def test_bumper_bits() -> None:
    nomad, _ = make_nomad()
    nomad.pr(700, 0, 0)
    assert not wait(nomad, timeout_s=20)  # pushes against the wall at x = 140 in
    assert nomad.state[STATE_BUMPER] == (1 << 0) | (1 << 1) | (1 << 19)
    assert nomad.state[STATE_CONF_X] == 1300


def test_defining_moves_the_encoder_robot_alone() -> None:
    nomad, robot = make_nomad()
    nomad.dp(10, -20)
    nomad.da(900, 300)
    assert configuration(nomad) == [10, -20, 900, 300]
    assert robot.x_m == pytest.approx(70 * INCH_M, abs=1e-12)
    assert robot.heading_rad == 0.0
    nomad.pr(50, 0, 100)
    assert wait(nomad)
    assert configuration(nomad) == [10, 30, 900, 400]
    assert robot.x_m == pytest.approx(75 * INCH_M, abs=1e-12)


def test_zeroing_aligns_with_bumper_zero() -> None:
    nomad, robot = make_nomad()
    nomad.conf_tm(1)
    nomad.place_robot(700, 1000, 2000, 900)
    nomad.zr()
    assert configuration(nomad) == [0, 0, 0, 0]
    assert math.cos(robot.steering.position) == pytest.approx(1.0, abs=1e-15)
    assert math.cos(robot.turret.position) == pytest.approx(1.0, abs=1e-15)
    assert robot.x_m == pytest.approx(70 * INCH_M)


def test_two_robots_drift_apart() -> None:
    nomad, robot = make_nomad(scale=1.1)
    nomad.pr(100, 0, 0)
    assert wait(nomad)
    assert nomad.state[STATE_CONF_X] == 810
    assert robot.x_m == pytest.approx(80 * INCH_M, abs=1e-12)
    nomad.place_robot(300, 400, 450, 0)
    assert configuration(nomad) == [300, 400, 450, 0]
    assert robot.x_m == pytest.approx(30 * INCH_M, abs=1e-12)


def test_what_the_machine_cannot_take_is_refused() -> None:
    nomad, _ = make_nomad()
    with pytest.raises(ConfigurationError, match='whole numbers'):
        nomad.vm(1.5, 0, 0)  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError, match='conf_tm = 256'):
        nomad.conf_tm(256)
    with pytest.raises(ConfigurationError, match='ac'):
        nomad.ac(0, 300, 300)
    with pytest.raises(ConfigurationError, match='start_pose'):
        nomad.place_robot(0, 0, 0, 0)
