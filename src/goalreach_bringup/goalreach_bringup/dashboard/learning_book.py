"""What came of the paths: counters and the learning curve."""

from __future__ import annotations

from collections import deque
from typing import Final

from goalreach_msgs_py.values import PathOutcome, Transition

__all__ = ['WINDOW', 'LearningBook']

WINDOW: Final = 22
"""Paths of a trial, section "The Simulation Phase": success is told of so many."""
_POINTS: Final = 600


class LearningBook:
    """Counts finished paths and keeps the curve of success over the last 22 of them.

    Attributes:
        paths: Paths that ended since the page began to listen.
        goals: Those declared at the goal, truly in it where the truth is known.
        false_goals: Those declared at the goal with the robot outside.
        bumps: Those that ended at a wall.
        timeouts: Those that took too long.
        last: The last finished action, or None.
        curve: Number of a path, from 1, and the share of goals among the 22 paths up to it;
            at most 600 points, of which every other one is left out when they are too many.
    """

    def __init__(self) -> None:
        """Start an empty book."""
        self.paths = self.goals = self.false_goals = self.bumps = self.timeouts = 0
        self.last: Transition | None = None
        self.curve: list[tuple[int, float]] = []
        self._recent: deque[bool] = deque(maxlen=WINDOW)

    def add(self, transition: Transition, *, in_goal: bool | None) -> None:
        """Take a finished action.

        Args:
            transition: The action.
            in_goal: Whether the true position was in the goal region, None where it is not known.
        """
        self.last = transition
        if transition.outcome is None:
            return
        goal = transition.outcome is PathOutcome.GOAL and in_goal is not False
        self.paths += 1
        self.goals += goal
        self.false_goals += transition.outcome is PathOutcome.GOAL and not goal
        self.bumps += transition.outcome is PathOutcome.BUMP
        self.timeouts += transition.outcome is PathOutcome.TIMEOUT
        self._recent.append(goal)
        number = transition.path + 1
        while self.curve and self.curve[-1][0] >= number:
            self.curve.pop()  # a path that is driven again, after a node was started again
        self.curve.append((number, sum(self._recent) / len(self._recent)))
        if len(self.curve) > _POINTS:
            self.curve = self.curve[::2]
