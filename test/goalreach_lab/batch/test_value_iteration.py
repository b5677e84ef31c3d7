import numpy as np
import pytest

from goalreach_lab.batch.batch_training import BUMP_END, GOAL_END, train_batch
from goalreach_lab.batch.value_iteration import value_iteration
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena


def test_a_chain_has_powers_of_gamma() -> None:
    counts = np.zeros((3, 3, 8, 11), dtype=np.int64)
    counts[0, 2, 0, 1] = 5  # (0, 2) -> (0, 1) -> (0, 0) -> goal
    counts[0, 1, 0, 0] = 5
    counts[0, 0, 0, GOAL_END] = 5
    counts[0, 0, 3, BUMP_END] = 1
    q = value_iteration(counts, gamma=0.5)
    assert q[0, 0, 0] == pytest.approx(1.0)
    assert q[0, 1, 0] == pytest.approx(0.5)
    assert q[0, 2, 0] == pytest.approx(0.25)
    assert q[0, 0, 3] == -1.0
    assert q[2, 2].tolist() == [0.0] * 8


def test_frequencies_are_averaged() -> None:
    counts = np.zeros((3, 3, 8, 11), dtype=np.int64)
    counts[0, 0, 0, GOAL_END] = 3
    counts[0, 0, 0, BUMP_END] = 1
    counts[0, 1, 2, 0] = 1
    q = value_iteration(counts, gamma=0.9)
    assert q[0, 0, 0] == pytest.approx(0.75 - 0.25)
    assert q[0, 1, 2] == pytest.approx(0.45)


def test_the_learner_comes_near_to_it(arena: Arena) -> None:
    config = LearningConfig()
    batch = train_batch(arena, config, rng=np.random.default_rng(0), n=50)
    optimal = value_iteration(batch.counts, gamma=config.gamma).max(axis=-1)
    learned = batch.q_by_trial[:, -1].max(axis=-1).mean(axis=0)
    assert batch.counts.sum() == batch.visits_by_trial[:, -1].sum()
    assert learned == pytest.approx(optimal, abs=0.02)
