from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np
import pytest

from goalreach_learning.policy import Policy, best_actions
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap, Rewards
from goalreach_msgs_py.values import FloatArray


def best(q: list[float], tried: list[int] | None = None) -> int:
    visits = np.zeros(8, dtype=np.int64)
    visits[list(range(8)) if tried is None else tried] = 1
    return int(best_actions(np.array(q), visits, 0.02))


def test_takes_the_highest_value() -> None:
    assert best([0, 0, 0, 0.5, 0.9, 0, 0, 0]) == 4


def test_takes_the_middle_of_equally_good_headings() -> None:
    # 270, 315 and 0 degrees lead on equally well: 315 lies between
    assert best([0.9, 0, 0, 0, 0, 0, 0.91, 0.9]) == 7
    # 0, 45 and 90
    assert best([0.9, 0.895, 0.9, 0, 0, 0, 0, 0]) == 1


def test_takes_the_better_one_without_a_middle() -> None:
    assert best([0.9, 0.905, 0, 0, 0, 0, 0, 0]) == 1
    assert best([0.9, 0, 0, 0, 0.905, 0, 0, 0]) == 4  # opposite headings have no middle


def test_an_untried_action_is_not_best() -> None:
    assert best([-1.0, 0, 0, 0, 0, 0, 0, -0.5], tried=[0, 7]) == 7
    assert best([0.0] * 8, tried=[]) == -1


@given(hnp.arrays(np.float64, 8, elements=st.floats(-1, 1)), st.integers(1, 255))
def test_the_best_is_tried_and_nearly_the_highest(q: FloatArray, mask: int) -> None:
    tried = [k for k in range(8) if mask >> k & 1]
    chosen = best(list(q), tried)
    assert chosen in tried
    assert q[chosen] >= max(q[k] for k in tried) - 0.02 - 1e-12


def test_tolerance_scales_with_the_discount() -> None:
    visits = np.ones((3, 3, 8), dtype=np.int64)
    for learning, less, action in (
        ({'gamma': 0.9}, 0.015, 1), ({'gamma': 0.98}, 0.015, 0), ({}, 0.015, 1), ({}, 0.025, 0)
    ):  # fmt: skip
        q = np.zeros((3, 3, 8))
        q[0, 0, :3] = 0.9, 0.9 - less, 0.9  # 45 degrees is the middle, if it counts as equal
        policy = Policy(q=q, visits=visits, regions=RegionMap(), learning=learning)
        assert policy.greedy_action((0, 0)) == action


@pytest.mark.parametrize('seed', range(3))
def test_the_unit_of_the_rewards_changes_no_action(seed: int) -> None:
    policies = []
    for unit in (1.0, 0.125):  # an eighth: every product is exact
        rewards = Rewards(goal=unit, bump=-unit, forbidden=-unit)
        arena = Arena(regions=RegionMap(rewards=rewards))
        config = LearningConfig(temperature_start=unit, temperature_end=0.01 * unit)
        policies.append(train(arena, config, rng=np.random.default_rng(seed)).policy)
    ones, eighths = policies
    assert (eighths.q == 0.125 * ones.q).all()
    assert eighths.actions == ones.actions


def test_a_table_alone_is_a_policy_where_it_fits() -> None:
    q = np.zeros((3, 3, 4))
    q[0, 1, 3] = -0.5
    policy = Policy.of_table(q, RegionMap())
    assert policy is not None
    assert (policy.greedy_action((0, 1)), policy.greedy_action((0, 0))) == (3, None)
    for shape in ((2, 3, 8), (3, 3, 5)):
        assert Policy.of_table(np.zeros(shape), RegionMap()) is None


def test_goal_and_unvisited_regions_have_no_action() -> None:
    visits = np.ones((3, 3, 8), dtype=np.int64)
    visits[2, 2] = 0
    policy = Policy(q=np.zeros((3, 3, 8)), visits=visits, regions=RegionMap())
    assert policy.greedy_action((1, 0)) is None
    assert policy.greedy_action((2, 2)) is None
    assert policy.greedy_action((0, 0)) is not None


def test_refuses_wrong_shapes_and_numbers() -> None:
    zeros, counts = np.zeros((3, 3, 8)), np.zeros((3, 3, 8), dtype=np.int64)
    with pytest.raises(ConfigurationError, match='q = '):
        Policy(q=np.zeros((3, 8)), visits=counts, regions=RegionMap())
    with pytest.raises(ConfigurationError, match='q = '):
        Policy(q=zeros + np.nan, visits=counts, regions=RegionMap())
    with pytest.raises(ConfigurationError, match='visits = -1'):
        Policy(q=zeros, visits=counts - 1, regions=RegionMap())


def test_cannot_be_changed() -> None:
    policy = Policy.unlearned(RegionMap())
    with pytest.raises(ValueError, match='read-only'):
        policy.q[0, 0, 0] = 1.0
