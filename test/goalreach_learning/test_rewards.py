from goalreach_learning.task import reward_of
from goalreach_msgs_py.values import PathOutcome


def test_are_those_of_the_paper() -> None:
    assert reward_of(PathOutcome.GOAL) == 1.0
    assert reward_of(PathOutcome.BUMP) == -1.0
    assert reward_of(None) == 0.0


def test_a_timeout_is_not_punished() -> None:
    assert reward_of(PathOutcome.TIMEOUT) == 0.0
