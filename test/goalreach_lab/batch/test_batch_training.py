import numpy as np
import pytest

from goalreach_lab.batch.batch_training import (
    BUMP_END,
    GOAL_END,
    BatchEnvironment,
    greedy_successes_batch,
    train_batch,
    value_iteration,
)
from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena


@pytest.mark.parametrize('overshoot_m', [0.0, 0.05, 0.4])
def test_the_batch_environment_is_the_single_one_number_for_number(
    arena: Arena, overshoot_m: float
) -> None:
    single = OptionEnvironment(arena, overshoot_m=overshoot_m)
    batch = BatchEnvironment(single)
    rng = np.random.default_rng(2)
    n = 2000
    low = BODY_RADIUS_M
    x_m = rng.uniform(low, arena.width_m - low, n)
    y_m = rng.uniform(low, arena.length_m - low, n)
    x_m[:200] = arena.regions.x_borders_m[1]  # on a border, and against a wall
    y_m[100:300] = low
    action = rng.integers(0, 8, n)
    i, j = batch.regions_at(x_m, y_m)
    end = batch.advance(x_m, y_m, i, j, action)
    for k in range(n):
        region = (int(i[k]), int(j[k]))
        assert region == arena.regions.region_at(x_m[k], y_m[k])
        expected = single.advance(float(x_m[k]), float(y_m[k]), region, int(action[k]))
        found = (end.x_m[k], end.y_m[k], (end.i[k], end.j[k]), end.bumped[k], end.length_m[k])
        assert found == expected


@pytest.mark.parametrize('jitter_m', [0.0, 0.05])
def test_a_batch_of_one_is_the_single_learner(arena: Arena, jitter_m: float) -> None:
    config = LearningConfig(start_jitter_m=jitter_m)
    single = train(arena, config, rng=np.random.default_rng(8))
    batch = train_batch(arena, config, rng=np.random.default_rng(8), n=1)
    assert batch.q_by_trial[0, -1] == pytest.approx(single.policy.q, abs=1e-12)
    assert np.array_equal(batch.visits_by_trial[0, -1], single.policy.visits)


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
