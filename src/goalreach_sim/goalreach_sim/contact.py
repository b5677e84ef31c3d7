"""Contact of a round robot with the walls of a rectangular arena."""

from __future__ import annotations

from collections.abc import Callable
import math

TOUCH_M = 1e-12
"""Largest gap that counts as contact; chosen, a thousand times the rounding of a coordinate."""

GRAZE = 1e-13
"""A motion with a smaller component into the wall runs along it; chosen."""

BISECTIONS = 60


class Walls:
    """The rectangle to which the walls confine the robot's centre.

    Args:
        width_m: Arena size along x.
        length_m: Arena size along y.
        body_radius_m: Radius of the robot.
    """

    def __init__(self, *, width_m: float, length_m: float, body_radius_m: float) -> None:
        self.low_x_m = self.low_y_m = body_radius_m
        self.high_x_m = width_m - body_radius_m
        self.high_y_m = length_m - body_radius_m

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Return the gap between body and nearest wall, negative where they overlap."""
        return min(self.gaps_m(x_m, y_m))

    def gaps_m(self, x_m: float, y_m: float) -> tuple[float, float, float, float]:
        """Return the gap to each wall, in the order of small x, large x, small y, large y."""
        return (
            x_m - self.low_x_m,
            self.high_x_m - x_m,
            y_m - self.low_y_m,
            self.high_y_m - y_m,
        )

    def passed(self, x_m: float, y_m: float) -> tuple[int, ...]:
        """Return the indices (see `gaps_m`) of the walls that the body overlaps.

        A wall that is overlapped by less than rounding is one along which the robot slides.
        """
        return tuple(i for i, gap_m in enumerate(self.gaps_m(x_m, y_m)) if gap_m < -TOUCH_M)

    def gap_m(self, walls: tuple[int, ...], x_m: float, y_m: float) -> float:
        """Return the smallest gap to the given walls."""
        gaps_m = self.gaps_m(x_m, y_m)
        return min(gaps_m[wall] for wall in walls)

    def blocks(self, x_m: float, y_m: float, direction_x: float, direction_y: float) -> bool:
        """Return whether a touched wall stops motion in a direction (a unit vector)."""
        return (
            (direction_x < -GRAZE and x_m - self.low_x_m <= TOUCH_M)
            or (direction_x > GRAZE and self.high_x_m - x_m <= TOUCH_M)
            or (direction_y < -GRAZE and y_m - self.low_y_m <= TOUCH_M)
            or (direction_y > GRAZE and self.high_y_m - y_m <= TOUCH_M)
        )

    def touch_directions_rad(self, x_m: float, y_m: float) -> tuple[float, ...]:
        """Return the azimuths in `map` in which the body touches walls; two in a corner."""
        gaps = (
            (self.high_x_m - x_m, 0.0),
            (self.high_y_m - y_m, math.pi / 2.0),
            (x_m - self.low_x_m, math.pi),
            (y_m - self.low_y_m, -math.pi / 2.0),
        )
        return tuple(direction_rad for gap_m, direction_rad in gaps if gap_m <= TOUCH_M)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the nearest point of the free floor."""
        return (
            min(max(x_m, self.low_x_m), self.high_x_m),
            min(max(y_m, self.low_y_m), self.high_y_m),
        )


def first_crossing(gap_m: Callable[[float], float], end_s: float) -> float:
    """Return when a gap that shrinks over [0, end] reaches zero.

    Args:
        gap_m: Gap as a function of time: not negative at 0, negative at `end_s`, monotonic but for
            rounding.
        end_s: End of the interval.

    Returns:
        A time at which the gap is not negative, within rounding of the crossing.
    """
    low_s, high_s = 0.0, end_s
    for _ in range(BISECTIONS):
        middle_s = 0.5 * (low_s + high_s)
        if gap_m(middle_s) < 0.0:
            high_s = middle_s
        else:
            low_s = middle_s
    return low_s
