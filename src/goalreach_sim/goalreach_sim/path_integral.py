"""Displacement of a robot with constant linear and angular acceleration.

With speed v0 + a t and heading h0 + w t + c t^2 / 2 the position is a Fresnel-like integral
without an elementary form. Five-point Gauss-Legendre quadrature over panels in which the heading
turns by at most a quarter radian has an error of about 1e-13 of the distance (its remainder is
2e-13 times the tenth derivative over a unit panel, at worst about 945 (0.25)^5) and counts as
exact.
"""

import math
from typing import NamedTuple

from goalreach_sim.axis import DONE_S

# Abscissae and weights on [-1, 1]: Abramowitz and Stegun, table 25.4; then the same on [0, 1].
_ROOT = 2.0 * math.sqrt(10.0 / 7.0)
_INNER, _OUTER = math.sqrt(5.0 - _ROOT) / 3.0, math.sqrt(5.0 + _ROOT) / 3.0
_INNER_WEIGHT = (322.0 + 13.0 * math.sqrt(70.0)) / 900.0
_OUTER_WEIGHT = (322.0 - 13.0 * math.sqrt(70.0)) / 900.0
_ABSCISSAE = (-_OUTER, -_INNER, 0.0, _INNER, _OUTER)
_WEIGHTS = (_OUTER_WEIGHT, _INNER_WEIGHT, 128.0 / 225.0, _INNER_WEIGHT, _OUTER_WEIGHT)
_NODES = [(0.5 + 0.5 * x, 0.5 * w) for x, w in zip(_ABSCISSAE, _WEIGHTS, strict=True)]

PANEL_RAD = 0.25
_QUARTER_RAD = math.pi / 2.0


class Motion(NamedTuple):
    """A motion with constant accelerations, from heading, rates and speed at its start.

    A tuple, since every piece of a drive makes one. The speed is negative backwards.
    """

    heading_rad: float
    turn_rad_per_s: float
    turn_rad_per_s2: float
    speed_m_per_s: float
    acceleration_m_per_s2: float


def displacement(motion: Motion, dt_s: float) -> tuple[float, float]:
    """Return the displacement along x and y over a time, metres."""
    heading_rad, turn_rad_per_s, turn_rad_per_s2, speed_m_per_s, acceleration_m_per_s2 = motion
    if turn_rad_per_s == 0.0 and turn_rad_per_s2 == 0.0:
        distance_m = (speed_m_per_s + 0.5 * acceleration_m_per_s2 * dt_s) * dt_s
        return distance_m * math.cos(heading_rad), distance_m * math.sin(heading_rad)
    turn_rad = (abs(turn_rad_per_s) + abs(turn_rad_per_s2) * dt_s) * dt_s
    panels = math.ceil(turn_rad / PANEL_RAD) or 1
    panel_s = dt_s / panels
    x_m = y_m = 0.0
    for panel in range(panels):
        for node, weight in _NODES:
            t = (panel + node) * panel_s
            angle = heading_rad + (turn_rad_per_s + 0.5 * turn_rad_per_s2 * t) * t
            step_m = weight * (speed_m_per_s + acceleration_m_per_s2 * t)
            x_m += step_m * math.cos(angle)
            y_m += step_m * math.sin(angle)
    return x_m * panel_s, y_m * panel_s


def quarter_turn_time(motion: Motion, limit_s: float) -> float:
    """Return when the heading next passes a multiple of a quarter turn, at most `limit_s`.

    Until then x and y are monotonic in time for a robot that does not change direction.
    """
    heading_rad, turn_rad_per_s, turn_rad_per_s2, _, _ = motion
    if turn_rad_per_s == 0.0 and turn_rad_per_s2 == 0.0:
        return limit_s
    nearest = round(heading_rad / _QUARTER_RAD)
    for quarter in (nearest - 1, nearest, nearest + 1):
        offset_rad = heading_rad - quarter * _QUARTER_RAD
        for root_s in _roots(0.5 * turn_rad_per_s2, turn_rad_per_s, offset_rad):
            if DONE_S < root_s < limit_s:  # an earlier one lies at the start itself
                limit_s = root_s
    return limit_s


def _roots(a: float, b: float, c: float) -> tuple[float, ...]:
    """Return the real roots of a t^2 + b t + c, without cancellation; none of a constant."""
    if a == 0.0:
        return () if b == 0.0 else (-c / b,)
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return ()
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    return (q / a, c / q) if q != 0.0 else (0.0,)
