from __future__ import annotations

import argparse
from types import SimpleNamespace

import pytest
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from goalreach_bringup.ros2cli.ros.qos import (
    add_qos_arguments,
    compatible_profile,
    profile_from_options,
)

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
    profile, told = compatible_profile('sensor_data', [publisher(*pair) for pair in offered])
    assert (profile.reliability, profile.durability) == chosen
    assert len(told) == notes
    assert all(line.startswith('Some, but not all, publishers are offering QoS') for line in told)


def options(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_qos_arguments(parser, preset='sensor_data')
    return parser.parse_args(arguments)


def test_no_policy_named_is_no_profile() -> None:
    assert profile_from_options(options()) is None
    assert profile_from_options(options('--qos-profile', 'default')) is None


def test_options_override_the_preset() -> None:
    profile = profile_from_options(
        options('--qos-reliability', 'reliable', '--qos-depth', '3', '--qos-history', 'keep_all')
    )
    assert profile is not None
    assert (profile.reliability, profile.durability) == (RELIABLE, VOLATILE)
    assert (profile.depth, profile.history) == (3, HistoryPolicy.KEEP_ALL)


def test_latched_needs_a_depth() -> None:
    profile = profile_from_options(
        options('--qos-profile', 'system_default', '--qos-durability', 'transient_local')
    )
    assert profile is not None
    assert profile.depth == 1
