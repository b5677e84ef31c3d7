"""Q(lambda) and Dyna-Q against numbers by hand."""

import numpy as np
import pytest

from goalreach_learning.learner import Experience, LearnerSetup, Situation
from goalreach_learning.learners.tabular import DynaQLearner, QLambdaLearner
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.values import PathOutcome, Region

CONFIG = LearningConfig(alpha=0.5, gamma=0.8)


def setup() -> LearnerSetup:
    return LearnerSetup(shape=(3, 3, 8), config=CONFIG, rng=np.random.default_rng(0))


def place(region: Region, path: int = 0) -> Situation:
    return Situation(region=region, x_m=0.0, y_m=0.0, path=path)


def step(before: Region, after: Region, *, goal: bool = False, path: int = 0) -> Experience:
    return Experience(
        before=place(before, path),
        action=0,
        reward=float(goal),
        after=place(after, path),
        outcome=PathOutcome.GOAL if goal else None,
    )


def test_a_trace_rewards_the_action_before() -> None:
    learner = QLambdaLearner(setup())
    learner.choose(place((0, 0)))
    learner.update(step((0, 0), (0, 1)))
    learner.choose(place((0, 1)))  # greedy: all values are equal
    learner.update(step((0, 1), (1, 1), goal=True))
    assert learner.q[0][1][0] == pytest.approx(0.5)
    assert learner.q[0][0][0] == pytest.approx(0.5 * 0.8 * 0.8)  # alpha gamma lambda
    learner.choose(place((0, 0), path=1))
    learner.update(step((0, 0), (0, 1), path=1))
    assert learner.q[0][0][0] == pytest.approx(0.32 + 0.5 * (0.8 * 0.5 - 0.32))
    assert learner.q[0][1][0] == pytest.approx(0.5)
    assert learner.visits[0][0][0] == 2


def test_a_trace_ends_with_an_action_that_is_not_greedy() -> None:
    learner = QLambdaLearner(setup())
    learner.choose(place((0, 0)))
    learner.update(step((0, 0), (0, 1)))
    learner.q[0][1] = [0.0] * 7 + [1.0]
    assert learner.choose(place((0, 1))) != 7
    learner.update(step((0, 1), (1, 1), goal=True))
    assert learner.q[0][0][0] == 0.0


def test_a_trace_ends_with_its_path() -> None:
    learner = QLambdaLearner(setup())
    learner.choose(place((0, 0)))
    learner.update(step((0, 0), (0, 1)))
    learner.choose(place((0, 1), path=1))
    learner.update(step((0, 1), (1, 1), goal=True, path=1))
    assert learner.q[0][0][0] == 0.0


def test_the_memory_carries_a_reward_back_without_driving() -> None:
    learner = DynaQLearner(setup())
    learner.update(step((0, 0), (0, 1)))
    learner.update(step((0, 1), (1, 1), goal=True))
    assert learner.q[0][1][0] == pytest.approx(1.0, abs=0.01)
    assert learner.q[0][0][0] == pytest.approx(0.8, abs=0.1)
    assert learner.visits[0][0][0] == learner.visits[0][1][0] == 1
