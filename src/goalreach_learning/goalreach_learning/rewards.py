"""Rewards of section "The Action Set and Q-learning"."""

from __future__ import annotations

from typing import Final

from goalreach_msgs_py.values import PathOutcome

__all__ = ['BUMP_REWARD', 'GOAL_REWARD', 'reward_of']

GOAL_REWARD: Final = 1.0
BUMP_REWARD: Final = -1.0

_REWARDS = {PathOutcome.GOAL: GOAL_REWARD, PathOutcome.BUMP: BUMP_REWARD}


def reward_of(outcome: PathOutcome | None) -> float:
    """Return the reward of a transition: 1 into the goal, -1 into a wall, else 0.

    A time-out is not in the paper; it cuts a path off and earns nothing.

    Args:
        outcome: How the path ended with the transition, or None where it goes on.
    """
    return 0.0 if outcome is None else _REWARDS.get(outcome, 0.0)
