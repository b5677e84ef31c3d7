"""The host language of the Nomad 200: the commands and the state vector of Nclient.h.

Lengths are whole tenths of an inch, angles whole tenths of a degree, as on the machine.
`HostLanguage` is the interface. `Nomad200` implements it on the same `Robot` that the simulator
moves, so a program written in the host language runs in the arena; a class that sends the commands
over a serial line implements it as well. `HostBase`, the core of a driver node, offers SI units
on top of either.

The state vector contains the pose measured by the encoders; the true pose is available only as the
simulator's ground truth.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import compress
import math
from typing import Final, Protocol

from goalreach_msgs_py.angles import INCH_M, angle_difference, wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Odometry, Pose2, Twist2
from goalreach_sim.axis import Axis
from goalreach_sim.robot import Robot
from goalreach_sim.sensors import BUMPER_COUNT
from goalreach_sim.simulator_config import DriveConfig

STATE_SIM_SPEED: Final = 0
STATE_BUMPER: Final = 33
STATE_CONF_X: Final = 34
STATE_CONF_Y: Final = 35
STATE_CONF_STEER: Final = 36
STATE_CONF_TURRET: Final = 37
STATE_VEL_TRANS: Final = 38
STATE_VEL_STEER: Final = 39
STATE_VEL_TURRET: Final = 40
STATE_MOTOR_STATUS: Final = 41
STATE_LENGTH: Final = 45

_TENTH_INCH_M: Final = 0.1 * INCH_M
_TENTH_DEGREE_RAD: Final = math.radians(0.1)
_UNITS: Final = (_TENTH_INCH_M, _TENTH_DEGREE_RAD, _TENTH_DEGREE_RAD)
_TURN_TENTHS = 3600
_REAL_TIME = 10
_LONGEST_TIMEOUT_S = 255
"""A timeout is transmitted as one byte."""


class HostLanguage(Protocol):
    """The commands that `HostBase` uses; `Nomad200` documents them.

    Attributes:
        state: The state vector, refreshed by every command.
    """

    state: list[int]

    def gs(self) -> None:
        """Get the state."""

    def vm(self, translation: int, steering: int, turret: int) -> None:
        """Move at velocities."""

    def ac(self, translation: int, steering: int, turret: int) -> None:
        """Set accelerations."""

    def st(self) -> None:
        """Stop all axes."""

    def dp(self, x: int, y: int) -> None:
        """Define the position."""

    def da(self, steering: int, turret: int) -> None:
        """Define the angles."""

    def conf_tm(self, timeout_s: int) -> None:
        """Set the watchdog."""


class Nomad200:
    """The host language. Every command feeds the watchdog and refreshes the state vector.

    Args:
        robot: The robot, which other code may drive at the same time.
        advance: Simulates one period; `ws` and `zr` call it while they wait.
        period_s: Length of a period.

    Attributes:
        state: The state vector, `STATE_LENGTH` whole numbers: bit i of `STATE_BUMPER` is sensor
            i; configuration by the encoders; velocities; bits 0, 1, 2 of `STATE_MOTOR_STATUS`
            are set while translation, steering, turret move (their order is chosen, not from a
            source). Entries of sensors that this robot lacks are zero.
    """

    def __init__(self, robot: Robot, advance: Callable[[], None], period_s: float) -> None:
        self.state = [0] * STATE_LENGTH
        self._robot = robot
        self._advance = advance
        self._period_s = period_s
        self._turret_zero_rad = 0.0
        self._refresh()

    def gs(self) -> None:
        """Get the state."""
        self._done()

    def vm(self, translation: int, steering: int, turret: int) -> None:
        """Move at velocities: 0.1 in/s and 0.1 deg/s, until another command or the timeout."""
        for axis, unit, value in self._axes(translation, steering, turret):
            axis.go(unit * value)
        self._done()

    def sp(self, translation: int, steering: int, turret: int) -> None:
        """Set the speeds of relative moves: 0.1 in/s and 0.1 deg/s, clipped to the limits."""
        for axis, unit, value in self._axes(translation, steering, turret):
            axis.speed = min(abs(unit * value), axis.max_speed)
        self._done()

    def ac(self, translation: int, steering: int, turret: int) -> None:
        """Set accelerations: 0.1 in/s^2 and 0.1 deg/s^2; they take effect with the next motion.

        Raises:
            ConfigurationError: One is not positive.
        """
        for axis, unit, value in self._axes(translation, steering, turret):
            if value <= 0:
                raise ConfigurationError('ac', (translation, steering, turret), 'all positive')
            axis.acceleration = unit * value
        self._done()

    def pr(self, translation: int, steering: int, turret: int) -> None:
        """Move by distances: 0.1 inch and 0.1 degree, all axes at once."""
        for axis, unit, value in self._axes(translation, steering, turret):
            axis.move_by(unit * value)
        self._done()

    def st(self) -> None:
        """Stop all axes, ramping down."""
        self._robot.stop()
        self._done()

    def ws(self, *, translation: bool, steering: bool, turret: bool, timeout_s: int) -> bool:
        """Wait until the chosen axes are at rest; return False after a timeout.

        The watchdog keeps running and may end the motion early.

        Raises:
            ConfigurationError: The timeout is not in 0 to 255.
        """
        _check_timeout('ws', timeout_s)
        self._done()
        chosen = tuple(compress(self._robot.axes, (translation, steering, turret)))
        left = math.ceil(timeout_s / self._period_s)
        while left > 0 and any(axis.is_moving for axis in chosen):
            self._advance()
            left -= 1
        self._refresh()
        return not any(axis.is_moving for axis in chosen)

    def zr(self) -> None:
        """Align steering and turret with bumper zero, then set position and angles to zero.

        Returns when the axes are at rest; the watchdog does not interrupt it.
        """
        robot = self._robot
        robot.stop()
        self._wait()
        for axis in robot.axes[1:]:
            axis.move_by(-math.remainder(axis.position, math.tau))
        self._wait()
        robot.define_odometry(Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0))
        self._turret_zero_rad = robot.turret.position
        self._done()

    def dp(self, x: int, y: int) -> None:
        """Define the present position: 0.1 inch. The robot does not move."""
        _check_whole('dp', x, y)
        pose = self._robot.odometry.pose
        pose = replace(pose, x_m=x * _TENTH_INCH_M, y_m=y * _TENTH_INCH_M)
        self._robot.define_odometry(pose)
        self._done()

    def da(self, steering: int, turret: int) -> None:
        """Define the present angles: 0.1 degree. The robot does not move."""
        _check_whole('da', steering, turret)
        pose = self._robot.odometry.pose
        self._robot.define_odometry(replace(pose, heading_rad=steering * _TENTH_DEGREE_RAD))
        self._turret_zero_rad = self._robot.turret.position - turret * _TENTH_DEGREE_RAD
        self._done()

    def place_robot(self, x: int, y: int, steering: int, turret: int) -> None:
        """Put the robot and its odometry at a configuration of `map`.

        Bumper zero then points along +x.

        Raises:
            ConfigurationError: The body would overlap a wall.
        """
        _check_whole('place_robot', x, y, steering, turret)
        steering_rad = steering * _TENTH_DEGREE_RAD
        start = Pose2(x_m=x * _TENTH_INCH_M, y_m=y * _TENTH_INCH_M, heading_rad=steering_rad)
        turret_rad = turret * _TENTH_DEGREE_RAD
        self._robot.place(start, steering_rad=steering_rad, turret_rad=turret_rad)
        self._turret_zero_rad = 0.0
        self._done()

    def conf_tm(self, timeout_s: int) -> None:
        """Set the watchdog: time without a command after which all motion stops; 0 for never.

        Raises:
            ConfigurationError: The timeout is not in 0 to 255.
        """
        _check_timeout('conf_tm', timeout_s)
        self._robot.watchdog_s = float(timeout_s) if timeout_s else math.inf
        self._done()

    def _axes(
        self, translation: int, steering: int, turret: int
    ) -> Iterator[tuple[Axis, float, int]]:
        values = (translation, steering, turret)
        _check_whole('(translation, steering, turret)', *values)
        return zip(self._robot.axes, _UNITS, values, strict=True)

    def _wait(self) -> None:
        while any(axis.is_moving for axis in self._robot.axes):
            self._robot.feed_watchdog()
            self._advance()

    def _done(self) -> None:
        self._robot.feed_watchdog()
        self._refresh()

    def _refresh(self) -> None:
        robot, state = self._robot, self.state
        pose = robot.odometry.pose
        turret_rad = robot.turret.position - self._turret_zero_rad
        state[STATE_SIM_SPEED] = _REAL_TIME
        state[STATE_BUMPER] = sum(1 << i for i, pressed in enumerate(robot.bumpers) if pressed)
        state[STATE_CONF_X] = round(pose.x_m / _TENTH_INCH_M)
        state[STATE_CONF_Y] = round(pose.y_m / _TENTH_INCH_M)
        state[STATE_CONF_STEER] = round(pose.heading_rad / _TENTH_DEGREE_RAD) % _TURN_TENTHS
        state[STATE_CONF_TURRET] = round(turret_rad / _TENTH_DEGREE_RAD) % _TURN_TENTHS
        state[STATE_VEL_TRANS] = round(robot.translation.velocity / _TENTH_INCH_M)
        state[STATE_VEL_STEER] = round(robot.steering.velocity / _TENTH_DEGREE_RAD)
        state[STATE_VEL_TURRET] = round(robot.turret.velocity / _TENTH_DEGREE_RAD)
        moving = (axis.velocity != 0.0 for axis in robot.axes)
        state[STATE_MOTOR_STATUS] = sum(1 << i for i, moves in enumerate(moving) if moves)


def _check_whole(verb: str, *values: int) -> None:
    if any(isinstance(value, bool) or not isinstance(value, int) for value in values):
        raise ConfigurationError(verb, values, 'whole numbers')


def _check_timeout(verb: str, timeout_s: int) -> None:
    _check_whole(verb, timeout_s)
    if not 0 <= timeout_s <= _LONGEST_TIMEOUT_S:
        raise ConfigurationError(verb, timeout_s, f'in 0 to {_LONGEST_TIMEOUT_S} seconds')


class HostBase:
    """Commands a robot through its host language, once in a period.

    Args:
        robot: The robot, after `zr` has aligned its steering and turret.
        config: Limits of the axes; sets their accelerations.
        period_s: Time between two calls of `command`.
        timeout_s: Watchdog, in whole seconds as the language requires.
    """

    def __init__(
        self, robot: HostLanguage, config: DriveConfig, *, period_s: float, timeout_s: int = 1
    ) -> None:
        self._robot = robot
        self._config = config
        self._period_s = period_s
        robot.ac(
            _tenths_of_inch(config.translation_acceleration_m_per_s2),
            _tenths_of_degree(config.steering_acceleration_rad_per_s2),
            _tenths_of_degree(config.turret_acceleration_rad_per_s2),
        )
        robot.conf_tm(timeout_s)

    def define(self, start: Pose2) -> None:
        """Set the pose from which the encoders count, where a person has put the robot.

        The turret keeps its angle to the wheels.
        """
        turret_rad = start.heading_rad + self.turret_joint_rad
        self._robot.dp(_tenths_of_inch(start.x_m), _tenths_of_inch(start.y_m))
        self._robot.da(_tenths_of_degree(start.heading_rad), _tenths_of_degree(turret_rad))

    def command(self, drive: Twist2, turret_joint_rad: float) -> None:
        """Send velocities for all axes that turn the turret towards an angle in base_link.

        The turret's rate is the highest from which it can still brake in time and that does not
        pass the target within a period.

        Args:
            drive: Velocities; the robot clips them to its limits.
            turret_joint_rad: Target angle of the turret from the drive heading.
        """
        error_rad = angle_difference(turret_joint_rad, self.turret_joint_rad)
        braking = math.sqrt(2.0 * self._config.turret_acceleration_rad_per_s2 * abs(error_rad))
        rate = min(
            self._config.turret_speed_rad_per_s, braking, abs(error_rad) / (2.0 * self._period_s)
        )
        self._robot.vm(
            _tenths_of_inch(drive.linear_m_per_s),
            _tenths_of_degree(drive.steering_rad_per_s),
            _tenths_of_degree(math.copysign(rate, error_rad)),
        )

    def stop(self) -> None:
        """Ramp all axes to rest."""
        self._robot.st()

    def refresh(self) -> None:
        """Read the state vector, from which the properties are derived."""
        self._robot.gs()

    @property
    def odometry(self) -> Odometry:
        """Pose and velocity by the encoders, in `odom`; resolution 0.1 inch and 0.1 degree."""
        state = self._robot.state
        pose = Pose2(
            x_m=state[STATE_CONF_X] * _TENTH_INCH_M,
            y_m=state[STATE_CONF_Y] * _TENTH_INCH_M,
            heading_rad=wrap_angle(state[STATE_CONF_STEER] * _TENTH_DEGREE_RAD),
        )
        speed = state[STATE_VEL_TRANS] * _TENTH_INCH_M
        rate = state[STATE_VEL_STEER] * _TENTH_DEGREE_RAD
        return Odometry(pose=pose, twist=Twist2(linear_m_per_s=speed, steering_rad_per_s=rate))

    @property
    def turret_joint_rad(self) -> float:
        """Angle of the turret in base_link (from the drive heading), in (-pi, pi]."""
        state = self._robot.state
        return wrap_angle((state[STATE_CONF_TURRET] - state[STATE_CONF_STEER]) * _TENTH_DEGREE_RAD)

    @property
    def bumpers(self) -> tuple[bool, ...]:
        """The 20 tactile sensors; sensor i sits at 18 i degrees on the base."""
        bits = self._robot.state[STATE_BUMPER]
        return tuple(bool(bits >> index & 1) for index in range(BUMPER_COUNT))


def _tenths_of_inch(length_m: float) -> int:
    return round(length_m / _TENTH_INCH_M)


def _tenths_of_degree(angle_rad: float) -> int:
    return round(angle_rad / _TENTH_DEGREE_RAD)
