"""Selection, stamps, offers, padding, definitions and the timer of replays."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rcl_interfaces.msg import Log
from rosbags.interfaces import QosReliability, QosTime
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from goalreach_bags.decode import PaddingEraser, begins_with_stamp
from goalreach_bags.options import TopicSelection
from goalreach_bags.ros.player import ReplayTimer
from goalreach_bags.topic import DEFAULT_OFFER, message_definition, offers_to_text, parse_offers
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from small_bags import STORE, serialize


@pytest.mark.parametrize(
    ('selection', 'expected'),
    [
        (TopicSelection(), {'/odom', '/camera/image_raw'}),
        (TopicSelection(names=('odom',)), {'/odom'}),
        (TopicSelection(names=('/_hidden',)), {'/_hidden'}),
        (TopicSelection(patterns=('^/camera/',)), {'/camera/image_raw'}),
        (TopicSelection(exclude=('camera',)), {'/odom'}),
        (TopicSelection(names=('/odom',), patterns=('image',)), {'/odom', '/camera/image_raw'}),
    ],
)
def test_selection(selection: TopicSelection, expected: set[str]) -> None:
    topics = ['/odom', '/camera/image_raw', '/_hidden', '/a/_hidden/b']

    assert {topic for topic in topics if selection.includes(topic)} == expected


def test_bad_pattern_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='--regex'):
        TopicSelection(patterns=('(',))


def test_stamp_is_read_from_the_bytes() -> None:
    assert stamp_of(b'\0\1\0\0\2\0\0\0\3\0\0\0rest') == 2_000_000_003
    assert stamp_of(b'\0\0\0\0\0\0\0\2\0\0\0\3') == 2_000_000_003
    with pytest.raises(MessageError, match='too short'):
        stamp_of(b'\0\1\0\0\2\0\0\0')


def test_only_headers_and_the_clock_are_stamps() -> None:
    assert begins_with_stamp('sensor_msgs/msg/Image', Image)
    assert begins_with_stamp('rosgraph_msgs/msg/Clock', Clock)
    assert begins_with_stamp('diagnostic_msgs/msg/DiagnosticArray', DiagnosticArray)
    assert not begins_with_stamp('rcl_interfaces/msg/Log', Log)


@given(st.integers(0, 2**31), st.integers(0, 10**9 - 1), st.sampled_from(QosReliability))
def test_offers_survive_their_text(sec: int, nsec: int, reliability: QosReliability) -> None:
    offers = (
        DEFAULT_OFFER._replace(deadline=QosTime(sec, nsec), reliability=reliability),
        DEFAULT_OFFER._replace(depth=3),
    )

    assert parse_offers(offers_to_text(offers)) == offers


@pytest.mark.parametrize('text', ['', ']', 'a', '- a: b', '- 3'])
def test_offers_that_are_not_understood_are_none(text: str) -> None:
    assert parse_offers(text) == ()


def test_bytes_between_fields_are_erased() -> None:
    name = 'std_msgs/msg/Header'
    types: Any = STORE.types
    stamp = types['builtin_interfaces/msg/Time'](sec=1, nanosec=2)
    header = types[name](stamp=stamp, frame_id='room')
    pose = types['geometry_msgs/msg/PointStamped'](
        header=header,
        point=types['geometry_msgs/msg/Point'](x=1.0, y=2.0, z=3.0),
    )
    clean = serialize(pose, 'geometry_msgs/msg/PointStamped')
    dirty = bytearray(clean)
    gap = clean.index(b'room\0') + 5
    assert clean[gap : gap + 3] == bytes(3)
    dirty[gap] = 0xAB

    eraser = PaddingEraser()
    assert eraser.erase('geometry_msgs/msg/PointStamped', bytes(dirty)) == clean
    assert eraser.erase('geometry_msgs/msg/PointStamped', b'junk') == b'junk'
    assert eraser.erase('my_msgs/msg/Own', bytes(dirty)) == bytes(dirty)


def test_definition_holds_all_that_a_message_is_made_of() -> None:
    text = message_definition('geometry_msgs/msg/PoseStamped')

    headings = [line for line in text.splitlines() if line.startswith('MSG: ')]
    assert headings == [
        'MSG: geometry_msgs/Pose',
        'MSG: geometry_msgs/Point',
        'MSG: geometry_msgs/Quaternion',
        'MSG: std_msgs/Header',
        'MSG: builtin_interfaces/Time',
    ]


@pytest.mark.parametrize('name', ['sensor_msgs/msg/Nothing', 'nothing', 'std_srvs/srv/Trigger'])
def test_definition_that_is_not_installed_is_refused(name: str) -> None:
    with pytest.raises(GoalreachError, match=name.split('/', maxsplit=1)[0]):
        message_definition(name)


def test_timer_keeps_pauses_and_rates() -> None:
    timer = ReplayTimer(rate=2.0)
    timer.jump(10.0, 1_000_000_000)
    assert timer.due_s(3_000_000_000) == 11.0
    timer.toggle(10.5)
    assert timer.time_ns(99.0) == 2_000_000_000
    timer.toggle(20.0)
    assert timer.due_s(3_000_000_000) == 20.5
    timer.change_rate(20.0, 0.5)
    assert timer.due_s(3_000_000_000) == 21.0
    timer.jump(30.0, 5_000_000_000)
    assert timer.time_ns(31.0) == 6_000_000_000
