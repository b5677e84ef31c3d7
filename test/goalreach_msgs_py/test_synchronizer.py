"""Joining topics by stamp."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.synchronizer import StampSynchronizer


def test_a_set_is_handed_out_when_complete_whatever_the_order() -> None:
    join = StampSynchronizer(['a', 'b'])
    assert join.add('b', 7, 'B7') is None
    assert join.add('b', 8, 'B8') is None
    assert join.add('a', 7, 'A7') == {'a': 'A7', 'b': 'B7'}
    assert join.add('a', 8, 'A8') == {'a': 'A8', 'b': 'B8'}
    assert join.last_stamp_ns == 8


def test_older_than_the_last_set_is_dropped() -> None:
    join = StampSynchronizer(['a', 'b'])
    join.add('a', 9, 1)
    join.add('b', 9, 1)
    join.add('a', 5, 2)
    assert join.add('b', 5, 2) is None


def test_the_last_stamp_can_be_asked_again() -> None:
    join = StampSynchronizer(['a', 'b'])
    for _ in range(2):
        assert join.add('a', 9, 1) is None
        assert join.add('b', 9, 1) == {'a': 1, 'b': 1}


def test_incomplete_sets_do_not_pile_up() -> None:
    join = StampSynchronizer(['a', 'b'], depth=3)
    for stamp in range(10):
        join.add('a', stamp, stamp)
    assert join.add('b', 0, 0) is None
    assert join.add('b', 9, 9) == {'a': 9, 'b': 9}


def test_unknown_input_is_an_error() -> None:
    with pytest.raises(KeyError):
        StampSynchronizer(['a']).add('c', 0, 0)


@given(st.permutations([(name, stamp) for name in 'ab' for stamp in range(4)]))
def test_stamps_come_out_in_order_and_never_mixed(order: list[tuple[str, int]]) -> None:
    join = StampSynchronizer(['a', 'b'])
    handed_out = []
    for name, stamp in order:
        complete = join.add(name, stamp, stamp)
        if complete is not None:
            assert set(complete.values()) == {stamp}
            handed_out.append(stamp)
    assert handed_out == sorted(handed_out)
    assert handed_out[-1] == 3
