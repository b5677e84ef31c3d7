import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_learning.learner import Agent, LearnerSetup, Situation
from goalreach_learning.learners.tabular import PaperLearner
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import (
    LearningConfig,
    boltzmann_probabilities,
    q_update,
    select_action,
)
from goalreach_msgs_py.regions import RegionMap


def setup(config: LearningConfig | None = None) -> LearnerSetup:
    rng = np.random.default_rng(0)
    return LearnerSetup(shape=(3, 3, 8), config=config or LearningConfig(), rng=rng)


def agent(policy: Policy | None = None) -> Agent:
    return Agent('paper', RegionMap(), LearningConfig(), np.random.default_rng(0), policy)


Q_VALUES = st.lists(st.floats(-2.0, 2.0), min_size=8, max_size=8)


def test_equation_1_by_hand() -> None:
    # 0.75 * 0.4 + 0.25 * (0 + 0.9 * 0.8) = 0.3 + 0.18
    assert q_update(0.4, 0.0, [0.1, 0.8], alpha=0.25, gamma=0.9) == pytest.approx(0.48)


def test_a_terminal_state_has_no_future_value() -> None:
    assert q_update(0.4, -1.0, [], alpha=0.25, gamma=0.9) == pytest.approx(0.3 - 0.25)


def test_equation_2_by_hand() -> None:
    # e^0 : e^(ln 3) at T = 1 is 1 : 3
    assert boltzmann_probabilities([0.0, math.log(3.0)], 1.0) == pytest.approx([0.25, 0.75])
    # half the temperature squares the ratio: 1 : 9
    assert boltzmann_probabilities([0.0, math.log(3.0)], 0.5) == pytest.approx([0.1, 0.9])


def test_equation_2_stays_finite_where_its_exponentials_do_not() -> None:
    assert boltzmann_probabilities([1e6, 0.0], 1e-3) == [1.0, 0.0]


@given(Q_VALUES, st.floats(1e-3, 1e3))
def test_probabilities_sum_to_one_and_keep_the_order_of_values(
    q: list[float], temperature: float
) -> None:
    p = boltzmann_probabilities(q, temperature)
    assert math.fsum(p) == pytest.approx(1.0)
    assert p[q.index(max(q))] == max(p)


@given(Q_VALUES, st.floats(0.0, 1.0, exclude_max=True), st.floats(0.01, 10.0))
def test_selects_the_samples_place_in_the_distribution(
    q: list[float], uniform: float, temperature: float
) -> None:
    chosen = select_action(q, visited=True, temperature=temperature, uniform=uniform)
    cumulative = np.cumsum(boltzmann_probabilities(q, temperature))
    assert cumulative[chosen] >= uniform - 1e-12
    assert chosen == 0 or cumulative[chosen - 1] <= uniform + 1e-12


def test_choice_in_an_unvisited_state_is_uniform() -> None:
    q = [100.0] + [0.0] * 7  # would always win by equation (2)
    chosen = [
        select_action(q, visited=False, temperature=0.1, uniform=(k + 0.5) / 8) for k in range(8)
    ]
    assert chosen == list(range(8))


def test_a_sample_above_the_rounded_sum_takes_the_last_action_that_is_possible() -> None:
    q = [98.5, 72.0, -75.8, -33.5, 44.3, 42.2, 87.3, -15.6, -1e6]
    assert select_action(q, visited=True, temperature=5.0, uniform=1 - 2**-53) == 7


CHAIN = ((0, 2), (0, 1), (0, 0), (1, 0))
"""Action 0 leads from one to the next and out of the last into the goal; others stay."""


def test_learns_the_values_of_a_chain() -> None:
    config = LearningConfig(alpha=0.5, gamma=0.8, temperature_end=1.0)
    learner = PaperLearner(setup(config))
    for _ in range(400):
        place = 0
        while place < len(CHAIN):
            action = learner.choose(Situation(CHAIN[place], x_m=0.0, y_m=0.0))
            after = place + (action == 0)
            done = after == len(CHAIN)
            next_state = CHAIN[place] if done else CHAIN[after]
            learner.learn(CHAIN[place], action, float(done), next_state, terminal=done)
            place = after
    for index, (i, j) in enumerate(CHAIN):
        distance = len(CHAIN) - index
        assert learner.q[i][j][0] == pytest.approx(0.8 ** (distance - 1), abs=1e-9)
        assert learner.q[i][j][3] == pytest.approx(0.8**distance, abs=1e-9)


def test_continues_from_a_policy() -> None:
    begun = agent()
    first = begun.learner
    assert isinstance(first, PaperLearner)
    first.learn((0, 0), 3, 1.0, (1, 0), terminal=True)
    second = agent(begun.policy).learner
    assert isinstance(second, PaperLearner)
    second.learn((0, 0), 3, 1.0, (1, 0), terminal=True)
    assert second.q[0][0][3] == pytest.approx(0.3 + 0.7 * 0.3)
    assert second.visits[0][0][3] == 2
    assert first.visits[0][0][3] == 1


def test_a_policy_is_a_snapshot() -> None:
    begun = agent()
    before = begun.policy
    assert isinstance(begun.learner, PaperLearner)
    begun.learner.learn((0, 0), 3, 1.0, (1, 0), terminal=True)
    assert before.q[0, 0, 3] == 0.0
    assert before.learning['gamma'] == 0.9
