"""What came of the paths: counters and the learning curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from goalreach_msgs_py.values import PathOutcome, Transition

__all__ = ['LearningBook', 'TrialTally']

_TRIALS: Final = 400


@dataclass
class TrialTally:
    """Paths of one trial.

    Attributes:
        paths: Paths that ended.
        goals: Those that ended in the goal.
    """

    paths: int = 0
    goals: int = 0


class LearningBook:
    """Counts finished paths; keeps the last 400 trials.

    Attributes:
        paths: Paths that ended since the page began to listen.
        goals: Those declared at the goal, truly in it where the truth is known.
        false_goals: Those declared at the goal with the robot outside.
        bumps: Those that ended at a wall.
        timeouts: Those that took too long.
        last: The last finished action, or None.
        trials: Tallies by number of the trial, ascending.
    """

    def __init__(self) -> None:
        """Start an empty book."""
        self.paths = self.goals = self.false_goals = self.bumps = self.timeouts = 0
        self.last: Transition | None = None
        self.trials: dict[int, TrialTally] = {}

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
        tally = self.trials.setdefault(transition.trial, TrialTally())
        tally.paths += 1
        tally.goals += goal
        while len(self.trials) > _TRIALS:
            del self.trials[next(iter(self.trials))]
