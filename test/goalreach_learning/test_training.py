import numpy as np
import pytest

from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import RegionMap


def test_same_seed_same_policy(arena: Arena) -> None:
    first = train(arena, rng=np.random.default_rng(4))
    second = train(arena, rng=np.random.default_rng(4))
    other = train(arena, rng=np.random.default_rng(5))
    assert np.array_equal(first.policy.q, second.policy.q)
    assert not np.array_equal(first.policy.q, other.policy.q)


def test_learns_to_reach_the_goal_from_every_start(arena: Arena) -> None:
    result = train(arena, rng=np.random.default_rng(1))
    assert len(result.success_by_trial) == 20
    assert result.success_by_trial[-1] > 0.9
    assert greedy_successes(arena, result.policy) == (True,) * 22


def test_learns_the_headings_that_enter_the_goal(arena: Arena) -> None:
    policy = train(arena, rng=np.random.default_rng(1)).policy
    assert policy.greedy_action((0, 0)) == 0  # LEFT-SIDE/NEAR: to the right
    assert policy.greedy_action((2, 0)) == 4  # RIGHT-SIDE/NEAR: to the left
    assert policy.greedy_action((1, 1)) == 6  # FRONT/MEDIUM: to the goal wall
    assert policy.q[0, 0, 0] == pytest.approx(1.0, abs=1e-3)
    assert policy.q[1, 1, 6] == pytest.approx(1.0, abs=1e-3)


def test_another_goal_is_learned_as_well() -> None:
    regions = RegionMap(goal=(2, 2))
    arena = Arena(regions=regions, starts=Arena().starts[9:])
    policy = train(arena, rng=np.random.default_rng(3)).policy
    assert all(greedy_successes(arena, policy))
    assert policy.greedy_action((2, 2)) is None


def test_a_policy_without_actions_has_no_successes(arena: Arena) -> None:
    assert greedy_successes(arena, Policy.unlearned(arena.regions)) == (False,) * 22


def test_a_truncated_path_is_not_a_failure(arena: Arena) -> None:
    config = LearningConfig(trials=3, max_options=1)
    result = train(arena, config, rng=np.random.default_rng(0))
    assert result.options == 3 * 22
    assert result.policy.visits.sum() == 3 * 22
