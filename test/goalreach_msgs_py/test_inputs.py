"""Joining topics by stamp, and detecting bad inputs."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.inputs import InputMonitor, StampSynchronizer

S = 1_000_000_000


def test_a_set_is_handed_out_when_complete_whatever_the_order() -> None:
    join = StampSynchronizer(['a', 'b'])
    assert join.add('b', 7, 'B7') is None
    assert join.add('b', 8, 'B8') is None
    assert join.add('a', 7, 'A7') == {'a': 'A7', 'b': 'B7'}
    assert join.add('a', 8, 'A8') == {'a': 'A8', 'b': 'B8'}


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


def problem_of(monitor: InputMonitor, topic: str, stamp_ns: int, now_s: float) -> str:
    """Return the kind and text of the problem of one message."""
    problem = monitor.received(topic, stamp_ns, now_s)
    return '' if problem is None else f'{problem.kind}: {problem.text}'


def test_good_inputs_have_no_problem() -> None:
    monitor = InputMonitor()
    for tick in range(50):
        now_s = tick * 0.04
        assert not problem_of(monitor, 'a', tick * S // 25, now_s)
        assert not problem_of(monitor, 'b', tick * S // 25, now_s + 0.01)
        assert not monitor.check(now_s + 0.02)


def test_a_silent_input_is_reported_while_another_continues() -> None:
    monitor = InputMonitor()
    monitor.received('a', 0, 0.0)
    for tick in range(8):
        monitor.received('b', tick * S // 5, tick * 0.2)
        problems = monitor.check(tick * 0.2)
    assert [(t.topic, t.kind, t.text) for t in problems] == [('a', 'silent', 'nothing for 1.4 s')]


def test_when_all_are_silent_nothing_is_reported() -> None:
    monitor = InputMonitor()
    monitor.received('a', 0, 0.0)
    monitor.received('b', 0, 0.0)
    assert [monitor.check(tick * 0.2) for tick in range(20)] == [[]] * 20


def test_stamps_that_are_apart_are_reported() -> None:
    monitor = InputMonitor()
    monitor.received('a', 10 * S, 0.0)
    monitor.received('b', 10 * S, 0.0)
    assert problem_of(monitor, 'a', 15 * S, 0.05) == 'apart: 5.00 s ahead of b'
    monitor.received('a', 10 * S, 0.1)
    assert problem_of(monitor, 'a', 5 * S, 0.15) == 'apart: 5.00 s behind b'


def test_duplicates_and_wrong_order_are_harmless() -> None:
    monitor = InputMonitor()
    monitor.received('a', 10 * S, 0.0)
    assert problem_of(monitor, 'a', 10 * S, 0.1) == 'duplicate: a message came twice'
    assert (
        problem_of(monitor, 'a', 9 * S + S // 2, 0.2)
        == 'order: out of order: 0.50 s before the last'
    )
    problem = monitor.received('a', 9 * S, 0.3)
    assert problem is not None
    assert problem.is_harmless


def test_a_stalled_node_reports_that_alone() -> None:
    monitor = InputMonitor()
    monitor.received('a', 0, 0.0)
    monitor.received('b', 0, 0.0)
    monitor.check(0.1)
    monitor.received('b', S, 1.6)
    problems = monitor.check(1.6)
    assert [(t.topic, t.kind, t.text) for t in problems] == [('', 'stalled', 'stalled for 1.50 s')]
    assert not monitor.check(1.8)


def test_what_a_synchronizer_misses_is_reported_by_name() -> None:
    join = StampSynchronizer(['a', 'b'])
    monitor = InputMonitor()
    for tick in range(10):
        join.add('a', tick, 'A')
        monitor.received('a', tick, tick * 0.04)
        if tick % 5 == 0:
            join.add('b', tick, 'B')
            monitor.received('b', tick, tick * 0.04)
    assert join.missing == {'a': 0, 'b': 4}
    assert [t.text for t in monitor.check(0.4, join.missing)] == ['4 messages were missing']
    assert not monitor.check(0.5, join.missing)


def test_stamps_from_the_future_do_not_block_a_synchronizer() -> None:
    join = StampSynchronizer(['a', 'b'], depth=4)
    for tick in range(20):
        join.add('a', 1000 + tick, 'A')
    for tick in range(20):
        join.add('a', tick, 'A')
        assert join.add('b', tick, 'B') is not None


def test_a_required_input_that_never_comes_is_reported_after_the_time_of_discovery() -> None:
    monitor = InputMonitor(['a', 'b'])
    for tick in range(26):
        monitor.received('b', tick * S // 5, tick * 0.2)
        assert not monitor.check(tick * 0.2)
    monitor.received('b', 6 * S, 5.2)
    problems = monitor.check(5.2)
    assert [(p.topic, p.kind, p.text) for p in problems] == [('a', 'silent', 'nothing for 5.2 s')]
