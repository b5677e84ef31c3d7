"""What the page knows of a graph, over real DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import itertools
import math
from typing import Final

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
import numpy as np
import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from goalreach_bags.recording import TICK_TOPICS
from goalreach_dashboard.ros.listener import GraphListener
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.messaging import LATCHED_QOS
from goalreach_msgs_py.values import (
    HeadAngles,
    LandmarkObservation,
    PathOutcome,
    Pose2,
    Transition,
)
from graphs import fresh_domain, join
from scripted_graph import PERIOD_NS, ScriptedGraph, odometry_at, pose_at

SECOND: Final = 25
TURNS: Final = 2000
EACH_TICK: Final = tuple(topic for topic in TICK_TOPICS if topic != topics.IMAGE)
ALWAYS: Final = {topics.TRANSITION, topics.Q_TABLE, topics.MODEL}


class Page:
    """The page's listener, watched unless a test says otherwise.

    Attributes:
        node: Its node.
        state: What it knows.
        listener: The listener.
    """

    def __init__(self, context: Context, robot: str = '') -> None:
        self.context = context
        self.node = Node('dashboard', namespace=robot, context=context, enable_rosout=False)
        self.state = PageState(arena=Arena())
        self.listener = GraphListener(self.node, self.state)
        self.listener.watch(watched=True)

    def totals(self) -> dict[str, int]:
        """Return the number of messages counted of each topic."""
        return {topic: self.state.health.topics[topic].total for topic in EACH_TICK}

    def follow(self, graph: ScriptedGraph, tick: int) -> int:
        """Publish ticks until the page knows a later one; return the last that it knows."""
        for now in range(tick + 1, tick + TURNS):
            graph.publish_tick(now)
            graph.spin_once()
            self.listener.update()
            if self.state.clock_ns > (tick + SECOND) * PERIOD_NS:
                return self.settle(graph, now)
        raise AssertionError(self.state.clock_ns)

    def settle(self, graph: ScriptedGraph, tick: int) -> int:
        """Wait until the page knows all of a tick, the last; return it."""
        stamp_ns = tick * PERIOD_NS
        state = self.state

        def is_known() -> bool:
            poses, picture, region = state.poses, state.picture, state.state
            if picture is None or region is None or state.head is None:
                return False
            stamps = {state.clock_ns, poses.truth_ns, poses.estimate_ns}
            seen = (*state.landmarks, *picture.landmarks)
            leds = [led.u_px for led in seen if led is not None]
            numbers = (region.goal_probability, state.head.turret_rad, leds)
            whole = numbers == (1.0 / (tick + 1), 0.01 * tick, [tick, tick])
            return stamps == {stamp_ns} and whole and any(state.bumpers)

        self.wait(graph, is_known)
        return tick

    def wait(self, graph: ScriptedGraph, condition: Callable[[], bool]) -> None:
        for _ in range(TURNS):
            if condition():
                return
            graph.spin_once()
            self.listener.update()
        raise AssertionError(vars(self.state.poses))

    @property
    def subscribed(self) -> set[str]:
        """Topics that it subscribes to."""
        return {each.topic_name for each in self.node.subscriptions}

    def close(self) -> None:
        self.node.destroy_node()


@pytest.fixture
def page() -> Iterator[Page]:
    context = Context()
    join(fresh_domain(), context)
    page = Page(context)
    yield page
    page.close()
    context.try_shutdown()


@contextmanager
def scripted(page: Page, *, compressed: bool = True) -> Iterator[ScriptedGraph]:
    graph = ScriptedGraph(page.context, compressed=compressed)
    try:
        yield graph
    finally:
        graph.close()


@pytest.mark.parametrize('compressed', [True, False])
def test_it_knows_what_was_published(page: Page, *, compressed: bool) -> None:
    """A replayed bag has no compressed images."""
    with scripted(page, compressed=compressed) as graph:
        last = page.follow(graph, 0)
    state, poses = page.state, page.state.poses
    assert poses.truth == poses.compared == pose_at(last)
    assert poses.error == pytest.approx((0.03, 0.1))
    assert poses.odometry is not None
    moved_m = poses.odometry.x_m - pose_at(0).x_m
    assert moved_m == pytest.approx(odometry_at(last).x_m)
    assert state.head is not None
    assert state.head.turret_rad == 0.01 * last
    assert [number for number, on in enumerate(state.bumpers) if on] == [4]
    assert state.state is not None
    assert state.state.mu_x == (0.25, 0.75, 0.0)
    assert state.fov_rad == pytest.approx(2.0 * np.arctan(0.5))
    led = LandmarkObservation(u_px=float(last), v_px=1.0, peak_dn=200.0)
    assert state.landmarks == (led, None, None)
    assert isinstance(state.picture, CameraPicture)
    assert state.picture.landmarks == (led, None, None)
    assert (state.picture.width_px, state.picture.height_px) == (4, 3)
    image = topics.COMPRESSED_IMAGE if compressed else topics.IMAGE
    assert set(state.health.topics) - {topics.IMAGE} == {*EACH_TICK, image} - {topics.IMAGE}
    assert image in state.health.topics


def test_every_message_counts_and_no_true_pose_is_left_out(page: Page) -> None:
    with scripted(page) as graph:
        last = page.follow(graph, 0)
        before = page.totals()
        for tick in range(last + 1, last + SECOND + 1):
            graph.publish_tick(tick)
        page.settle(graph, last + SECOND)

        def gained() -> set[int]:
            return {total - before[topic] for topic, total in page.totals().items()}

        page.wait(graph, lambda: gained() == {SECOND})
    points = [float(point.split(',')[0]) for point in page.state.poses.trail.text.split()]
    steps_cm = [after - before for before, after in itertools.pairwise(points)]
    assert max(steps_cm) < 2.5


def test_an_unwatched_page_subscribes_to_what_is_learned_only(page: Page) -> None:
    with scripted(page) as graph:
        last = page.follow(graph, 0)
        assert page.subscribed == {
            *EACH_TICK,
            topics.BEHAVIORS,
            topics.COMPRESSED_IMAGE,
            topics.DIAGNOSTICS,
            topics.MARKERS,
            *ALWAYS,
        }
        page.listener.watch(watched=False)
        assert page.subscribed == ALWAYS
        graph.publish_transition(last, _goal(path=1))
        page.wait(graph, lambda: page.state.paths.outcomes.total() == 1)
        page.listener.watch(watched=True)
        assert page.state.poses.trail.text == ''
        page.follow(graph, last)


def test_a_graph_that_is_started_again_is_followed(page: Page) -> None:
    with scripted(page) as graph:
        page.follow(graph, 10 * SECOND)
    before = page.state.health.topics[topics.STATE].total
    with scripted(page) as graph:
        page.state.clock_ns = 0
        last = page.follow(graph, 0)
    assert page.state.poses.compared == pose_at(last)
    assert page.state.health.topics[topics.STATE].total > before


def test_the_clock_of_another_robot_is_left_for_its_own(page: Page) -> None:
    """The page is open before the robot's nodes are there."""
    robot = Page(page.context, 'robot2')
    clocks: list[Publisher[Clock]] = []
    with scripted(page) as graph:

        def shows(stamp_ns: int) -> bool:
            graph.publish_tick(1)
            for clock in clocks:
                clock.publish(Clock(clock=Time(sec=7)))
            return robot.state.clock_ns == stamp_ns

        robot.wait(graph, lambda: shows(PERIOD_NS))
        clocks.append(robot.node.create_publisher(Clock, '/robot2/clock', 1))
        robot.wait(graph, lambda: shows(7_000_000_000))
    assert topics.CLOCK not in robot.subscribed
    robot.close()


