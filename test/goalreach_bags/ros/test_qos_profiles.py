"""Quality of service to the bag and back."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from goalreach_bags.ros.qos_profiles import _offer, publisher_profile
from small_bags import DEFAULT_OFFER


def test_publishers_that_differ_are_replaced_by_the_strictest() -> None:
    deadline = Duration(seconds=1, nanoseconds=500_000_000)
    latched = _offer(QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    timed = _offer(QoSProfile(depth=7, deadline=deadline))
    assert timed['deadline'] == {'sec': 1, 'nsec': 500_000_000}
    assert publisher_profile([timed, timed]).deadline == deadline
    both = publisher_profile([latched, timed, DEFAULT_OFFER])
    assert (both.depth, both.durability) == (7, DurabilityPolicy.TRANSIENT_LOCAL)
    assert both.reliability is ReliabilityPolicy.RELIABLE
    usual = publisher_profile([DEFAULT_OFFER])
    assert (usual.depth, usual.deadline) == (10, QoSProfile(depth=10).deadline)
    assert publisher_profile([{**latched, 'depth': 0}] * 2).depth == 2
