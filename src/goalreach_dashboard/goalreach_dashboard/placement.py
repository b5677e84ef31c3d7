"""Checks of values from a browser: where the robot is to be placed, how fast it is to drive."""

import math
from typing import Final

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import is_number
from goalreach_msgs_py.values import Pose2

_MAX_SPEED: Final = 100.0
_MIN_SPEED: Final = 0.01
_POSE: Final = ('x, m', 'y, m', 'heading, degrees')


def checked_pose(value: object, arena: Arena) -> Pose2:
    """Return a pose on the free floor.

    Args:
        value: What a browser sent: x and y, metres, and the heading, degrees.
        arena: The arena.

    Raises:
        ConfigurationError: Anything else was sent, or the pose is not on the free floor.
    """
    if not isinstance(value, list) or len(value) != len(_POSE):
        raise ConfigurationError('place', value, ', '.join(_POSE))
    x_m, y_m, heading_deg = (checked_number(*each) for each in zip(_POSE, value, strict=True))
    pose = Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(math.radians(heading_deg)))
    if not arena.is_free(pose.x_m, pose.y_m):
        raise ConfigurationError('place', (pose.x_m, pose.y_m), 'on the free floor')
    return pose


def checked_speed(value: object) -> float:
    """Return a speed, simulated seconds per second of the wall clock.

    Raises:
        ConfigurationError: It is not a number from 0.01 to 100.
    """
    speed = checked_number('speed', value)
    if not _MIN_SPEED <= speed <= _MAX_SPEED:
        raise ConfigurationError('speed', speed, 'from 0.01 to 100')
    return speed


def checked_choice(name: str, value: object, choices: tuple[str, ...]) -> str:
    """Return one of the choices.

    Raises:
        ConfigurationError: It is not among them.
    """
    if not isinstance(value, str) or value not in choices:
        raise ConfigurationError(name, value, 'one of ' + ', '.join(choices))
    return value


def checked_number(name: str, value: object) -> float:
    """Return a finite number.

    Raises:
        ConfigurationError: It is not one.
    """
    if not is_number(value):
        raise ConfigurationError(name, value, 'a finite number')
    return float(value)
