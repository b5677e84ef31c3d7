"""The mobile base in SI units on top of the host language: the core of a driver node.

`HostLanguage` is the interface: the simulated `Nomad200` implements it, as would a class that
sends the commands over a serial line. `HostBase` uses only this interface.
"""

from __future__ import annotations

import math
from typing import Final, Protocol

from goalreach_msgs_py.angles import INCH_M, angle_difference, wrap_angle
from goalreach_msgs_py.values import Odometry, Pose2, Twist2
from goalreach_sim.nomad200 import (
    STATE_BUMPER,
    STATE_CONF_STEER,
    STATE_CONF_TURRET,
    STATE_CONF_X,
    STATE_CONF_Y,
    STATE_VEL_STEER,
    STATE_VEL_TRANS,
)
from goalreach_sim.sensors import BUMPER_COUNT
from goalreach_sim.simulator_config import DriveConfig

_TENTH_INCH_M: Final = 0.1 * INCH_M
_TENTH_DEGREE_RAD: Final = math.radians(0.1)


class HostLanguage(Protocol):
    """The commands that `HostBase` uses, as documented at `Nomad200`.

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
        return Odometry(
            pose=Pose2(
                x_m=state[STATE_CONF_X] * _TENTH_INCH_M,
                y_m=state[STATE_CONF_Y] * _TENTH_INCH_M,
                heading_rad=wrap_angle(state[STATE_CONF_STEER] * _TENTH_DEGREE_RAD),
            ),
            twist=Twist2(
                linear_m_per_s=state[STATE_VEL_TRANS] * _TENTH_INCH_M,
                steering_rad_per_s=state[STATE_VEL_STEER] * _TENTH_DEGREE_RAD,
            ),
        )

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
