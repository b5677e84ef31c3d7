"""Agents with a loop of their own as learners of a robot."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent, LearnerSetup
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import LearningPhase
from goalreach_msgs_py.arena import Arena

pytest.importorskip('gymnasium')
EXAMPLES = Path(__file__).parents[2] / 'examples'


class TableAgent:
    """Epsilon-greedy Q-learning in a loop of its own, as agents of Gymnasium are written."""

    def __init__(self, env: object, rng: np.random.Generator) -> None:
        self.env: Any = env
        self.rng = rng
        self.q = np.zeros((9, 8))
        self.ends: list[tuple[bool, bool]] = []

    def learn(self) -> None:
        while True:
            seen, _ = self.env.reset()
            ended = False
            while not ended:
                greedy = self.rng.random() > 0.2
                action = self.q[seen].argmax() if greedy else self.env.action_space.n - 1
                action = action if greedy else self.rng.integers(self.env.action_space.n)
                after, reward, terminated, truncated, _ = self.env.step(action)
                future = 0.0 if terminated else 0.9 * self.q[after].max()
                self.q[seen, action] += 0.5 * (reward + future - self.q[seen, action])
                self.ends.append((terminated, truncated))
                seen, ended = after, terminated or truncated


def learned(seed: int) -> tuple[Agent, TableAgent]:
    from agent_learner import AgentLearner

    arena, config, rng = Arena(), LearningConfig(max_options=4), np.random.default_rng(seed)
    made: list[TableAgent] = []

    def begin(env: object) -> Callable[[], object]:
        made.append(TableAgent(env, rng))
        return made[0].learn

    setup = LearnerSetup(shape=(3, 3, 8), config=config, rng=rng)
    learner = AgentLearner(setup, begin, lambda number: made[0].q[number])
    agent = Agent('paper', arena.regions, config, rng)
    agent.learner = learner
    phase = LearningPhase(arena, config, agent, rng)
    for path in range(400):
        phase.run(arena.starts[path % 22], 0, path)
    return agent, made[0]


@pytest.fixture(autouse=True)
def _examples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))


def test_an_agent_with_its_own_loop_learns_on_the_robot() -> None:
    agent, inner = learned(1)
    assert sum(greedy_successes(Arena(), agent.policy)) >= 20
    assert any(truncated for _, truncated in inner.ends), 'a time-out is told to the agent'
    again, _ = learned(1)
    assert np.array_equal(again.policy.q, agent.policy.q)


def test_an_agent_that_ends_is_reported() -> None:
    from agent_learner import AgentLearner

    setup = LearnerSetup(shape=(3, 3, 8), config=LearningConfig(), rng=np.random.default_rng(0))

    def begin(_env: object) -> Callable[[], object]:
        return lambda: 1 / 0

    learner = AgentLearner(setup, begin, lambda _: np.zeros(8))
    agent = Agent('paper', Arena().regions, LearningConfig(), np.random.default_rng(0))
    agent.learner = learner
    phase = LearningPhase(Arena(), LearningConfig(), agent, np.random.default_rng(0))
    with pytest.raises(RuntimeError, match='division by zero'):
        phase.run(Arena().starts[0], 0, 0)


def test_dqn_learns_and_continues() -> None:
    pytest.importorskip('stable_baselines3')
    arena, config = Arena(), LearningConfig()
    name = 'stable_baselines3_learner:DqnLearner'
    agent = Agent(name, arena.regions, config, np.random.default_rng(1))
    phase = LearningPhase(arena, config, agent, np.random.default_rng(1))
    for path in range(300):
        phase.run(arena.starts[path % 22], 0, path)
    policy = agent.policy
    assert sum(greedy_successes(arena, policy)) >= 18
    again = Agent(name, arena.regions, config, np.random.default_rng(2), policy)
    assert np.allclose(again.policy.q, policy.q)
    phase = LearningPhase(arena, config, again, np.random.default_rng(2))
    phase.run(arena.starts[0], 0, 300)
