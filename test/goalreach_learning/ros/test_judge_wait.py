"""The first path waits for its judge, over real DDS."""

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from std_msgs.msg import Header

from goalreach_learning.ros.judge_wait import JudgeWait
from goalreach_msgs_py.ros.subscribe_raw import DEEP_QOS, RELIABLE_QOS
from goalreach_msgs_py.topics import JUDGED, TRANSITION
import graphs


@pytest.mark.parametrize('judge', ['', 'onlooker'])
def test_nobody_is_waited_for_who_is_not_named(judge: str) -> None:
    began: list[int] = []
    with graphs.onlooker(graphs.fresh_domain()) as (node, serve_until):
        publisher = node.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)
        JudgeWait(node, publisher, judge).when_listening(lambda: began.append(1))
        assert bool(began) is not bool(judge)
        node.create_subscription(DiagnosticArray, TRANSITION, lambda _: None, DEEP_QOS)
        assert serve_until(lambda: bool(began), 10.0)
    assert began == [1]


def test_another_listener_is_not_the_judge() -> None:
    domain, began = graphs.fresh_domain(), [0]
    with graphs.onlooker(domain) as (node, serve), graphs.onlooker(domain) as (other, _):
        publisher = node.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)
        other.create_subscription(DiagnosticArray, TRANSITION, lambda _: None, DEEP_QOS)
        assert serve(lambda: publisher.get_subscription_count() == 1, 10.0)
        JudgeWait(node, publisher, 'judge').when_listening(lambda: began.append(1))
        assert began == [0]


def test_who_judges_is_the_judge_before_its_name_is_known() -> None:
    domain, began = graphs.fresh_domain(), [0]
    with graphs.onlooker(domain) as (node, serve), graphs.onlooker(domain) as (other, _):
        publisher = node.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)
        other.create_publisher(Header, JUDGED, RELIABLE_QOS)
        JudgeWait(node, publisher, 'not its name').when_listening(lambda: began.append(1))
        assert serve(lambda: node.count_publishers(JUDGED) == 1, 10.0)
        assert not serve(lambda: len(began) > 1, 0.2)
        other.create_subscription(DiagnosticArray, TRANSITION, lambda _: None, DEEP_QOS)
        assert serve(lambda: began == [0, 1], 10.0)
