"""A learner of one's own, which tries everything once; see docs/how-to/learner.md."""

from typing import Any

import numpy as np

from goalreach_learning.learner import Experience, LearnerSetup, Situation

RATE, DISCOUNT, NEW = 0.3, 0.9, 1.0


class CuriousLearner:
    """Takes what seems best, where what was never tried seems perfect."""

    def __init__(self, setup: LearnerSetup) -> None:
        self.rng = setup.rng
        self.q = np.zeros(setup.shape)
        self.visits = np.zeros(setup.shape, dtype=np.int64)

    def choose(self, situation: Situation) -> int:
        """Return the action that seems best, a random one of equals."""
        tried = self.visits[situation.region] > 0
        worth = np.where(tried, self.q[situation.region], NEW)
        return int((worth + 1e-6 * self.rng.random(worth.size)).argmax())

    def update(self, experience: Experience) -> None:
        """Learn from a finished action."""
        key = (*experience.before.region, experience.action)
        future = 0.0 if experience.outcome else DISCOUNT * self.q[experience.after.region].max()
        self.q[key] += RATE * (experience.reward + future - self.q[key])
        self.visits[key] += 1

    def policy(self) -> tuple[Any, Any]:
        """Return Q-values and visits."""
        return self.q.copy(), self.visits.copy()

    def save(self) -> dict[str, Any]:
        """Return nothing more: the table is all there is."""
        return {}

    def load(self, state: dict[str, Any]) -> None:
        """Continue with a table."""
        self.q, self.visits = np.array(state['q']), np.array(state['visits'])
