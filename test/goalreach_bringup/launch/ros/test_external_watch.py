"""Nodes of others: how they are found, and how a node in this process follows them."""

from __future__ import annotations

from collections.abc import Iterator
import itertools
import logging
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry as OdometryMsg
import pytest
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

from goalreach_bringup.launch.plan import ExternalNodes
from goalreach_bringup.launch.ros import external
from goalreach_bringup.launch.ros.external import ExternalWatch, find_external
from goalreach_msgs_py.pose_messages import odometry_to_raw, twist_to_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
from goalreach_msgs_py.topics import (
    CMD_VEL,
    CONTROLLER,
    GROUND_TRUTH,
    LOCALIZER,
    ODOM,
    PAUSE_SERVICE,
    RESET_SERVICE,
    ROBOT,
)
from goalreach_msgs_py.values import Odometry, Pose2, Twist2
import graphs

TWIST = Twist2(linear_m_per_s=0.25, steering_rad_per_s=-0.5)
TRUTH = Odometry(pose=Pose2(x_m=1.0, y_m=2.0, heading_rad=0.0), twist=TWIST)
BEGAN_S = 100.0


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    number = graphs.fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
    return number


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    graphs.join(domain)
    made = Node('follower')
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Give the time that the module sees."""
    now = SimpleNamespace(s=BEGAN_S)
    monkeypatch.setattr(external, 'time', SimpleNamespace(monotonic=lambda: now.s))
    return now


def stamped(stamp_ns: int) -> bytes:
    return odometry_to_raw(TRUTH, stamp_ns, frame_id='odom')


def poll_until(watch: ExternalWatch, begin_s: float, end_s: float, **given: bool) -> bool:
    """Poll as the launcher does; return whether the robot's clock has restarted."""
    steps = round((end_s - begin_s) / 0.04)
    polls = [watch.poll(begin_s + 0.04 * k, **given) for k in range(1, steps + 1)]
    return any(polls)


