"""Angles in radians, counter-clockwise, wrapped to (-pi, pi] (REP-103); inches in metres."""

import math


def wrap_angle(angle_rad: float) -> float:
    """Return the angle in (-pi, pi] that points the same way as a finite one, radians.

    >>> wrap_angle(3 * math.pi)
    3.141592653589793
    """
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped <= -math.pi else wrapped


def angle_difference(to_rad: float, from_rad: float) -> float:
    """Return the shortest turn from `from_rad` to `to_rad`, in (-pi, pi], counter-clockwise."""
    return wrap_angle(to_rad - from_rad)


INCH_M = 0.0254
"""One inch in metres (exact by definition)."""


def inches(value_in: float) -> float:
    """Return a length given in inches as metres.

    >>> inches(140)
    3.556
    """
    return round(value_in * INCH_M, 12)


def deg(value_deg: float) -> float:
    """Return an angle given in degrees as radians."""
    return math.radians(value_deg)
