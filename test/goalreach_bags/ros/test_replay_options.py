"""Options of `goalreach replay` that `ros2 bag play` has too, over real DDS."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
from typing import Any

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from goalreach_bags.repair import repair_bag
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
import graphs
from small_bags import (
    DEFAULT_OFFER,
    FOREIGN_COUNT,
    string_topic,
    text_message,
    write_bag,
    write_foreign,
)

COUNT = 30
LIMIT_S = 90.0
ServeUntil = Callable[[Callable[[], bool], float], bool]


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    topics = [string_topic(name) for name in ('/a', '/b', '/c')]
    messages = [
        (topic.name, (k + 1) * 10_000_000, text_message(f'{topic.name}{k}'))
        for k in range(COUNT)
        for topic in topics
    ]
    write_bag(tmp_path / 'bag', messages, topics=topics)
    return tmp_path / 'bag'


@contextmanager
def replayed(bag: Path, *options: str) -> Iterator[tuple[Node, ServeUntil, Any]]:
    """Replay a bag, with a node that looks on; give the node, its server and the process."""
    domain = graphs.fresh_domain()
    arguments = ['replay', str(bag), '--quiet', *options]
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(arguments, domain=domain, home=bag) as player,
    ):
        yield node, serve_until, player


Refusal = Callable[..., str]


def output(player: 'subprocess.Popen[str]') -> str:
    text = player.communicate(timeout=LIMIT_S)[0]
    assert player.returncode == 0, text
    return text


@pytest.mark.graph
def test_topics_are_remapped(bag: Path) -> None:
    came: dict[str, list[str]] = {'/x': [], '/other/b': [], '/c': []}
    with replayed(bag, '--remap', '/a:=/x', 'b:=/other/b', '--delay', '9') as (
        node,
        serve,
        player,
    ):
        for name, texts in came.items():
            append = texts.append
            node.create_subscription(
                String, name, lambda m, append=append: append(m.data), RELIABLE_QOS
            )
        assert serve(lambda: all(len(texts) == COUNT for texts in came.values()), LIMIT_S)
        assert {texts[0] for texts in came.values()} == {'/a0', '/b0', '/c0'}
        assert node.count_publishers('/a') == 0
        assert 'replayed 90 messages' in output(player)


@pytest.mark.graph
def test_of_latched_topics_only_what_a_late_subscriber_gets_is_sent_first(tmp_path: Path) -> None:
    offer = {**DEFAULT_OFFER, 'durability': 'transient_local', 'history': 'keep_last', 'depth': 1}
    topics = [string_topic('/map', offers=(offer,)), string_topic('/a')]
    messages = [('/map', k * 10_000_000, text_message(f'map {k}')) for k in range(1, 6)]
    messages += [('/a', k * 10_000_000, text_message(f'{k}')) for k in range(1, 12)]
    write_bag(tmp_path / 'bag', messages, topics=topics)
    with replayed(tmp_path / 'bag', '--start', '0.085') as (_, _, player):
        assert 'replayed 3 messages' in output(player)  # map 5, and the last two of /a


@pytest.mark.graph
@pytest.mark.parametrize(
    ('options', 'left'),
    [
        (['--exclude-topics', '/a', 'b'], 30),
        (['--exclude-regex', '[ab]$'], 30),
        (['-x', 'a', '--exclude', 'b', '--exclude-topics', '/nothing'], 30),
        (['--topics', '/a', '/b', '--exclude-topics', '/b'], 30),
        (['-e', '/[ab]'], 60),
    ],
)
def test_topics_are_left_out(bag: Path, options: list[str], left: int) -> None:
    with replayed(bag, '--delay', '0', '--rate', '20', *options) as (_, _, player):
        assert f'replayed {left} messages' in output(player)


OVERRIDES = """
/a:
  reliability: best_effort
  durability: volatile
  history: keep_last
  depth: 7
  deadline: {sec: 1, nsec: 500000000}
  lifespan: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
/b:
  durability: transient_local
  history: keep_all
/absent:
  depth: 1
