"""Angles in radians, counter-clockwise, wrapped to (-pi, pi] (REP-103)."""

from __future__ import annotations

import math

__all__ = ['angle_difference', 'wrap_angle']

_TURN_RAD = 2.0 * math.pi


def wrap_angle(angle_rad: float) -> float:
    """Return the angle in (-pi, pi] that points the same way.

    Args:
        angle_rad: Any finite angle, radians.

    Returns:
        The wrapped angle, radians.

    >>> wrap_angle(3 * math.pi)
    3.141592653589793
    """
    wrapped = math.remainder(angle_rad, _TURN_RAD)
    return math.pi if wrapped <= -math.pi else wrapped


def angle_difference(to_rad: float, from_rad: float) -> float:
    """Return the shortest turn that leads from one heading to another.

    Args:
        to_rad: Heading to reach, radians.
        from_rad: Heading to start from, radians.

    Returns:
        The turn in (-pi, pi], radians, positive counter-clockwise.
    """
    return wrap_angle(to_rad - from_rad)