def test_obstacles_are_known_but_those_that_are_nowhere(page: Page) -> None:
    """A browser can read no number that is not finite."""
    markers = [
        Marker(
            ns=name,
            type=Marker.CYLINDER,
            pose=Pose(position=Point(x=x_m, y=2.0), orientation=Quaternion(w=1.0)),
            scale=Vector3(x=0.5, y=0.25, z=1.0),
        )
        for name, x_m in (('obstacles', 1.0), ('obstacles', math.nan), ('leds', 3.0))
    ]
    publisher = page.node.create_publisher(MarkerArray, topics.MARKERS, LATCHED_QOS)
    publisher.publish(MarkerArray(markers=markers))
    with scripted(page) as graph:
        page.wait(graph, lambda: bool(page.state.obstacles))
    assert page.state.obstacles == [(1.0, 2.0, 0.5, 0.25, 0.0, True)]


def test_commands_without_a_stamp_are_counted(page: Page) -> None:
    robot = Page(page.context, 'robot2')
    robot.state.parameters[topics.CONTROLLER] = {'stamped_cmd_vel': False}
    robot.listener.update()
    publisher = robot.node.create_publisher(Twist, 'cmd_vel', 1)
    with scripted(page) as graph:

        def counted() -> bool:
            publisher.publish(Twist())
            return topics.CMD_VEL in robot.state.health.topics

        robot.wait(graph, counted)
    robot.close()


def test_the_joints_that_a_head_has_are_shown_and_wheels_are_not(page: Page) -> None:
    publisher = page.node.create_publisher(JointState, topics.JOINT_STATES, 10)
    with scripted(page) as graph:
        page.wait(graph, lambda: publisher.get_subscription_count() > 0)
        for name, angle_rad in (('pan_joint', 0.25), ('left_wheel_joint', 9.0)):
            publisher.publish(JointState(name=[name], position=[angle_rad]))
        page.wait(graph, lambda: page.state.head is not None)
    assert page.state.head == HeadAngles(turret_rad=0.0, pan_rad=0.25, tilt_rad=0.0)


def test_an_end_is_judged_by_the_truth_of_its_tick(page: Page) -> None:
    goal = Pose2(x_m=1.778, y_m=0.5, heading_rad=0.0)
    with scripted(page) as graph:
        last = page.follow(graph, 0)
        for tick, truth in ((last + 1, goal), (last + 2, pose_at(0))):
            graph.publish_transition(tick, _goal(path=tick))
            graph.publish_tick(tick, truth)
        graph.publish_tick(last + 3, goal)
        paths = page.state.paths
        page.wait(graph, lambda: paths.outcomes.total() == 2)
    assert paths.outcomes == {'goal': 1, 'false-goal': 1}


def _goal(*, path: int) -> Transition:
    return Transition(
        state=(1, 1),
        action=6,
        reward=1.0,
        next_state=(1, 0),
        temperature=0.1,
        trial=0,
        path=path,
        outcome=PathOutcome.GOAL,
    )