"""


@pytest.mark.graph
def test_quality_of_service_is_overridden(bag: Path) -> None:
    path = bag / 'qos.yaml'
    path.write_text(OVERRIDES)
    late: list[str] = []
    with replayed(
        bag, '--qos-profile-overrides-path', str(path), '--wait-for-all-acked', '1', '--delay', '1'
    ) as (node, serve, player):
        assert serve(lambda: node.count_publishers('/b') == 1, LIMIT_S)
        (a,) = node.get_publishers_info_by_topic('/a')
        (b,) = node.get_publishers_info_by_topic('/b')
        assert a.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
        assert a.qos_profile.deadline.nanoseconds == 1_500_000_000
        assert b.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        assert b.qos_profile.reliability is ReliabilityPolicy.RELIABLE
        (c,) = node.get_publishers_info_by_topic('/c')
        assert c.qos_profile.durability is DurabilityPolicy.VOLATILE
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(String, '/b', lambda m: late.append(m.data), latched)
        assert serve(lambda: len(late) == COUNT, LIMIT_S)
        assert '/absent: the bag has no such topic' in output(player)


@pytest.mark.graph
@pytest.mark.parametrize(
    ('text', 'problem'),
    [
        ('/a: {reliability: trusty, depth: 1}', "/a.reliability = 'trusty': is not valid"),
        ('/a: {depth: -1}', '/a.depth = -1: is not valid'),
        ('/a: {depth: 1, deadline: {sec: 1}}', "/a.deadline = {'sec': 1}: is not valid"),
        ('/a: {colour: red}', "/a.colour = 'red': is not known: depth, history, reliability"),
        ('/a: {reliability: reliable}', '/a: History and/or depth settings are required.'),
        ('/a: reliable', "/a = 'reliable': must be a mapping of policies"),
        ('[a]', 'must be a mapping of topics to their policies'),
        ('{', 'is not YAML'),
    ],
)
def test_bad_overrides_are_one_line(bag: Path, refusal: Refusal, text: str, problem: str) -> None:
    path = bag / 'qos.yaml'
    path.write_text(text)

    refused = refusal('replay', str(bag), '--quiet', '--qos-profile-overrides-path', str(path))

    assert refused.startswith(f'goalreach replay: {path}: {problem}')


@pytest.mark.graph
@pytest.mark.parametrize('rule', ['nonsense', '/a:=', '/a:=b c'])
def test_bad_rules_are_one_line(bag: Path, refusal: Refusal, rule: str) -> None:
    refused = refusal('replay', str(bag), '--quiet', '--remap', '/b:=/c', rule)

    assert refused.startswith('goalreach replay: --remap: ')
    assert rule in refused


@pytest.mark.graph
def test_two_types_on_one_topic_are_one_line(tmp_path: Path, refusal: Refusal) -> None:
    other = string_topic('/b', type_name='std_msgs/msg/Empty', type_hash='')
    messages = [('/a', 1, text_message('a')), ('/b', 2, b'\0\1\0\0\0')]
    write_bag(tmp_path / 'bag', messages, topics=[string_topic('/a'), other])

    refused = refusal('replay', str(tmp_path / 'bag'), '--quiet', '--remap', '/b:=/a')

    assert refused.startswith('goalreach replay: /b: Failed to create publisher: ')


@pytest.mark.graph
def test_services_pause_step_and_resume(bag: Path) -> None:
    came: list[str] = []
    with replayed(bag, '--start-paused', '--topics', '/a') as (node, serve, player):
        node.create_subscription(String, '/a', lambda m: came.append(m.data), RELIABLE_QOS)
        clients = {
            name: node.create_client(Trigger, f'/player/{name}')
            for name in ('pause', 'resume', 'toggle_paused', 'play_next')
        }

        def call(name: str) -> tuple[bool, str]:
            assert serve(clients[name].service_is_ready, LIMIT_S)
            future = clients[name].call_async(Trigger.Request())
            assert serve(future.done, LIMIT_S)
            answer = future.result()
            assert answer is not None
            return answer.success, answer.message

        assert serve(lambda: node.count_publishers('/a') == 1, LIMIT_S)
        assert call('pause') == (True, 'paused')
        assert call('play_next') == (True, 'paused')
        assert serve(lambda: len(came) == 1, LIMIT_S)
        assert call('toggle_paused') == (True, 'playing')
        assert call('toggle_paused') == (True, 'paused')
        assert call('resume') == (True, 'playing')
        assert serve(lambda: len(came) == COUNT, LIMIT_S)
        assert f'replayed {COUNT} messages' in output(player)


@pytest.mark.graph
def test_acknowledgements_are_awaited_without_limit_until_they_come(bag: Path) -> None:
    came: list[str] = []
    options = ('--wait-for-all-acked', '0', '--delay', '9', '--topics', '/a')
    with replayed(bag, *options) as (node, serve, player):
        node.create_subscription(String, '/a', lambda m: came.append(m.data), RELIABLE_QOS)
        assert serve(lambda: len(came) == COUNT, LIMIT_S)
        assert 'acknowledged' not in output(player)


@pytest.mark.graph
@pytest.mark.parametrize(
    ('option', 'value'), [('--wait-for-all-acked', '-1'), ('--delay', '-1'), ('--rate', '0')]
)
def test_bad_numbers_are_one_line(bag: Path, refusal: Refusal, option: str, value: str) -> None:
    assert refusal('replay', str(bag), '--quiet', option, value).startswith(
        f'goalreach replay: {option} = {value}'
    )


@pytest.mark.graph
def test_messages_of_another_encoding_are_not_replayed(tmp_path: Path) -> None:
    write_foreign(tmp_path / 'bag' / 'a.mcap')
    repair_bag(tmp_path / 'bag')

    with replayed(tmp_path / 'bag', '--delay', '0') as (_, _, player):
        text = output(player)

    assert '/json is not replayed: /json: its messages are json, not cdr' in text
    assert f'replayed {FOREIGN_COUNT} messages' in text
