"""What the page knows of a graph that shows glimpses, and of one that does not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import itertools
from typing import Final

import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node

from goalreach_bags.recording import TICK_TOPICS
from goalreach_dashboard.ros.listener import Listener
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import LandmarkObservation, PathOutcome, Pose2, Transition
from graphs import fresh_domain
from spoken_graph import PERIOD_NS, SpokenGraph, odometry_at, pose_at

SECOND: Final = 25
TURNS: Final = 2000
EACH_TICK: Final = tuple(topic for topic in TICK_TOPICS if topic != topics.IMAGE)


class Onlooker:
    """The page's listener, with somebody who looks at the page.

    Attributes:
        node: Its node.
        state: What it knows.
    """

    def __init__(self, context: Context) -> None:
        self.context = context
        self.node = Node('dashboard', context=context, enable_rosout=False)
        self.state = PageState(arena=Arena())
        self._listener = Listener(self.node, self.state)

    def totals(self) -> dict[str, int]:
        """Return how many messages of each topic were counted."""
        return {topic: self.state.health.topics[topic].total for topic in EACH_TICK}

    def listen(self) -> None:
        self._listener.listen(with_image=True)

    def follow(self, graph: SpokenGraph, tick: int) -> int:
        """Let the graph speak until the page knows a later tick; return the last that it knows."""
        for now in range(tick + 1, tick + TURNS):
            graph.say(now)
            graph.serve()
            self.listen()
            if self.state.clock_ns > (tick + SECOND) * PERIOD_NS:
                return self.settle(graph, now)
        raise AssertionError(self.state.clock_ns)

    def settle(self, graph: SpokenGraph, tick: int) -> int:
        """Wait until the page knows all of a tick, the last; return it."""
        stamp_ns = tick * PERIOD_NS
        state = self.state

        def known() -> bool:
            robot, picture, region = state.robot, state.picture, state.state
            if picture is None or region is None or robot.head is None:
                return False
            stamps = {state.clock_ns, robot.truth_ns, robot.estimate_ns, picture.stamp_ns}
            leds = [led.u_px for led in state.landmarks if led is not None]
            numbers = (region.goal_probability, robot.head.turret_rad, leds)
            whole = numbers == (1.0 / (tick + 1), 0.01 * tick, [tick])
            return stamps == {stamp_ns} and whole and any(robot.bumpers)

        self.wait(graph, known)
        return tick

    def wait(self, graph: SpokenGraph, condition: Callable[[], bool]) -> None:
        for _ in range(TURNS):
            if condition():
                return
            graph.serve()
            self.listen()
        raise AssertionError(vars(self.state.robot))

    @property
    def plain(self) -> list[str]:
        """Topics of every tick that it subscribes to."""
        listened = {each.topic_name for each in self.node.subscriptions}
        return sorted(listened & {*EACH_TICK, topics.IMAGE})

    def close(self) -> None:
        self.node.destroy_node()


@pytest.fixture
def onlooker() -> Iterator[Onlooker]:
    context = Context()
    rclpy.init(args=[], context=context, domain_id=fresh_domain())
    onlooker = Onlooker(context)
    yield onlooker
    onlooker.close()
    context.try_shutdown()


@contextmanager
def spoken(
    onlooker: Onlooker, *, glimpses: bool, remaps: Sequence[str] = ()
) -> Iterator[SpokenGraph]:
    graph = SpokenGraph(onlooker.context, glimpses=glimpses, remaps=remaps)
    try:
        yield graph
    finally:
        graph.close()


@pytest.mark.parametrize('glimpses', [True, False])
def test_it_knows_what_was_said(onlooker: Onlooker, *, glimpses: bool) -> None:
    with spoken(onlooker, glimpses=glimpses) as graph:
        last = onlooker.follow(graph, 0)
    state, robot = onlooker.state, onlooker.state.robot
    assert robot.truth == robot.compared == pose_at(last)
    assert robot.error_m == pytest.approx(0.03)
    assert robot.error_rad == pytest.approx(0.1)
    assert robot.odometry is not None
    moved_m = robot.odometry.x_m - pose_at(0).x_m
    assert moved_m == pytest.approx(odometry_at(last).x_m)
    assert robot.head is not None
    assert robot.head.turret_rad == 0.01 * last
    assert [number for number, on in enumerate(robot.bumpers) if on] == [4]
    assert state.state is not None
    assert state.state.mu_x == (0.25, 0.75, 0.0)
    assert state.fov_rad == pytest.approx(2.0 * np.arctan(0.5))
    led = LandmarkObservation(u_px=float(last), v_px=1.0, peak_dn=200.0)
    assert state.landmarks == (led, None, None)
    assert isinstance(state.picture, CameraPicture)
    assert state.picture.landmarks == (led, None, None)
    assert (state.picture.width_px, state.picture.height_px) == (4, 3)
    assert set(state.health.topics) == {*EACH_TICK, topics.IMAGE}


def test_glimpses_spare_the_graph_every_other_message(onlooker: Onlooker) -> None:
    with spoken(onlooker, glimpses=True) as graph:
        last = onlooker.follow(graph, 0)
        before = onlooker.totals()
        for tick in range(last + 1, last + SECOND + 1):
            graph.say(tick)
        onlooker.settle(graph, last + SECOND)

        def gained() -> dict[str, int]:
            return {topic: total - before[topic] for topic, total in onlooker.totals().items()}

        # What the page does with commands is to count them: the last before may have come late.
        onlooker.wait(graph, lambda: gained()[topics.CMD_VEL] >= SECOND)
        counts = {topic: count for topic, count in gained().items() if topic != topics.CMD_VEL}
    assert set(counts.values()) == {SECOND}
    assert onlooker.plain == []
    points = [float(point.split(',')[0]) for point in onlooker.state.robot.trail.text.split()]
    steps_cm = [after - before for before, after in itertools.pairwise(points)]
    assert max(steps_cm) < 2.5, 'no true pose was left out'


def test_it_listens_to_topics_where_there_are_no_glimpses_any_more(onlooker: Onlooker) -> None:
    with spoken(onlooker, glimpses=True) as graph:
        last = onlooker.follow(graph, 0)
    with spoken(onlooker, glimpses=False) as graph:
        last = onlooker.follow(graph, last)
        assert onlooker.plain == sorted((*EACH_TICK, topics.IMAGE))
    with spoken(onlooker, glimpses=True) as graph:
        onlooker.follow(graph, last)
        assert onlooker.plain == []


def test_a_graph_that_is_started_again_is_followed(onlooker: Onlooker) -> None:
    with spoken(onlooker, glimpses=True) as graph:
        onlooker.follow(graph, 10 * SECOND)
    before = onlooker.state.health.topics[topics.STATE].total
    with spoken(onlooker, glimpses=True) as graph:
        onlooker.state.clock_ns = 0
        last = onlooker.follow(graph, 0)
        assert onlooker.plain == []
    assert onlooker.state.robot.compared == pose_at(last)
    assert onlooker.state.health.topics[topics.STATE].total > before


def test_a_topic_that_comes_from_elsewhere_is_listened_to(onlooker: Onlooker) -> None:
    remaps = [f'{topic}:=/unfiltered{topic}' for topic in (topics.POSE, topics.IMAGE)]
    with spoken(onlooker, glimpses=True, remaps=remaps) as graph:
        for topic in (topics.POSE, topics.IMAGE):
            graph.relay(f'/unfiltered{topic}', topic)
        ticks = itertools.count(1)

        def listens() -> bool:
            graph.say(next(ticks))
            return onlooker.plain == [topics.IMAGE, topics.POSE]

        onlooker.wait(graph, listens)
        onlooker.follow(graph, next(ticks))


@pytest.mark.parametrize('glimpses', [True, False])
def test_an_end_is_judged_by_the_truth_of_its_tick(onlooker: Onlooker, *, glimpses: bool) -> None:
    goal = Pose2(x_m=1.778, y_m=0.5, heading_rad=0.0)
    with spoken(onlooker, glimpses=glimpses) as graph:
        last = onlooker.follow(graph, 0)
        for tick, truth in ((last + 1, goal), (last + 2, pose_at(0))):
            graph.act(tick, _goal(path=tick))
            graph.say(tick, truth)
        graph.say(last + 3, goal)
        book = onlooker.state.book
        onlooker.wait(graph, lambda: book.paths == 2)
    assert (book.goals, book.false_goals) == (1, 1)


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
