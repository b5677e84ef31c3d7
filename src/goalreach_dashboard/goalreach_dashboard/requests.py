"""Requests that a person makes on the page; values from a browser are checked on construction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any, Final

from goalreach_learning.blending import MODES
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NOISE_PRESETS
from goalreach_msgs_py.values import Pose2

SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
_MAX_SPEED: Final = 100.0
_MIN_SPEED: Final = 0.01
_MIN_DRAG_CM: Final = 12.0
_FACING_GOAL_WALL_RAD: Final = -math.pi / 2


@dataclass(frozen=True, kw_only=True)
class PauseRequest:
    """Pause the simulation or resume it."""

    paused: bool


@dataclass(frozen=True, kw_only=True)
class PlaceRequest:
    """Place the robot at a pose."""

    pose: Pose2

    @classmethod
    def at(cls, x_m: object, y_m: object, heading_rad: object, arena: Arena) -> PlaceRequest:
        """Return the request for a pose.

        Raises:
            ConfigurationError: A value is not a finite number, or the pose is not on the free
                floor.
        """
        pose = Pose2(
            x_m=_number('x', x_m),
            y_m=_number('y', y_m),
            heading_rad=_number('heading', heading_rad),
        )
        if not arena.is_free(pose.x_m, pose.y_m):
            raise ConfigurationError('place', (pose.x_m, pose.y_m), 'on the free floor')
        return cls(pose=pose)

    @classmethod
    def from_drag(cls, drag: object, arena: Arena) -> PlaceRequest:
        """Return the request of a press or drag on the arena's picture.

        Args:
            drag: `x`, `y` of the press and `dx`, `dy` to the release, in the picture's
                centimetres. A drag of at least 12 cm gives the heading; without one the robot
                faces the goal wall.
            arena: The arena of the picture.

        Raises:
            ConfigurationError: Anything else was sent, or the pose is not on the free floor.
        """
        if not isinstance(drag, Mapping):
            raise ConfigurationError('place', drag, 'x, y, dx and dy')
        x, y, dx, dy = (_number(name, drag.get(name)) for name in ('x', 'y', 'dx', 'dy'))
        dragged = math.hypot(dx, dy) >= _MIN_DRAG_CM
        heading_rad = wrap_angle(math.atan2(-dy, dx)) if dragged else _FACING_GOAL_WALL_RAD
        return cls.at(x / 100.0, arena.length_m - y / 100.0, heading_rad, arena)


@dataclass(frozen=True, kw_only=True)
class SpeedRequest:
    """Set the simulated seconds per second of the wall clock, from 0.01 to 100."""

    speed: float

    def __post_init__(self) -> None:
        """Check the speed."""
        if not _MIN_SPEED <= _number('speed', self.speed) <= _MAX_SPEED:
            raise ConfigurationError('speed', self.speed, 'from 0.01 to 100')


@dataclass(frozen=True, kw_only=True)
class ModeRequest:
    """Drive in one of the controller's modes."""

    mode: str

    def __post_init__(self) -> None:
        """Check the mode."""
        _require_one_of('mode', self.mode, MODES)


@dataclass(frozen=True, kw_only=True)
class NoiseRequest:
    """Set the sensor noise to a preset."""

    preset: str

    def __post_init__(self) -> None:
        """Check the preset."""
        _require_one_of('noise', self.preset, NOISE_PRESETS)


Request = PauseRequest | PlaceRequest | SpeedRequest | ModeRequest | NoiseRequest


def _require_one_of(name: str, value: object, allowed: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in allowed:
        raise ConfigurationError(name, value, 'one of ' + ', '.join(allowed))


def _number(name: str, value: Any) -> float:  # noqa: ANN401 - whatever a browser sends
    if type(value) not in (int, float) or not math.isfinite(value):
        raise ConfigurationError(name, value, 'a finite number')
    return float(value)
