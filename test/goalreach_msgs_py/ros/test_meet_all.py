from __future__ import annotations

from types import SimpleNamespace

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from goalreach_msgs_py.ros.messaging import meet_all

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
VOLATILE, LATCHED = DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL


def publisher(reliability: object, durability: object) -> SimpleNamespace:
    profile = QoSProfile(depth=1, reliability=reliability, durability=durability)
    return SimpleNamespace(qos_profile=profile)


@pytest.mark.parametrize(
    ('offered', 'chosen', 'notes'),
    [
        ([], (BEST_EFFORT, VOLATILE), 0),
        ([(RELIABLE, VOLATILE)], (RELIABLE, VOLATILE), 0),
        ([(RELIABLE, LATCHED)] * 2, (RELIABLE, LATCHED), 0),
        ([(BEST_EFFORT, VOLATILE)], (BEST_EFFORT, VOLATILE), 0),
        ([(RELIABLE, LATCHED), (BEST_EFFORT, LATCHED)], (BEST_EFFORT, LATCHED), 1),
        ([(RELIABLE, LATCHED), (BEST_EFFORT, VOLATILE)], (BEST_EFFORT, VOLATILE), 2),
    ],
)
def test_strictest_profile_that_all_publishers_meet(
    offered: list[tuple[object, object]], chosen: tuple[object, object], notes: int
) -> None:
    profile = QoSProfile(depth=5, reliability=BEST_EFFORT)
    told = meet_all(profile, [publisher(*pair) for pair in offered])
    assert (profile.reliability, profile.durability) == chosen
    assert len(told) == notes
    assert all(line.startswith('Some, but not all, publishers are offering QoS') for line in told)
