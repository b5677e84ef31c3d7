import numpy as np
import pytest

from goalreach_lab.batch.batch_training import greedy_successes_batch, train_batch
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import greedy_successes, train
from goalreach_msgs_py.arena import Arena


@pytest.mark.parametrize('jitter_m', [0.0, 0.05])
def test_a_batch_of_one_is_the_single_learner(arena: Arena, jitter_m: float) -> None:
    config = LearningConfig(start_jitter_m=jitter_m)
    single = train(arena, config, rng=np.random.default_rng(8))
    batch = train_batch(arena, config, rng=np.random.default_rng(8), n=1)
    assert batch.q_by_trial[0, -1] == pytest.approx(single.policy.q, abs=1e-12)
    assert np.array_equal(batch.visits_by_trial[0, -1], single.policy.visits)
    assert tuple(batch.success_by_trial[0]) == single.success_by_trial


def test_two_hundred_seeds_all_learn(arena: Arena) -> None:
    config = LearningConfig()
    batch = train_batch(arena, config, rng=np.random.default_rng(0), n=200)
    q, visits = batch.q_by_trial[:, -1], batch.visits_by_trial[:, -1]
    reached = greedy_successes_batch(arena, q, visits, gamma=config.gamma)
    assert reached.shape == (200, 22)
    assert reached.all()
    assert len({table.tobytes() for table in q}) == 200
    early = greedy_successes_batch(
        arena, batch.q_by_trial[:, 0], batch.visits_by_trial[:, 0], gamma=config.gamma
    )
    assert early.all(axis=1).mean() < 0.5  # one trial is not enough


def test_greedy_paths_are_those_of_the_single_policy(arena: Arena) -> None:
    config = LearningConfig(trials=1)
    for seed in range(10):
        policy = train(arena, config, rng=np.random.default_rng(seed)).policy
        many = greedy_successes_batch(
            arena, policy.q[np.newaxis], policy.visits[np.newaxis], gamma=config.gamma
        )
        assert tuple(many[0]) == greedy_successes(arena, policy)