def test_silence_and_return_of_a_node_are_told_once(
    node: Node, clock: SimpleNamespace, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    watch = ExternalWatch(node, ExternalNodes(names=(ROBOT, LOCALIZER)), stamped=True)
    assert not poll_until(watch, 90.0, 99.0, drives=True)  # neither was heard so far
    assert not watch.poll(BEGAN_S, drives=True)
    watch._hear(ROBOT, stamped(1))
    watch._hear(LOCALIZER, b'')  # its messages are not read
    poll_until(watch, BEGAN_S, 101.92, drives=True)
    assert caplog.messages == []
    clock.s = 101.92
    watch._hear(LOCALIZER, b'')
    poll_until(watch, 101.92, 103.0, drives=True)
    silent = f'{ROBOT} (external): nothing on /odom for 2 s: the robot waits for it'
    assert caplog.messages == [silent]
    clock.s = 103.0
    watch._hear(ROBOT, stamped(2))
    poll_until(watch, 103.0, 103.4, drives=True)
    assert caplog.messages == [silent, f'{ROBOT} (external) is back']
    assert watch._stop is None


def test_no_node_is_silent_while_nobody_listened(
    node: Node, clock: SimpleNamespace, caplog: pytest.LogCaptureFixture
) -> None:
    del clock
    watch = ExternalWatch(node, ExternalNodes(names=(ROBOT,)), stamped=True)
    watch._hear(ROBOT, stamped(1))
    watch.poll(BEGAN_S + 60.0, drives=True)  # Ctrl-Z, then fg
    poll_until(watch, BEGAN_S + 60.0, BEGAN_S + 61.8, drives=True)
    assert caplog.messages == []
    poll_until(watch, BEGAN_S + 61.8, BEGAN_S + 62.2, drives=True)
    assert len(caplog.messages) == 1


@pytest.mark.usefixtures('clock')
def test_a_restarted_clock_is_told_once(node: Node) -> None:
    watch = ExternalWatch(node, ExternalNodes(names=(ROBOT, LOCALIZER)), stamped=True)
    for now, earlier in itertools.pairwise((9_000_000_000, 8_900_000_000, 8_950_000_000)):
        watch._hear(ROBOT, stamped(now))
        watch._hear(ROBOT, stamped(earlier))
        watch._hear(LOCALIZER, stamped(1))
        watch._hear(ROBOT, b'no message')
        assert not watch.poll(BEGAN_S, drives=True)
    watch._hear(ROBOT, stamped(8_800_000_000))
    assert watch.poll(BEGAN_S, drives=True)
    watch._hear(ROBOT, stamped(8_750_000_000))
    assert not watch.poll(BEGAN_S, drives=True)


@pytest.mark.parametrize('commands', [True, False])
@pytest.mark.usefixtures('clock')
def test_the_robot_is_stopped_for_a_second_where_nobody_drives(
    node: Node,
    commands: bool,  # noqa: FBT001
) -> None:
    watch = ExternalWatch(node, ExternalNodes(names=(ROBOT,)), stamped=commands)
    watch.poll(BEGAN_S, drives=True)
    assert node.count_publishers(CMD_VEL) == 0
    watch.poll(BEGAN_S + 0.05, drives=False)
    kind = 'geometry_msgs/msg/TwistStamped' if commands else 'geometry_msgs/msg/Twist'
    assert [info.topic_type for info in node.get_publishers_info_by_topic(CMD_VEL)] == [kind]
    watch.poll(BEGAN_S + 1.0, drives=True)
    assert watch._stop is not None
    watch.poll(BEGAN_S + 1.1, drives=True)
    assert watch._stop is None


@pytest.mark.parametrize(
    ('names', 'stops'), [((ROBOT,), False), ((CONTROLLER,), True), ((CONTROLLER,), False)]
)
@pytest.mark.usefixtures('clock')
def test_where_ours_does_not_drive_its_end_stops_no_robot(
    node: Node,
    names: tuple[str, ...],
    stops: bool,  # noqa: FBT001
) -> None:
    others = ExternalNodes(names=names, only_drives=CONTROLLER in names)
    watch = ExternalWatch(node, others, stamped=True, stops=stops)
    watch.poll(BEGAN_S, drives=False)
    assert node.count_publishers(CMD_VEL) == 0


def test_a_driver_that_falls_silent_is_replaced_by_standing(
    node: Node, clock: SimpleNamespace
) -> None:
    del clock
    for name, stops in ((LOCALIZER, False), (CONTROLLER, True)):
        watch = ExternalWatch(node, ExternalNodes(names=(name,)), stamped=True)
        watch._hear(name, b'')
        poll_until(watch, BEGAN_S, BEGAN_S + 2.2, drives=True)
        assert (watch._stop is not None) == stops


def test_commands_that_are_not_sent_are_told_once_a_second(
    node: Node, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    subscribed: list[Any] = []
    monkeypatch.setattr(external, 'subscribe_raw', lambda *given: subscribed.append(given))
    external.log_commands(node)
    ((_, kind, topic, hear, _),) = subscribed
    assert (kind, topic) == (TwistStamped, '/cmd_vel_not_sent')
    for stamp_ns, told in ((0, 1), (999_999_999, 1), (1_000_000_000, 2), (1, 2), (0, 3)):
        hear(stamp_ns, twist_to_raw(TWIST, stamp_ns))
        assert caplog.messages == ['not sent: 0.25 m/s, -0.50 rad/s'] * told


@pytest.mark.parametrize(
    ('name', 'topics'),
    [(ROBOT, (ODOM, GROUND_TRUTH)), (ROBOT, ()), ('bot', (ODOM, GROUND_TRUTH)), ('bot', (ODOM,))],
)
def test_a_robot_is_found_by_its_name_or_its_odometry(
    name: str, topics: tuple[str, ...], domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = name == ROBOT and len(topics) == 2
    monkeypatch.setattr(external, '_SETTLE_S', 20.0 if ours else 0.3)
    with graphs.onlooker(domain) as (watcher, _):
        robot = Node(name, context=watcher.context)
        for topic in topics:
            robot.create_publisher(OdometryMsg, topic, RELIABLE_QOS)
        for service in (RESET_SERVICE, PAUSE_SERVICE) * ours:
            robot.create_service(Trigger, service, lambda _, response: response)
        found = find_external((ROBOT,), (), lambda: False)
        robot.destroy_node()
    truth = GROUND_TRUTH in topics
    assert found == ExternalNodes(names=(ROBOT,), has_reset=ours, has_truth=truth)


@pytest.mark.parametrize('name', [CONTROLLER, 'driver'])
def test_a_node_of_another_name_that_sends_commands_only_drives(
    name: str, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(external, '_SETTLE_S', 20.0 if name == CONTROLLER else 0.3)
    with graphs.onlooker(domain) as (watcher, _):
        driver = Node(name, context=watcher.context)
        driver.create_publisher(TwistStamped, CMD_VEL, RELIABLE_QOS)
        found = find_external((CONTROLLER,), (), lambda: False)
        driver.destroy_node()
    assert found == ExternalNodes(names=(CONTROLLER,), only_drives=name != CONTROLLER)


def test_a_search_that_is_stopped_has_told_once_what_it_waits_for(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    asked = iter((False, False, True))
    assert find_external((ROBOT, LOCALIZER), (), lambda: next(asked)) is None
    signs = f'{ROBOT} or a publisher of /odom, {LOCALIZER} or a publisher of /pose'
    assert caplog.messages == [f'waiting for {signs} in ROS_DOMAIN_ID {domain}']
