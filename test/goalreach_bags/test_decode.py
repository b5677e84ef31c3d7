"""Stamps and padding in serialized messages."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rcl_interfaces.msg import Log
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from goalreach_bags.decode import Decoder, begins_with_stamp, erase_padding
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.errors import GoalreachError
from small_bags import STORE, serialize, string_topic


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

    assert erase_padding('geometry_msgs/msg/PointStamped', bytes(dirty)) == clean
    tail = clean + b'\xab\xab\xab'
    assert erase_padding('geometry_msgs/msg/PointStamped', tail) == clean + bytes(3)
    assert erase_padding('geometry_msgs/msg/PointStamped', tail + b'\xab') == tail + b'\xab'
    assert erase_padding('geometry_msgs/msg/PointStamped', b'junk') == b'junk'
    assert erase_padding('my_msgs/msg/Own', bytes(dirty)) == bytes(dirty)


def test_type_of_another_definition_is_refused() -> None:
    other = string_topic(type_hash='RIHS01_' + 64 * '0')

    with pytest.raises(GoalreachError, match='/text: std_msgs/msg/String has another definition'):
        Decoder([other])


def test_type_that_jazzy_lacks_is_learned_from_the_bag() -> None:
    topic = string_topic(type_name='my_msgs/msg/Own', type_hash='', definition='int32 number\n')

    message = Decoder([topic]).decode('/text', b'\0\1\0\0\7\0\0\0')

    assert message.number == 7


def test_bytes_that_are_no_such_message_are_refused() -> None:
    with pytest.raises(GoalreachError, match='/text: no std_msgs/msg/String'):
        Decoder([string_topic()]).decode('/text', b'\0\1\0\0\xff\xff\0\0')
