"""Detecting bad inputs."""

from goalreach_msgs_py.inputs import InputMonitor

S = 1_000_000_000


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


def test_a_clock_that_went_back_is_not_harmless() -> None:
    """An aligner takes no image until the time before has come again."""
    monitor = InputMonitor()
    monitor.received('a', 10 * S, 0.0)
    problem = monitor.received('a', 5 * S, 0.1)
    assert problem is not None
    assert (problem.kind, problem.is_harmless) == ('back', False)
    assert problem.text == 'its clock went back by 5.00 s: this node may have to be restarted'
    assert not problem_of(monitor, 'a', 6 * S, 0.2)


def test_a_stalled_node_reports_that_alone() -> None:
    monitor = InputMonitor()
    monitor.received('a', 0, 0.0)
    monitor.received('b', 0, 0.0)
    monitor.check(0.1)
    monitor.received('b', S, 1.6)
    problems = monitor.check(1.6)
    assert [(t.topic, t.kind, t.text) for t in problems] == [('', 'stalled', 'stalled for 1.50 s')]
    assert not monitor.check(1.8)


def test_a_required_input_that_never_comes_is_reported_after_the_time_of_discovery() -> None:
    monitor = InputMonitor(['a', 'b'])
    monitor.check(-9.0)  # since then nothing came, until b did
    for tick in range(11):
        monitor.received('b', tick * S // 5, tick * 0.2)
        assert not [p for p in monitor.check(tick * 0.2) if p.kind != 'stalled']
    monitor.received('b', 3 * S, 2.2)
    (problem,) = monitor.check(2.2)
    assert (problem.topic, problem.kind, problem.text) == ('a', 'absent', 'never came in 2 s')
    assert not problem.is_harmless


def test_where_nothing_comes_at_all_every_required_input_is_named() -> None:
    monitor = InputMonitor(['a', 'b'])
    for tick in range(11):
        assert not monitor.check(tick * 0.2)
    problems = monitor.check(2.2)
    assert [(p.topic, p.kind) for p in problems] == [('a', 'waiting'), ('b', 'waiting')]
    assert all(p.is_harmless for p in problems)
