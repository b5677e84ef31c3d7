"""Bags of real graphs: recorded, the same again, recomputed, replayed."""

from collections.abc import Callable
import hashlib
from pathlib import Path
import signal

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovarianceStamped
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from goalreach_bags.options import TopicSelection
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import RUN_TOPICS, TICK_TOPICS
from goalreach_bags.repair import repair_bag
from goalreach_bags.ros.subscriptions import GraphSubscriptions
from goalreach_msgs_py.ros.messaging import LATCHED_QOS, SENSOR_QOS
import graphs
from small_bags import STORE, serialize

pytestmark = pytest.mark.graph

LED_MOVED = """
landmark_localizer:
  ros__parameters:
    landmarks_m: [0.889, 0.0, 1.4224, 1.8034, 0.508, 1.8288, 2.667, 0.0, 1.6256]
"""


def command(arguments: list[str], home: Path, domain: int | None = None) -> tuple[int, str]:
    number = graphs.fresh_domain() if domain is None else domain
    with graphs.goalreach(arguments, domain=number, home=home) as process:
        text = process.communicate(timeout=90.0)[0]
    return process.returncode, text


def record(bag: Path, *words: str) -> None:
    """Drive one short path in lockstep, which turns and crosses a border, and record it."""
    path = ['--paths', '1', '--start', '0.6,2.0,-90', '--clock', 'lockstep', '--quiet']
    status, text = command(['run', *path, '--record', str(bag), *words], bag.parent)
    assert status == 0, text


@pytest.fixture(scope='module')
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp('reference')
    record(home / 'bag')
    return home / 'bag'


def test_bag_holds_every_message_of_every_tick(reference: Path) -> None:
    with BagReader(reference) as bag:
        ticks = bag.counts['/clock']
        assert ticks > 50
        assert {name: bag.counts[name] for name in TICK_TOPICS} == dict.fromkeys(
            TICK_TOPICS, ticks
        )
        bag.require([name for name in RUN_TOPICS if name != '/path'])
        times = [m.time_ns for m in bag.messages(['/camera/image_raw'])]
        assert times == [40_000_000 * (k + 1) for k in range(ticks)]
        image = bag.topics['/camera/image_raw']
        assert {offer['reliability'] for offer in image.offers} == {'reliable'}
        markers = bag.topics['/arena/markers']
        assert {offer['durability'] for offer in markers.offers} == {'transient_local'}
        assert len(bag.topics['/diagnostics'].offers) == 4
        assert '/camera/image_raw/compressed' not in bag.topics


def test_same_seed_makes_the_same_bag_in_one_process(reference: Path, tmp_path: Path) -> None:
    record(tmp_path / 'b', '--composed')

    status, text = command(['bag', 'compare', str(reference), str(tmp_path / 'b')], tmp_path)

    assert (status, 'the same: ' in text) == (0, True), text


def test_other_seed_makes_another_bag(reference: Path, tmp_path: Path) -> None:
    record(tmp_path / 'b', '--seed', '1')

    status, text = command(['bag', 'compare', str(reference), str(tmp_path / 'b')], tmp_path)

    assert status == 1
    assert 'topics differ, first /' in text


def test_recomputed_perception_is_the_same_beside_a_running_graph(
    reference: Path, tmp_path: Path
) -> None:
    """Another clock would make every state stale; a localizer of the run has the same name."""
    domain = graphs.fresh_domain()
    seen: set[str] = set()
    with graphs.onlooker(domain) as (node, serve_until):
        clock = node.create_publisher(Clock, '/clock', 1)
        arguments = ['replay', str(reference), '--recompute']
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as process:

            def ended() -> bool:
                clock.publish(Clock(clock=Time(sec=1_000_000)))
                seen.update(node.get_node_names())
                topics = [name for name, _ in node.get_topic_names_and_types()]
                seen.update(name for name in topics if node.count_subscribers(name))
                return process.poll() is not None

            assert serve_until(ended, 90.0)
            text = process.communicate()[0]

    assert (process.returncode, 'the same within 1e-09' in text) == (0, True), text
    names = {name for name in seen if not name.lstrip('/').startswith('_recompute_')}
    assert names <= {'onlooker', 'feeder', '/parameter_events', '/rosout'}


def test_moved_led_is_noticed(reference: Path, tmp_path: Path) -> None:
    (tmp_path / 'led.yaml').write_text(LED_MOVED)
    arguments = ['replay', str(reference), '--recompute']

    status, text = command([*arguments, '--params-file', str(tmp_path / 'led.yaml')], tmp_path)

    assert status == 1
    assert 'differs first at ' in text


