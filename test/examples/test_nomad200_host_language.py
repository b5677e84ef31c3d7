import math

from nomad200_host_language import (
    STATE_BUMPER,
    STATE_CONF_TURRET,
    STATE_CONF_X,
    STATE_LENGTH,
    STATE_MOTOR_STATUS,
    STATE_SIM_SPEED,
    STATE_VEL_STEER,
    STATE_VEL_TRANS,
    STATE_VEL_TURRET,
    HostBase,
    Nomad200,
)
import numpy as np
import pytest

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.robot import Robot
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import DriveConfig, SimulatorConfig
from goalreach_sim.walls import Walls

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


def test_defining_changes_the_odometry_alone() -> None:
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


def test_odometry_drifts_from_the_truth() -> None:
    nomad, robot = make_nomad(scale=1.1)
    nomad.pr(100, 0, 0)
    assert wait(nomad)
    assert nomad.state[STATE_CONF_X] == 810
    assert robot.x_m == pytest.approx(80 * INCH_M, abs=1e-12)
    nomad.place_robot(300, 400, 450, 0)
    assert configuration(nomad) == [300, 400, 450, 0]
    assert robot.x_m == pytest.approx(30 * INCH_M, abs=1e-12)


def test_invalid_arguments_are_refused() -> None:
    nomad, _ = make_nomad()
    with pytest.raises(ConfigurationError, match='whole numbers'):
        nomad.vm(1.5, 0, 0)  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError, match='conf_tm = 256'):
        nomad.conf_tm(256)
    with pytest.raises(ConfigurationError, match='ac'):
        nomad.ac(0, 300, 300)
    with pytest.raises(ConfigurationError, match='start_pose'):
        nomad.place_robot(0, 0, 0, 0)


TENTH_IN_M = 0.00254
TENTH_DEG = math.radians(0.1)
START = Pose2(x_m=1.778, y_m=3.0, heading_rad=0.5)


class Recorder:
    """A host language that records its calls."""

    def __init__(self) -> None:
        self.state = [0] * STATE_LENGTH
        self.said: list[tuple[str, tuple[int, ...]]] = []

    def gs(self) -> None:
        self.said.append(('gs', ()))

    def vm(self, translation: int, steering: int, turret: int) -> None:
        self.said.append(('vm', (translation, steering, turret)))

    def ac(self, translation: int, steering: int, turret: int) -> None:
        self.said.append(('ac', (translation, steering, turret)))

    def st(self) -> None:
        self.said.append(('st', ()))

    def dp(self, x: int, y: int) -> None:
        self.said.append(('dp', (x, y)))

    def da(self, steering: int, turret: int) -> None:
        self.said.append(('da', (steering, turret)))

    def conf_tm(self, timeout_s: int) -> None:
        self.said.append(('conf_tm', (timeout_s,)))


def twist(linear: float, steering: float = 0.0) -> Twist2:
    return Twist2(linear_m_per_s=linear, steering_rad_per_s=steering)


def simulated() -> tuple[Simulator, HostBase]:
    config = SimulatorConfig.for_arena(Arena(), noise_preset('none'))
    simulator = Simulator(config, np.random.default_rng(0))
    simulator.reset(START)
    nomad = Nomad200(simulator.robot, simulator.advance, 0.04)
    base = HostBase(nomad, DriveConfig(), period_s=0.04)
    base.define(START)
    return simulator, base


def test_commands_in_tenths() -> None:
    robot = Recorder()
    base = HostBase(robot, DriveConfig(), period_s=0.04)
    assert robot.said == [('ac', (300, 300, 300)), ('conf_tm', (1,))]
    robot.said.clear()
    base.define(Pose2(x_m=0.254, y_m=-0.0254, heading_rad=math.pi / 2))
    base.command(twist(0.508, math.radians(-12.3)), 0.0)
    base.stop()
    base.refresh()
    assert robot.said == [
        ('dp', (100, -10)),
        ('da', (900, 900)),
        ('vm', (200, -123, 0)),
        ('st', ()),
        ('gs', ()),
    ]


def test_reads_the_state_vector() -> None:
    robot = Recorder()
    base = HostBase(robot, DriveConfig(), period_s=0.04)
    robot.state[33:41] = [0b1000_0000_0000_0000_0101, 100, -50, 2700, 1800, 200, -300, 0]
    odometry = base.odometry
    assert (odometry.pose.x_m, odometry.pose.y_m) == pytest.approx((0.254, -0.127))
    assert odometry.pose.heading_rad == pytest.approx(-math.pi / 2)
    assert odometry.twist.linear_m_per_s == pytest.approx(0.508)
    assert odometry.twist.steering_rad_per_s == pytest.approx(math.radians(-30))
    assert base.turret_joint_rad == pytest.approx(-math.pi / 2)
    assert [i for i, pressed in enumerate(base.bumpers) if pressed] == [0, 2, 19]


def test_drives_the_simulated_robot_as_its_si_commands_do() -> None:
    simulator, base = simulated()
    config = SimulatorConfig.for_arena(Arena(), noise_preset('none'))
    other = Simulator(config, np.random.default_rng(0))
    other.reset(START)
    for step in range(100):
        # Whole tenths, so that rounding plays no part.
        command = twist(100 * TENTH_IN_M, 200 * TENTH_DEG * (1 if step < 50 else -1))
        base.command(command, 0.0)
        other.command_drive(command)
        simulator.advance()
        other.advance()
        base.refresh()
        odometry, truth = base.odometry, other.robot.odometry
        assert odometry.pose.x_m == pytest.approx(truth.pose.x_m, abs=1.1 * TENTH_IN_M)
        assert odometry.pose.y_m == pytest.approx(truth.pose.y_m, abs=1.1 * TENTH_IN_M)
        turned = odometry.pose.heading_rad - truth.pose.heading_rad
        assert math.sin(turned) == pytest.approx(0.0, abs=1.1 * TENTH_DEG)


@pytest.mark.parametrize('target_deg', [90.0, -170.0, 3.0])
def test_the_turret_reaches_its_target_while_the_wheels_steer(target_deg: float) -> None:
    simulator, base = simulated()
    target_rad = math.radians(target_deg)
    gaps = []
    for step in range(250):
        base.command(twist(0.1, math.radians(20.0) if step < 75 else 0.0), target_rad)
        simulator.advance()
        base.refresh()
        gaps.append(math.remainder(base.turret_joint_rad - target_rad, math.tau))
    assert abs(gaps[-1]) <= 1.01 * TENTH_DEG
    # Once there it does not swing past by more than a degree.
    assert max(map(abs, gaps[-60:])) < math.radians(1.0)


def test_a_bumper_reports_a_wall() -> None:
    simulator, base = simulated()
    base.define(START)
    for _ in range(300):
        base.command(twist(0.4), 0.0)
        simulator.advance()
    base.refresh()
    assert base.bumpers == simulator.robot.bumpers
    assert any(base.bumpers)
