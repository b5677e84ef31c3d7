"""The paper's action set: eight absolute headings, {0, 45, ..., 315} degrees."""

import math
from typing import Final

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import PathOutcome

ACTION_COUNT: Final = 8

ACTIONS_DEG: Final = tuple(45.0 * k for k in range(ACTION_COUNT))
"""The set as printed in section "The Action Set and Q-learning", degrees."""

ACTIONS_RAD: Final = tuple(math.radians(a) for a in ACTIONS_DEG)
"""The same in radians, in [0, 2 pi), as in policy files."""

ACTION_HEADINGS_RAD: Final = tuple(wrap_angle(a) for a in ACTIONS_RAD)
"""The same as headings in `map`, radians in (-pi, pi]."""

_DIAGONAL = math.sqrt(0.5)
ACTION_DIRECTIONS: Final = (
    (1.0, 0.0),
    (_DIAGONAL, _DIAGONAL),
    (0.0, 1.0),
    (-_DIAGONAL, _DIAGONAL),
    (-1.0, 0.0),
    (-_DIAGONAL, -_DIAGONAL),
    (0.0, -1.0),
    (_DIAGONAL, -_DIAGONAL),
)
"""Unit vectors (x, y) of the headings, with exact zeros along the axes."""


def nearest_action(heading_rad: float) -> int:
    """Return the index of the action whose heading is nearest; the smaller index at a tie.

    Args:
        heading_rad: Heading in `map`, radians.

    >>> nearest_action(0.8)
    1
    """
    return min(
        range(ACTION_COUNT),
        key=lambda k: abs(angle_difference(ACTION_HEADINGS_RAD[k], heading_rad)),
    )


GOAL_REWARD: Final = 1.0
BUMP_REWARD: Final = -1.0

_REWARDS = {PathOutcome.GOAL: GOAL_REWARD, PathOutcome.BUMP: BUMP_REWARD}


def reward_of(outcome: PathOutcome | None) -> float:
    """Return the reward of a transition: 1 into the goal, -1 into a wall, else 0.

    A time-out, which is not in the paper, truncates a path without a reward.

    Args:
        outcome: Outcome of a path that ended with the transition, or None.
    """
    return 0.0 if outcome is None else _REWARDS.get(outcome, 0.0)
