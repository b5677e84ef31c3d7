"""What a person may ask of the graph, read from what a browser sent: checked before it counts."""

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
_LARGEST_SPEED: Final = 100.0
_SMALLEST_SPEED: Final = 0.01
_DRAG_CM: Final = 12.0
_FACING_GOAL_WALL_RAD: Final = -math.pi / 2


@dataclass(frozen=True, kw_only=True)
class PauseRequest:
    """Stop the clock, or let it go on."""

    paused: bool


@dataclass(frozen=True, kw_only=True)
class PlaceRequest:
    """Put the robot at a pose."""

    pose: Pose2


@dataclass(frozen=True, kw_only=True)
class SpeedRequest:
    """Simulate so many seconds in one of the wall's."""

    speed: float


@dataclass(frozen=True, kw_only=True)
class ModeRequest:
    """Drive crisp, or blend in one of three ways."""

    mode: str


@dataclass(frozen=True, kw_only=True)
class NoiseRequest:
    """Make the sensors as wrong as a preset says."""

    preset: str


Request = PauseRequest | PlaceRequest | SpeedRequest | ModeRequest | NoiseRequest


def place_request(x_m: object, y_m: object, heading_rad: object, arena: Arena) -> PlaceRequest:
    """Return the request to put the robot at a pose.

    Raises:
        ConfigurationError: A value is no finite number, or the pose is not on the free floor.
    """
    pose = Pose2(
        x_m=_number('x', x_m),
        y_m=_number('y', y_m),
        heading_rad=_number('heading', heading_rad),
    )
    if not arena.is_free(pose.x_m, pose.y_m):
        raise ConfigurationError('place', (pose.x_m, pose.y_m), 'on the free floor')
    return PlaceRequest(pose=pose)


def place_request_from_picture(sent: object, arena: Arena) -> PlaceRequest:
    """Return the request of a press on the arena's picture.

    Args:
        sent: `x`, `y` of the press and `dx`, `dy` to where it was let go, in the picture's
            centimetres; a drag of 12 cm and more gives the heading, else it is the goal wall's.
        arena: The arena of the picture.

    Raises:
        ConfigurationError: Anything else was sent, or the pose is not on the free floor.
    """
    if not isinstance(sent, Mapping):
        raise ConfigurationError('place', sent, 'x, y, dx and dy')
    x, y, dx, dy = (_number(name, sent.get(name)) for name in ('x', 'y', 'dx', 'dy'))
    dragged = math.hypot(dx, dy) >= _DRAG_CM
    heading_rad = wrap_angle(math.atan2(-dy, dx)) if dragged else _FACING_GOAL_WALL_RAD
    return place_request(x / 100.0, arena.length_m - y / 100.0, heading_rad, arena)


def speed_request(sent: object) -> SpeedRequest:
    """Return the request for a speed.

    Raises:
        ConfigurationError: It is no number from 0.01 to 100.
    """
    speed = _number('speed', sent)
    if not _SMALLEST_SPEED <= speed <= _LARGEST_SPEED:
        raise ConfigurationError('speed', speed, 'from 0.01 to 100')
    return SpeedRequest(speed=speed)


def mode_request(sent: object) -> ModeRequest:
    """Return the request for a mode.

    Raises:
        ConfigurationError: There is no such mode.
    """
    return ModeRequest(mode=_one_of('mode', sent, MODES))


def noise_request(sent: object) -> NoiseRequest:
    """Return the request for a noise preset.

    Raises:
        ConfigurationError: There is no such preset.
    """
    return NoiseRequest(preset=_one_of('noise', sent, NOISE_PRESETS))


def _one_of(name: str, sent: object, allowed: tuple[str, ...]) -> str:
    if not isinstance(sent, str) or sent not in allowed:
        raise ConfigurationError(name, sent, 'one of ' + ', '.join(allowed))
    return sent


def _number(name: str, sent: Any) -> float:  # noqa: ANN401 - whatever a browser sends
    if type(sent) not in (int, float) or not math.isfinite(sent):
        raise ConfigurationError(name, sent, 'a finite number')
    return float(sent)
