"""Paths of a policy driven by a point without noise, delay or dynamics, as in Figs. 3 and 6."""

from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from goalreach_learning.blending import blend_heading
from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import FloatArray, PathOutcome, Pose2

MAX_OPTIONS: Final = 30
"""Options after which a path counts as endless; chosen, nine regions need far fewer."""
_MAX_LENGTH_M: Final = 30.0
"""Length after which a path counts as endless, six times the arena's length; chosen."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """The path of a point.

    Attributes:
        points_m: Positions (n, 2) in `map`, metres; straight between them.
        outcome: GOAL, BUMP, or TIMEOUT for an endless path or one without an action.
    """

    points_m: FloatArray
    outcome: PathOutcome

    @property
    def length_m(self) -> float:
        """Length of the path, metres."""
        steps = np.diff(self.points_m, axis=0)
        return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def crisp_track(arena: Arena, policy: Policy, start: Pose2) -> Track:
    """Return the path of the greedy actions, as in the paper's Fig. 3.

    Args:
        arena: Walls and regions.
        policy: The policy.
        start: First point; the heading is not used.
    """
    environment = OptionEnvironment(arena)
    x_m, y_m = start.x_m, start.y_m
    region = policy.regions.region_at(x_m, y_m)
    points = [(x_m, y_m)]
    outcome = PathOutcome.TIMEOUT
    for _ in range(MAX_OPTIONS):
        if region == policy.regions.goal:
            outcome = PathOutcome.GOAL
            break
        action = policy.greedy_action(region)
        if action is None:
            break
        x_m, y_m, region, bumped, _ = environment.advance(x_m, y_m, region, action)
        points.append((x_m, y_m))
        if bumped:
            outcome = PathOutcome.BUMP
            break
    return Track(points_m=np.array(points), outcome=outcome)


def greedy_successes(arena: Arena, policy: Policy) -> tuple[bool, ...]:
    """Return, for each start of the arena, whether the greedy actions lead to the goal.

    Args:
        arena: Walls, regions and starts.
        policy: The policy.
    """
    tracks = (crisp_track(arena, policy, start) for start in arena.starts)
    return tuple(track.outcome is PathOutcome.GOAL for track in tracks)


def blended_track(
    arena: Arena, policy: Policy, start: Pose2, *, mode: str, step_m: float = 0.01
) -> Track:
    """Return the path along the blended headings, as in the paper's Fig. 6.

    Args:
        arena: Walls and regions.
        policy: The policy.
        start: First point; the heading is not used.
        mode: One of `blending.MODES`.
        step_m: Distance after which the heading is computed again, metres.
    """
    regions = policy.regions
    x_m, y_m = start.x_m, start.y_m
    heading_rad: float | None = None
    points = [(x_m, y_m)]
    outcome = PathOutcome.TIMEOUT
    for _ in range(math.ceil(_MAX_LENGTH_M / step_m)):
        if regions.region_at(x_m, y_m) == regions.goal:
            outcome = PathOutcome.GOAL
            break
        blended = blend_heading(mode, *regions.memberships_at(x_m, y_m), policy)
        heading_rad = heading_rad if blended is None else blended
        if heading_rad is None:
            break
        x_m += step_m * math.cos(heading_rad)
        y_m += step_m * math.sin(heading_rad)
        points.append((x_m, y_m))
        if not arena.is_free(x_m, y_m):
            outcome = PathOutcome.BUMP
            break
    return Track(points_m=np.array(points), outcome=outcome)
