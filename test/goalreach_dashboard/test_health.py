import pytest

from goalreach_dashboard.health import GraphHealth, NodeStatus, TopicRate


def make() -> GraphHealth:
    return GraphHealth({'robot': ('/clock',), 'eye': ('/pose',)})


def test_a_node_that_was_never_seen_is_unseen() -> None:
    assert make().status('robot', 100.0) is NodeStatus.UNSEEN


def test_a_killed_node_is_down_within_two_seconds() -> None:
    health = make()
    health.record_message('/clock', 10.0, 1)
    health.record_response('robot', 10.1)
    assert health.status('robot', 10.5) is NodeStatus.UP
    assert health.status('robot', 11.0) is NodeStatus.DOWN
    assert health.silence_s('robot', 12.1) == pytest.approx(2.0)


def test_a_node_without_input_is_quiet_not_down() -> None:
    health = make()
    health.record_message('/pose', 10.0, 1)
    health.record_response('eye', 19.8)
    assert health.status('eye', 20.0) is NodeStatus.QUIET


def test_a_node_that_came_back_at_once_was_down_for_all_to_see() -> None:
    health = make()
    health.record_message('/clock', 10.0, 1)
    assert health.status('robot', 11.0) is NodeStatus.DOWN
    health.record_message('/clock', 11.1, 1)
    health.record_message('/clock', 12.5, 30)
    assert health.status('robot', 12.6) is NodeStatus.DOWN
    health.record_message('/clock', 13.0, 40)
    assert health.status('robot', 13.1) is NodeStatus.UP


def test_rates_count_what_was_published_not_what_was_taken() -> None:
    rate = TopicRate()
    for tick in range(41):
        rate.record_message(0.05 * tick, 5 * tick + 1)
        hz = rate.rate_hz(0.05 * tick)
    assert hz == pytest.approx(100.0, rel=0.02)


def test_a_new_publisher_counts_from_one() -> None:
    rate = TopicRate()
    for number in (5, 6, 1, 2, 2):
        rate.record_message(1.0, number)
    assert rate.total == 4


def test_rates_keep_a_bounded_window() -> None:
    rate = TopicRate()
    for tick in range(10_000):
        rate.record_message(0.05 * tick, tick)
        rate.rate_hz(0.05 * tick)
    assert len(rate._samples) < 20
