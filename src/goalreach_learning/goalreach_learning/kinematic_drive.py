"""Driving without noise, delay or dynamics: options in closed form, and paths of a policy.

"Performing one action means that the vehicle rotates until it is oriented towards the selected
direction and translates until the current state changes" (section "The Action Set and
Q-learning"). Rotating in place moves nothing, so an option is one straight line whose end is
computed exactly, without time steps.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from goalreach_learning.blending import blend_heading
from goalreach_learning.policy import Policy, action_directions
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import FloatArray, PathOutcome, Pose2, Region

_TOUCH_M: Final = 1e-9
"""Gap that counts as contact despite rounding; chosen."""
MAX_OPTIONS: Final = 30
"""Options after which a path counts as endless; chosen, nine regions need far fewer."""
_STEP_M: Final = 0.01
"""Distance after which a blended heading is computed again."""
_MAX_LENGTHS: Final = 6
"""Lengths of the arena after which a path counts as endless; chosen."""


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
    """A disc as large as the robot that drives straight lines on the arena's floor.

    Args:
        arena: Walls and regions.
        overshoot_m: Distance driven past a border before the option ends, unless a wall ends it.

    Attributes:
        x_contacts_m: Smallest and largest x of the disc's centre.
        y_contacts_m: Smallest and largest y of the disc's centre.
    """

    def __init__(self, arena: Arena, *, overshoot_m: float = 0.0) -> None:
        self.regions = arena.regions
        self.overshoot_m = overshoot_m
        self._ends = arena.regions.ends
        # The outer columns and rows end at walls, which are contacts, not borders.
        x_borders, y_borders = arena.regions.x_borders_m, arena.regions.y_borders_m
        self._x_borders_m = (-math.inf, *x_borders[1:-1], math.inf)
        self._y_borders_m = (-math.inf, *y_borders[1:-1], math.inf)
        self._directions = action_directions(arena.regions.actions)
        self.x_contacts_m = (BODY_RADIUS_M, arena.width_m - BODY_RADIUS_M)
        self.y_contacts_m = (BODY_RADIUS_M, arena.length_m - BODY_RADIUS_M)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the nearest point of the free floor."""
        (x_low, x_high), (y_low, y_high) = self.x_contacts_m, self.y_contacts_m
        return min(max(x_m, x_low), x_high), min(max(y_m, y_low), y_high)

    def touched_rad(self, x_m: float, y_m: float) -> tuple[float, ...]:
        """Return the azimuths in `map` of the walls that the disc touches at a point, radians."""
        (x_low, x_high), (y_low, y_high) = self.x_contacts_m, self.y_contacts_m
        gaps_m = (x_high - x_m, y_high - y_m, x_m - x_low, y_m - y_low)
        return tuple(k * math.pi / 2 for k, gap_m in enumerate(gaps_m) if gap_m <= _TOUCH_M)

    def advance(self, x_m: float, y_m: float, region: Region, action: int) -> OptionEnd:
        """Return the end of one of the actions.

        Args:
            x_m: Position in `map`, metres; on the free floor.
            y_m: Position in `map`, metres.
            region: Region of the robot; it decides on a border, which belongs to two.
            action: Index of the action.
        """
        dx, dy = self._directions[action]
        i, j = region
        border_x = border_y = wall = math.inf
        right, up = dx > 0.0, dy > 0.0  # as indices: the border or contact ahead
        if dx:
            border_x = (self._x_borders_m[i + right] - x_m) / dx
            wall = (self.x_contacts_m[right] - x_m) / dx
        if dy:
            border_y = (self._y_borders_m[j + up] - y_m) / dy
            wall = min(wall, (self.y_contacts_m[up] - y_m) / dy)
        border = max(0.0, min(border_x, border_y))
        if wall <= border:
            length = max(0.0, wall)
            return OptionEnd(x_m + length * dx, y_m + length * dy, region, True, length)
        if border_x <= border:
            i += 1 if right else -1
        if border_y <= border:
            j += 1 if up else -1
        if self.overshoot_m == 0.0 or (i, j) in self._ends:
            return OptionEnd(x_m + border * dx, y_m + border * dy, (i, j), False, border)
        length = min(border + self.overshoot_m, wall)
        x_m, y_m = x_m + length * dx, y_m + length * dy
        return OptionEnd(x_m, y_m, self.regions.region_at(x_m, y_m), length >= wall, length)


class Track(NamedTuple):
    """The path of a point.

    Attributes:
        points_m: Positions (n, 2) in `map`, metres; straight between them.
        outcome: GOAL, BUMP, FORBIDDEN, or TIMEOUT for an endless path or one without an action.
    """

    points_m: FloatArray
    outcome: PathOutcome

    @property
    def length_m(self) -> float:
        """Length of the path, metres."""
        steps = np.diff(self.points_m, axis=0)
        return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def crisp_track(arena: Arena, policy: Policy, start: Pose2) -> Track:
    """Return the path of the greedy actions, as in the paper's Fig. 3; it ignores obstacles."""
    environment = OptionEnvironment(arena)
    x_m, y_m = start.x_m, start.y_m
    region, ends = policy.regions.region_at(x_m, y_m), policy.regions.ends
    points, outcome = [(x_m, y_m)], ends.get(region)
    while outcome is None and len(points) <= MAX_OPTIONS:
        action = policy.greedy_action(region)
        if action is None:
            break
        x_m, y_m, region, bumped, _ = environment.advance(x_m, y_m, region, action)
        points.append((x_m, y_m))
        outcome = PathOutcome.BUMP if bumped else ends.get(region)
    return Track(points_m=np.array(points), outcome=outcome or PathOutcome.TIMEOUT)


def greedy_successes(arena: Arena, policy: Policy) -> tuple[bool, ...]:
    """Return, for each start, whether the greedy actions lead to the goal without obstacles."""
    tracks = (crisp_track(arena, policy, start) for start in arena.starts)
    return tuple(track.outcome is PathOutcome.GOAL for track in tracks)


def blended_track(arena: Arena, policy: Policy, start: Pose2, *, mode: str) -> Track:
    """Return the path along the headings of a blending mode, as in the paper's Fig. 6."""
    regions, ends = policy.regions, policy.regions.ends
    x_m, y_m = start.x_m, start.y_m
    heading_rad: float | None = None
    points, outcome = [(x_m, y_m)], ends.get(regions.region_at(x_m, y_m))
    most = _MAX_LENGTHS * max(arena.width_m, arena.length_m) / _STEP_M
    while outcome is None and len(points) <= most:
        blended = blend_heading(mode, *regions.memberships_at(x_m, y_m), policy)
        heading_rad = heading_rad if blended is None else blended
        if heading_rad is None:
            break
        x_m += _STEP_M * math.cos(heading_rad)
        y_m += _STEP_M * math.sin(heading_rad)
        points.append((x_m, y_m))
        is_free = arena.is_free(x_m, y_m)
        outcome = ends.get(regions.region_at(x_m, y_m)) if is_free else PathOutcome.BUMP
    return Track(points_m=np.array(points), outcome=outcome or PathOutcome.TIMEOUT)
