"""Let an agent that has a loop of its own, as those of Gymnasium have, learn on a robot.

Such an agent calls `env.step`, while a robot calls its learner. `AgentLearner` turns that around:
the agent runs in a thread, and its environment hands every action to the robot and waits for what
it brings. One of the two always waits for the other, so the same seed gives the same run.
`stable_baselines3_learner.py` makes a learner of DQN with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import queue
import threading
from typing import Any

import gymnasium
import numpy as np

from goalreach_learning.learner import Experience, LearnerSetup, Situation


class RobotEnvironment(gymnasium.Env[Any, Any]):
    """The regions of a robot as an environment whose steps are driven by somebody else.

    Args:
        shape: Numbers of columns, rows and actions.

    Attributes:
        requests: What the agent asks for: an action to drive, None for a new path, or its error.
        results: What came of it.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.observation_space: Any = gymnasium.spaces.Discrete(shape[0] * shape[1])
        self.action_space: Any = gymnasium.spaces.Discrete(shape[2])
        self.requests: queue.Queue[int | Exception | None] = queue.Queue()
        self.results: queue.Queue[Any] = queue.Queue()

    def reset(
        self,
        *,
        seed: int | None = None,
        options: Any = None,  # noqa: ANN401, ARG002 - as in Gymnasium
    ) -> tuple[Any, dict[str, Any]]:
        """Wait for the next path; return where it begins."""
        super().reset(seed=seed)
        self.requests.put(None)
        return self.results.get(), {}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Have an action driven; return what came of it."""
        self.requests.put(int(action))
        region, reward, terminated, truncated = self.results.get()
        return region, reward, terminated, truncated, {}


class AgentLearner:
    """A learner around an agent that has a loop of its own.

    Args:
        setup: As every learner is given it.
        begin: Makes an agent for an environment and returns the function that runs its loop.
        values: Returns the agent's value of each action in a region, given by its number.
    """

    def __init__(
        self,
        setup: LearnerSetup,
        begin: Callable[[RobotEnvironment], Callable[[], object]],
        values: Callable[[int], Any],
    ) -> None:
        self.environment = RobotEnvironment(setup.shape)
        self._loop, self._values, self._rows = begin(self.environment), values, setup.shape[1]
        self._visits = np.zeros(setup.shape, dtype=np.int64)
        self._request: int | Exception | None = None
        self._path: int | None = None

    def choose(self, situation: Situation) -> int:
        """Return the action that the agent asks for."""
        number = self._number(situation.region)
        if self._path is None:
            threading.Thread(target=self._run, daemon=True).start()
            self._request = self.environment.requests.get()
        elif situation.path != self._path and self._request is not None:
            self._answer((number, 0.0, False, True))  # the last path timed out
        self._path = situation.path
        if self._request is None:
            self._answer(number)
        if isinstance(self._request, int):
            return self._request
        raise RuntimeError(f'the agent has ended: {self._request!r}')

    def update(self, experience: Experience) -> None:
        """Tell the agent what came of its action, and let it learn."""
        after, ended = self._number(experience.after.region), experience.outcome is not None
        i, j = experience.before.region
        self._visits[i, j, experience.action] += 1
        self._answer((after, experience.reward, ended, False))

    def policy(self) -> tuple[Any, Any]:
        """Return the agent's values of all regions, and visits."""
        columns, rows, _ = self._visits.shape
        q = [[self._values(self._number((i, j))) for j in range(rows)] for i in range(columns)]
        return np.array(q, dtype=np.float64), self._visits.copy()

    def save(self) -> Mapping[str, Any]:
        """Return nothing more: a subclass whose agent can be stored adds it."""
        return {}

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue with visits."""
        self._visits = np.array(state['visits'])

    def _number(self, region: tuple[int, int]) -> int:
        return self._rows * region[0] + region[1]

    def _answer(self, result: object) -> None:
        """Give the agent what it waits for, and wait until it waits again."""
        self.environment.results.put(result)
        self._request = self.environment.requests.get()

    def _run(self) -> None:
        try:
            self._loop()
            self.environment.requests.put(StopIteration('its loop returned'))
        except Exception as error:  # noqa: BLE001 - whatever it is, the robot must be told
            self.environment.requests.put(error)
