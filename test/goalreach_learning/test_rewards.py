"""Rewards of what ends a path."""

import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import Rewards
from goalreach_msgs_py.values import PathOutcome


def test_are_those_of_the_paper() -> None:
    assert Rewards().of(PathOutcome.GOAL) == 1.0
    assert Rewards().of(PathOutcome.BUMP) == -1.0
    assert Rewards().of(None) == 0.0


def test_a_timeout_is_not_punished() -> None:
    assert Rewards().of(PathOutcome.TIMEOUT) == 0.0


def test_a_document_may_give_some_of_them() -> None:
    rewards = Rewards.read({'goal': 10, 'forbidden': -5})
    assert [rewards.of(outcome) for outcome in PathOutcome] == [10.0, -1.0, -5.0, 0.0]


@pytest.mark.parametrize(('name', 'value'), [('goal', 0), ('bump', 0.5), ('forbidden', 'much')])
def test_the_goal_alone_is_worth_something(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError, match=f'rewards.{name} = {value!r}'):
        Rewards.read({name: value})


def test_unknown_rewards_are_refused() -> None:
    with pytest.raises(ConfigurationError, match='a mapping of goal, bump, forbidden'):
        Rewards.read({'sofa': 1.0})
