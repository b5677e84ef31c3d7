"""Checks of values from a browser: where the robot is to be placed, how fast it is to drive."""

from collections.abc import Mapping
import math
from typing import Final

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import FACING_GOAL_WALL_RAD, Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import is_number
from goalreach_msgs_py.values import Pose2

_MAX_SPEED: Final = 100.0
_MIN_SPEED: Final = 0.01
_MIN_DRAG_CM: Final = 12.0


def checked_pose(x_m: object, y_m: object, heading_rad: object, arena: Arena) -> Pose2:
    """Return a pose on the free floor.

    Raises:
        ConfigurationError: A value is not a finite number, or the pose is not on the free floor.
    """
    pose = Pose2(
        x_m=checked_number('x', x_m),
        y_m=checked_number('y', y_m),
        heading_rad=checked_number('heading', heading_rad),
    )
    if not arena.is_free(pose.x_m, pose.y_m):
        raise ConfigurationError('place', (pose.x_m, pose.y_m), 'on the free floor')
    return pose


def dragged_pose(drag: object, arena: Arena) -> Pose2:
    """Return the pose of a press or drag on the arena's picture.

    Args:
        drag: `x`, `y` of the press and `dx`, `dy` to the release, in the picture's centimetres. A
            drag of at least 12 cm gives the heading; without one the robot faces the goal wall.
        arena: The arena of the picture.

    Raises:
        ConfigurationError: Anything else was sent, or the pose is not on the free floor.
    """
    if not isinstance(drag, Mapping):
        raise ConfigurationError('place', drag, 'x, y, dx and dy')
    x, y, dx, dy = (checked_number(name, drag.get(name)) for name in ('x', 'y', 'dx', 'dy'))
    dragged = math.hypot(dx, dy) >= _MIN_DRAG_CM
    heading_rad = wrap_angle(math.atan2(-dy, dx)) if dragged else FACING_GOAL_WALL_RAD
    return checked_pose(x / 100.0, arena.length_m - y / 100.0, heading_rad, arena)


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
