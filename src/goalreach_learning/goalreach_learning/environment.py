"""Options in closed form: a straight line to the next region border or wall contact.

"Performing one action means that the vehicle rotates until it is oriented towards the selected
direction and translates until the current state changes" (section "The Action Set and
Q-learning"). Rotating in place moves nothing, so an option is one straight line whose end is
computed exactly, without time steps.
"""

import math
from typing import NamedTuple

from goalreach_learning.task import ACTION_DIRECTIONS
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import Region


class OptionEnd(NamedTuple):
    """The end of an option.

    Attributes:
        x_m: Position in `map`, metres.
        y_m: Position in `map`, metres.
        region: Region of the robot; on a border the one that was entered.
        bumped: Whether the body touched a wall.
        length_m: Distance driven, metres.
    """

    x_m: float
    y_m: float
    region: Region
    bumped: bool
    length_m: float


class OptionEnvironment:
    """A disc that drives straight lines on the arena's floor.

    Args:
        arena: Walls and regions.
        body_radius_m: Radius of the disc.
        overshoot_m: Distance driven past a border before the option ends, unless a wall ends it.

    Attributes:
        regions: The region map.
        overshoot_m: As given.
        x_contacts_m: Smallest and largest x of the disc's centre.
        y_contacts_m: Smallest and largest y of the disc's centre.
    """

    def __init__(
        self, arena: Arena, *, body_radius_m: float = BODY_RADIUS_M, overshoot_m: float = 0.0
    ) -> None:
        self.regions = arena.regions
        self.overshoot_m = overshoot_m
        # The outer columns and rows end at walls, which are contacts, not borders.
        x_borders, y_borders = arena.regions.x_borders_m, arena.regions.y_borders_m
        self._x_low = (-math.inf, x_borders[1], x_borders[2])
        self._x_high = (x_borders[1], x_borders[2], math.inf)
        self._y_low = (-math.inf, y_borders[1], y_borders[2])
        self._y_high = (y_borders[1], y_borders[2], math.inf)
        self.x_contacts_m = (body_radius_m, arena.width_m - body_radius_m)
        self.y_contacts_m = (body_radius_m, arena.length_m - body_radius_m)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the nearest point of the free floor."""
        (x_low, x_high), (y_low, y_high) = self.x_contacts_m, self.y_contacts_m
        return min(max(x_m, x_low), x_high), min(max(y_m, y_low), y_high)

    def advance(self, x_m: float, y_m: float, region: Region, action: int) -> OptionEnd:
        """Return the end of one of the eight actions.

        Args:
            x_m: Position in `map`, metres; on the free floor.
            y_m: Position in `map`, metres.
            region: Region of the robot; it decides on a border, which belongs to two.
            action: Index of the action.
        """
        return self.drive(x_m, y_m, region, ACTION_DIRECTIONS[action])

    def drive(
        self, x_m: float, y_m: float, region: Region, direction: tuple[float, float]
    ) -> OptionEnd:
        """Return the end of a straight line in any direction.

        Args:
            x_m: Position in `map`, metres; on the free floor.
            y_m: Position in `map`, metres.
            region: Region of the robot.
            direction: Unit vector (cos, sin) of the heading.
        """
        dx, dy = direction
        i, j = region
        border_x = border_y = wall = math.inf
        if dx > 0.0:
            border_x, wall = (self._x_high[i] - x_m) / dx, (self.x_contacts_m[1] - x_m) / dx
        elif dx < 0.0:
            border_x, wall = (self._x_low[i] - x_m) / dx, (self.x_contacts_m[0] - x_m) / dx
        if dy > 0.0:
            border_y = (self._y_high[j] - y_m) / dy
            wall = min(wall, (self.y_contacts_m[1] - y_m) / dy)
        elif dy < 0.0:
            border_y = (self._y_low[j] - y_m) / dy
            wall = min(wall, (self.y_contacts_m[0] - y_m) / dy)
        border = max(0.0, min(border_x, border_y))
        if wall <= border:
            length = max(0.0, wall)
            return OptionEnd(x_m + length * dx, y_m + length * dy, region, True, length)
        if border_x <= border:
            i += 1 if dx > 0.0 else -1
        if border_y <= border:
            j += 1 if dy > 0.0 else -1
        if self.overshoot_m == 0.0 or (i, j) == self.regions.goal:
            return OptionEnd(x_m + border * dx, y_m + border * dy, (i, j), False, border)
        length = min(border + self.overshoot_m, wall)
        x_m, y_m = x_m + length * dx, y_m + length * dy
        return OptionEnd(x_m, y_m, self.regions.region_at(x_m, y_m), length >= wall, length)
