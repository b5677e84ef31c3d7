"""From a heading error to speed and steering rate, within what the drive can do."""

from __future__ import annotations

import math

__all__ = ['cruise_fraction', 'steering_rate']


def steering_rate(
    error_rad: float, *, gain_per_s: float, limit_rad_per_s: float, braking_rad_per_s2: float
) -> float:
    """Return the steering rate that removes a heading error without overshoot, rad/s.

    Proportional near zero; farther out the rate from which the steering axis can still stop in
    time, sqrt(2 a (|e| - e0 / 2)), which continues the straight part smoothly at e0 = a / gain^2;
    never above the limit.

    Args:
        error_rad: Heading wanted minus heading, radians in (-pi, pi].
        gain_per_s: Slope of the proportional part, 1/s.
        limit_rad_per_s: Largest rate.
        braking_rad_per_s2: a, the deceleration to count on.
    """
    size = abs(error_rad)
    linear_rad = braking_rad_per_s2 / gain_per_s**2
    if size <= linear_rad:
        rate = gain_per_s * size
    else:
        rate = math.sqrt(2.0 * braking_rad_per_s2 * (size - linear_rad / 2.0))
    return math.copysign(min(rate, limit_rad_per_s), error_rad)


def cruise_fraction(error_rad: float, stop_error_rad: float) -> float:
    """Return the share of the cruising speed to drive at, in [0, 1].

    One when on course, zero from `stop_error_rad` on, smooth between: the cosine of the error
    stretched to that range.

    Args:
        error_rad: Heading error, radians.
        stop_error_rad: Error at which the robot turns on the spot, radians.
    """
    stop = math.cos(stop_error_rad)
    return max(0.0, (math.cos(error_rad) - stop) / (1.0 - stop))
