"""Registration and acknowledgement over real DDS."""

from diagnostic_msgs.msg import DiagnosticArray
import pytest

from goalreach_msgs_py.ros.acknowledgement import (
    AcknowledgementGate,
    Acknowledger,
    is_subscribed,
)
from goalreach_msgs_py.ros.messaging import DEEP_QOS
from goalreach_msgs_py.topics import TRANSITION
import graphs

pytestmark = pytest.mark.graph

PERIOD_NS = 40


def test_a_gate_closes_when_a_window_is_full_and_opens_with_an_acknowledgement() -> None:
    opened: list[int] = []
    domain = graphs.fresh_domain()
    with graphs.onlooker(domain) as (node, serve), graphs.onlooker(domain) as (consumer, _):
        gate = AcknowledgementGate(
            node, ['onlooker'], period_ns=PERIOD_NS, on_room=lambda: opened.append(1)
        )
        gate.ticked(1000)
        assert gate.absent == ['onlooker']
        assert not gate.blocking
        acknowledger = Acknowledger(consumer, window_ticks=2)
        assert serve(lambda: not gate.absent, 10.0)
        assert not gate.blocking
        gate.ticked(1040)
        assert gate.blocking == ['onlooker']
        assert opened == []
        acknowledger.acknowledge(1000)
        assert serve(lambda: not gate.blocking, 10.0)
        assert opened == [1]


def test_a_consumer_registered_before_the_gate_existed_is_known_and_forgotten_at_its_end() -> None:
    opened: list[int] = []
    domain = graphs.fresh_domain()
    with graphs.onlooker(domain) as (node, serve), graphs.onlooker(domain) as (consumer, _):
        acknowledger = Acknowledger(consumer, window_ticks=1)
        acknowledger.acknowledge(40)  # of a simulator that has been restarted since
        gate = AcknowledgementGate(
            node, ['onlooker', 'other'], period_ns=PERIOD_NS, on_room=lambda: opened.append(1)
        )
        assert serve(lambda: gate.absent == ['other'], 10.0)
        gate.ticked(10_000)
        assert gate.blocking == ['onlooker']
        gate.forget_lost()
        assert gate.blocking == ['onlooker']
        for publisher in list(consumer.publishers):
            consumer.destroy_publisher(publisher)
        assert serve(lambda: node.count_publishers('/_acknowledged/onlooker') == 0, 10.0)
        gate.forget_lost()
        assert gate.blocking == []
        assert gate.absent == ['other']
        assert opened == [1]


def test_a_consumer_is_recognised_among_the_subscribers_by_its_process() -> None:
    domain = graphs.fresh_domain()
    with (
        graphs.onlooker(domain) as (node, serve),
        graphs.onlooker(domain) as (consumer, _),
        graphs.onlooker(domain) as (other, _),
    ):
        publisher = node.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)
        other.create_subscription(DiagnosticArray, TRANSITION, lambda _: None, DEEP_QOS)
        Acknowledger(consumer, window_ticks=1)
        assert serve(lambda: publisher.get_subscription_count() == 1, 10.0)
        assert serve(lambda: node.count_publishers('/_acknowledged/onlooker') == 1, 10.0)
        assert not is_subscribed(node, 'onlooker', publisher)
        consumer.create_subscription(DiagnosticArray, TRANSITION, lambda _: None, DEEP_QOS)
        assert serve(lambda: is_subscribed(node, 'onlooker', publisher), 10.0)
        assert not is_subscribed(node, 'nobody', publisher)
