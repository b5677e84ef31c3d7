import math

import numpy as np
import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_sim.host_base import HostBase
from goalreach_sim.nomad200 import STATE_LENGTH
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import DriveConfig, SimulatorConfig

TENTH_IN_M = 0.00254
TENTH_DEG = math.radians(0.1)
START = Pose2(x_m=1.778, y_m=3.0, heading_rad=0.5)


class Recorder:
    """A robot on paper: notes what is said to it."""

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
    base = HostBase(simulator.nomad, DriveConfig(), period_s=0.04)
    base.define(START)
    return simulator, base


def test_speaks_in_tenths() -> None:
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


def test_a_bumper_tells_of_a_wall() -> None:
    simulator, base = simulated()
    base.define(START)
    for _ in range(300):
        base.command(twist(0.4), 0.0)
        simulator.advance()
    base.refresh()
    assert base.bumpers == simulator.robot.bumpers
    assert any(base.bumpers)
