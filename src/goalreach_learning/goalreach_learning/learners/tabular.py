"""Learners on a table of regions: the paper's, and two that learn more from each action.

Q(lambda): C. J. C. H. Watkins, "Learning from Delayed Rewards", 1989; R. S. Sutton and A. G.
Barto, "Reinforcement Learning", 2nd edition, section 12.10, with replacing traces.
Dyna-Q: R. S. Sutton, "Integrated Architectures for Learning, Planning, and Reacting", ICML 1990.
"""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.learner import Experience, LearnerSetup, Situation
from goalreach_learning.q_learning import q_update, select_action
from goalreach_msgs_py.values import FloatArray, Region

LAMBDA: Final = 0.8
"""Decay of the traces per action. Chosen."""
IMAGINED: Final = 30
"""Remembered actions learned from after each real one. Chosen."""


class PaperLearner:
    """One-step Q-learning with Boltzmann exploration on a table of regions.

    Attributes:
        q: Q-values, nested lists [x][y][action].
        visits: Number of updates of each, nested lists [x][y][action].
    """

    def __init__(self, setup: LearnerSetup) -> None:
        self.config, self._rng = setup.config, setup.rng
        self.q: list[list[list[float]]] = np.zeros(setup.shape).tolist()
        self.visits: list[list[list[int]]] = np.zeros(setup.shape, dtype=np.int64).tolist()

    def choose(self, situation: Situation) -> int:
        """Return the action to try, by equation (2)."""
        i, j = situation.region
        return select_action(
            self.q[i][j],
            visited=any(self.visits[i][j]),
            temperature=self.config.temperature(situation.trial),
            uniform=self._rng.random(),
        )

    def update(self, experience: Experience) -> None:
        """Update the table with a finished action."""
        before, after = experience.before.region, experience.after.region
        ended = experience.outcome is not None
        self.learn(before, experience.action, experience.reward, after, terminal=ended)

    def learn(
        self, state: Region, action: int, reward: float, next_state: Region, *, terminal: bool
    ) -> None:
        """Update the table by equation (1); a time-out is not terminal."""
        i, j = state
        values = self.q[i][j]
        next_q = () if terminal else self.q[next_state[0]][next_state[1]]
        values[action] = q_update(
            values[action], reward, next_q, alpha=self.config.alpha, gamma=self.config.gamma
        )
        self.visits[i][j][action] += 1

    def policy(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Return a copy of Q-values and visits."""
        return np.array(self.q, dtype=np.float64), np.array(self.visits, dtype=np.int64)

    def save(self) -> Mapping[str, Any]:
        """Return nothing: the table is all there is."""
        return {}

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue with a table."""
        self.q, self.visits = state['q'], state['visits']


class QLambdaLearner(PaperLearner):
    """Watkins's Q(lambda): a reward updates every action that led to it.

    The traces of these actions are cut by one that is not greedy.
    """

    def __init__(self, setup: LearnerSetup) -> None:
        super().__init__(setup)
        self._traces: dict[tuple[Region, int], float] = {}
        self._path = -1

    def choose(self, situation: Situation) -> int:
        """Return the action to try, by equation (2)."""
        action = super().choose(situation)
        values = self.q[situation.region[0]][situation.region[1]]
        if situation.path != self._path or values[action] < max(values):
            self._traces.clear()
        self._path = situation.path
        return action

    def update(self, experience: Experience) -> None:
        """Correct the traced actions by the error of equation (1), in proportion to the trace."""
        (i, j), action = experience.before.region, experience.action
        after, gamma = experience.after.region, self.config.gamma
        future = 0.0 if experience.outcome else gamma * max(self.q[after[0]][after[1]])
        error = experience.reward + future - self.q[i][j][action]
        self._traces[(i, j), action] = 1.0
        for ((column, row), tried), trace in self._traces.items():
            self.q[column][row][tried] += self.config.alpha * trace * error
        self._traces = {key: gamma * LAMBDA * trace for key, trace in self._traces.items()}
        self.visits[i][j][action] += 1


class DynaQLearner(PaperLearner):
    """Every action is remembered, and learned from again many times.

    An action of a region has several ends, depending on where it began: the memory holds every
    one that happened, so frequent ones are repeated more often.
    """

    def __init__(self, setup: LearnerSetup) -> None:
        super().__init__(setup)
        self._memory: list[tuple[Region, int, float, Region, bool]] = []

    def update(self, experience: Experience) -> None:
        """Learn from the action, and from remembered ones."""
        super().update(experience)
        before, after = experience.before.region, experience.after.region
        ended = experience.outcome is not None
        self._memory.append((before, experience.action, experience.reward, after, ended))
        for number in self._rng.integers(len(self._memory), size=IMAGINED).tolist():
            state, action, reward, next_state, terminal = self._memory[number]
            (i, j), real = state, self.visits[state[0]][state[1]][action]
            self.learn(state, action, reward, next_state, terminal=terminal)
            self.visits[i][j][action] = real

    def save(self) -> Mapping[str, Any]:
        """Return the memory."""
        return {'memory': [list(one) for one in self._memory]}

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue with a table and a memory."""
        super().load(state)
        self._memory = [
            (tuple(before), action, reward, tuple(after), ended)
            for before, action, reward, after, ended in state['memory']
        ]
