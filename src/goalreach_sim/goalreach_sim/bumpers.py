"""The 20 tactile sensors around the base.

Two rings of ten; sensor i sits at 18 i degrees on the base, which does not turn when the wheels
steer, and covers 36 degrees, so each overlaps its neighbours by half (Player project, nomad
driver).
"""

from __future__ import annotations

from collections.abc import Iterable
import math

from goalreach_msgs_py.angles import angle_difference

__all__ = ['BUMPER_COUNT', 'BUMPER_SPACING_RAD', 'pressed_bumpers']

BUMPER_COUNT = 20
BUMPER_SPACING_RAD = math.radians(18.0)
_HALF_ARC_RAD = math.radians(18.0)
_EDGE_RAD = 1e-9
"""The ends of an arc belong to it, whatever the rounding."""

_NONE_PRESSED = (False,) * BUMPER_COUNT


def pressed_bumpers(directions_rad: Iterable[float], base_yaw_rad: float) -> tuple[bool, ...]:
    """Return which sensors are pressed.

    Args:
        directions_rad: Azimuths in `map` in which the body touches something.
        base_yaw_rad: Orientation of the base in `map`; not the drive heading.

    Returns:
        20 flags; every sensor whose arc, ends included, covers a direction is pressed.
    """
    pressed = set()
    for direction_rad in directions_rad:
        bearing_rad = direction_rad - base_yaw_rad
        for index in range(BUMPER_COUNT):
            offset_rad = angle_difference(bearing_rad, index * BUMPER_SPACING_RAD)
            if abs(offset_rad) <= _HALF_ARC_RAD + _EDGE_RAD:
                pressed.add(index)
    return tuple(index in pressed for index in range(BUMPER_COUNT)) if pressed else _NONE_PRESSED