def test_replay_brings_every_message_and_latched_ones_late(
    reference: Path, tmp_path: Path
) -> None:
    domain = graphs.fresh_domain()
    poses: list[bytes] = []
    markers: list[bytes] = []
    with graphs.onlooker(domain) as (node, serve_until):
        qos = QoSProfile(depth=1000)
        node.create_subscription(PoseWithCovarianceStamped, '/pose', poses.append, qos, raw=True)
        arguments = ['replay', str(reference), '--rate', '4', '--clock', '--delay', '3']
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as player:
            assert serve_until(lambda: len(poses) > 20, 90.0)
            node.create_subscription(
                MarkerArray, '/arena/markers', markers.append, LATCHED_QOS, raw=True
            )
            assert serve_until(lambda: player.poll() is not None, 90.0)
            serve_until(lambda: False, 0.3)

    with BagReader(reference) as bag:
        assert poses == [m.data for m in bag.messages(['/pose'])]
        assert markers == [m.data for m in bag.messages(['/arena/markers'])]


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_recorder_gets_what_another_subscriber_gets(tmp_path: Path, storage: str) -> None:
    domain = graphs.fresh_domain()
    heard: dict[str, list[bytes]] = {'/text': [], '/image': []}
    path = tmp_path / 'bag'
    with graphs.onlooker(domain) as (node, serve_until):
        text = node.create_publisher(String, '/text', 10)
        image = node.create_publisher(Image, '/image', SENSOR_QOS)
        deep = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_subscription(String, '/text', heard['/text'].append, 1000, raw=True)
        node.create_subscription(Image, '/image', heard['/image'].append, deep, raw=True)
        arguments = ['record', str(path), '--storage', storage, '--topics', '/text', 'image']
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as recorder:
            assert serve_until(lambda: text.get_subscription_count() == 2, 90.0)
            assert serve_until(lambda: image.get_subscription_count() == 2, 90.0)
            for number in range(100):
                text.publish(String(data=f'{number}'))
                image.publish(Image(width=number, data=bytes(50_000)))
                serve_until(lambda: False, 0.01)
            assert serve_until(lambda: all(len(h) == 100 for h in heard.values()), 90.0)
            recorder.send_signal(signal.SIGINT)
            said = recorder.communicate(timeout=20.0)[0]

    assert recorder.returncode == 0
    assert 'recorded 200 messages of 2 topics' in said
    assert 'lost none' in said
    with BagReader(path) as bag:
        for name, messages in heard.items():
            recorded = [m.data for m in bag.messages([name])]
            assert checksums(bag, name, recorded) == checksums(bag, name, messages)


def checksums(bag: BagReader, name: str, messages: list[bytes]) -> list[bytes]:
    """Return a checksum of each message's fields; what lies between and after them is chance."""
    type_name = bag.topics[name].type_name
    values = [STORE.deserialize_cdr(message, type_name) for message in messages]
    return [hashlib.sha256(serialize(value, type_name)).digest() for value in values]


def test_killed_recorder_leaves_a_bag_to_repair(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    path = tmp_path / 'bag'
    with graphs.onlooker(domain) as (node, serve_until):
        text = node.create_publisher(String, '/text', 10)
        with graphs.goalreach(['record', str(path)], domain=domain, home=tmp_path) as recorder:
            assert serve_until(lambda: text.get_subscription_count() == 1, 90.0)

            def grown() -> bool:
                text.publish(String(data='x' * 1000))
                return path.exists() and any(f.stat().st_size > 5000 for f in path.iterdir())

            assert serve_until(grown, 90.0)
            recorder.kill()

    assert repair_bag(path).messages > 0
    status, told = command(['bag', 'info', str(path)], tmp_path)
    assert status == 0
    assert '/text' in told


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        (['record', '.'], 'goalreach record: .: exists already: a bag is never overwritten'),
        (['record', 'x', '--regex', '('], "goalreach record: --regex = '(': must be a pattern"),
        (['record', 'x', '--max-size', '0'], 'goalreach record: --max-size = 0.0: must be'),
        (['record', '--repair', 'nothing'], 'goalreach record: nothing: is not a bag'),
        (['replay', 'nothing'], 'goalreach replay: nothing: does not exist'),
        (['replay', 'nothing', '--rate', '0'], 'goalreach replay: --rate = 0.0: must be'),
        (['replay', '--recompute', 'nothing'], 'goalreach replay: nothing: does not exist'),
        (['bag', 'info', 'nothing'], 'goalreach bag: nothing: does not exist'),
    ],
)
def test_mistakes_are_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    refusal: Callable[..., str],
    arguments: list[str],
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)

    assert refusal(*arguments).startswith(line)


def test_a_run_overwrites_no_bag(tmp_path: Path) -> None:
    line = f'goalreach run: {tmp_path}: exists already: a bag is never overwritten\n'
    assert command(['run', '--record', str(tmp_path)], tmp_path) == (2, line)


@pytest.mark.parametrize(
    ('topics', 'published', 'recorded'),
    [
        ((), ('/a', '/a/compressed'), {'/a'}),
        (('a/compressed',), ('/a', '/a/compressed'), {'/a/compressed'}),
        ((), ('/a/compressed',), {'/a/compressed'}),
    ],
)
def test_compressed_copies_are_recorded_only_by_name(
    topics: tuple[str, ...], published: tuple[str, ...], recorded: set[str]
) -> None:
    with graphs.onlooker(graphs.fresh_domain()) as (node, _):
        for topic in published:
            node.create_publisher(String, topic, LATCHED_QOS)
        subscriptions = GraphSubscriptions(
            node, TopicSelection(names=topics, exclude=('^/(rosout|param)',))
        )
        subscriptions.discover()
        assert subscriptions.by_name.keys() == recorded
