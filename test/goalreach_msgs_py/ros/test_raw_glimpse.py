"""Several messages in one, as bytes."""

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import MultiArrayDimension, UInt8MultiArray

from goalreach_msgs_py.ros.common_messages import MessageError
from goalreach_msgs_py.ros.throttled import Glimpsed, glimpse_from_raw, glimpse_to_raw

TOPICS = st.text(st.characters(codec='utf-8', exclude_characters='\0'), max_size=9)
MESSAGES = st.lists(st.tuples(TOPICS, st.integers(0, 2**32 - 1), st.binary(max_size=9)))
TWO: list[Glimpsed] = [('/pose', 7, b'\1\2\3'), ('/camera/image_raw', 9, b'')]


@given(MESSAGES)
def test_what_goes_in_comes_out(messages: list[Glimpsed]) -> None:
    assert glimpse_from_raw(glimpse_to_raw(messages)) == messages
    assert glimpse_from_raw(glimpse_to_raw(messages) + b'\0\0\0') == messages


def test_stock_ros_reads_it() -> None:
    message = deserialize_message(glimpse_to_raw(TWO), UInt8MultiArray)
    expected = UInt8MultiArray(data=[1, 2, 3])
    expected.layout.dim = [
        MultiArrayDimension(label='/pose', size=3, stride=7),
        MultiArrayDimension(label='/camera/image_raw', size=0, stride=9),
    ]
    assert message == expected
    assert glimpse_from_raw(serialize_message(expected)) == TWO


def test_numbers_begin_anew_after_the_last_that_fits() -> None:
    assert glimpse_from_raw(glimpse_to_raw([('/pose', 2**32 + 1, b'\1')])) == [('/pose', 1, b'\1')]


@pytest.mark.parametrize('size', range(len(glimpse_to_raw(TWO))))
def test_what_is_cut_off_is_refused(size: int) -> None:
    with pytest.raises(MessageError, match='not a glimpse'):
        glimpse_from_raw(glimpse_to_raw(TWO)[:size])


def test_what_is_something_else_is_refused() -> None:
    for raw in (b'\0\0\0\0' + glimpse_to_raw(TWO)[4:], b'\0\1\0\0' + b'\xff' * 40):
        with pytest.raises(MessageError, match='not a glimpse'):
            glimpse_from_raw(raw)
