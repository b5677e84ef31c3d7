from __future__ import annotations

from datetime import date
import math

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovariance
import numpy as np
import pytest
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Bool, Byte, Float64, Float64MultiArray, Int8, String
from visualization_msgs.msg import Marker

from goalreach_bringup.ros2cli.messages import build_message, parse_values
from goalreach_msgs_py.errors import CommandError


def test_nested_fields_are_set_and_the_others_stay() -> None:
    message, _ = build_message(
        PoseStamped, parse_values('{header: {frame_id: map}, pose: {position: {x: 1}}}')
    )
    assert message.header.frame_id == 'map'
    assert (message.pose.position.x, message.pose.orientation.w) == (1.0, 1.0)


def test_arrays_of_each_kind() -> None:
    state, _ = build_message(JointState, {'name': ['a', 'b'], 'position': [1, '1e-3']})
    assert (state.name, list(state.position)) == (['a', 'b'], [1.0, 0.001])
    image, _ = build_message(Image, {'data': [0, 255]})
    assert bytes(image.data) == b'\x00\xff'
    pose, _ = build_message(PoseWithCovariance, {'covariance': [2] * 36})
    assert np.all(pose.covariance == 2.0)


def test_lists_of_messages_and_bytes() -> None:
    array, _ = build_message(
        DiagnosticArray, parse_values('status: [{level: 1, values: [{key: k, value: 0.5}]}, {}]')
    )
    assert (array.status[0].level, array.status[1].level) == (b'\x01', b'\x00')
    assert array.status[0].values[0].value == '0.5'


@pytest.mark.parametrize(
    ('kind', 'value', 'converted'),
    [
        (Bool, 0, False),
        (Bool, 1, True),
        (Int8, -3.0, -3),
        (Int8, '7', 7),
        (Byte, '\x02', b'\x02'),
        (String, 1.5, '1.5'),
    ],
)
def test_what_loses_nothing_is_converted(kind: object, value: object, converted: object) -> None:
    message, _ = build_message(kind, {'data': value})
    assert message.data == converted
    assert type(message.data) is type(converted)


def test_auto_and_now_are_stamped_later() -> None:
    message, stampers = build_message(PoseStamped, {'header': 'auto'})
    assert message.header.stamp == Time()
    for stamp in stampers:
        stamp(Time(sec=7, nanosec=5))
    assert message.header.stamp == Time(sec=7, nanosec=5)
    message, stampers = build_message(PoseStamped, {'header': {'stamp': 'now', 'frame_id': 'map'}})
    for stamp in stampers:
        stamp(Time(sec=8))
    assert (message.header.stamp, message.header.frame_id) == (Time(sec=8), 'map')


@pytest.mark.parametrize(
    ('kind', 'values', 'reason'),
    [
        (Float64, {'data': 'fast'}, "data = 'fast': must be of type float"),
        (Float64, {'data': None}, 'data = None: must be of type float'),
        (Float64, {'data': [1.0]}, 'data = [1.0]: must be of type float'),
        (Int8, {'data': 1.7}, 'data = 1.7: must be of type int'),
        (Int8, {'data': -1.7}, 'data = -1.7: must be of type int'),
        (Int8, {'data': math.inf}, 'data = inf: must be of type int'),
        (Float64, {'data': date(2026, 11, 30)}, 'data = datetime.date(2026, 11, 30): must be'),
        (Int8, {'data': 300}, 'data: The '),
        (Byte, {'data': ''}, "data = '': must be of type bytes"),
        (Byte, {'data': 1.5}, 'data = 1.5: must be of type bytes'),
        (Byte, {'data': date(2026, 11, 30)}, 'data = datetime.date(2026, 11, 30): must be of'),
        (Byte, {'data': 'ab'}, "data = 'ab': must be of type bytes"),
        (Bool, {'data': -1}, 'data = -1: must be of type bool'),
        (Bool, {'data': 2}, 'data = 2: must be of type bool'),
        (String, {'data': None}, 'data = None: must be of type str'),
        (String, {'data': [1]}, 'data = [1]: must be of type str'),
        (PoseStamped, {'pose': 'auto'}, "pose = 'auto': must be a dictionary"),
        (PoseStamped, {'pose': 'now'}, "pose = 'now': must be a dictionary"),
        (PoseStamped, {'header': 'now'}, "header = 'now': must be a dictionary"),
        (PoseStamped, {'header': {'stamp': 'auto'}}, "header.stamp = 'auto': must be a dict"),
        (PoseStamped, {'header': {'stamp': 'soon'}}, "header.stamp = 'soon': must be a dict"),
        (PoseStamped, {'header': {'stamp': {'sec': 2**31}}}, 'header.stamp.sec: The '),
        (Float64MultiArray, {'layout': 'auto'}, "layout = 'auto': must be a dictionary"),
        (Marker, {'lifetime': 'now'}, "lifetime = 'now': must be a dictionary"),
        (Bool, {'data': 'false'}, "data = 'false': must be of type bool"),
        (String, {'text': 'x'}, "'String' object has no attribute 'text'"),
        (PoseStamped, {'pose': {'position': 3}}, 'pose.position = 3: must be a dictionary'),
        (PoseStamped, {'pose': {'at': 3}}, "'Pose' object has no attribute 'pose.at'"),
        (JointState, {'name': 'a'}, "name = 'a': must be a list"),
        (JointState, {'position': [0, 'b']}, "position[1] = 'b': must be of type float"),
        (Image, {'data': [256]}, 'data: The '),
        (PoseWithCovariance, {'covariance': [1.0]}, 'covariance: The '),
        (DiagnosticArray, {'status': [{'level': 999}]}, 'status[0].level = 999: must be'),
    ],
)
def test_what_does_not_fit_is_refused_by_its_path(
    kind: object, values: object, reason: str
) -> None:
    with pytest.raises(CommandError) as caught:
        build_message(kind, values)
    assert str(caught.value).startswith(f'Failed to populate field: {reason}')
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('text', ['[1, 2]', '3', 'data: [1', '\t'])
def test_values_must_be_a_mapping(text: str) -> None:
    with pytest.raises(CommandError, match=r'^The passed value .*YAML'):
        parse_values(text)


def test_no_values_are_an_empty_mapping() -> None:
    assert parse_values('') == parse_values('{}') == {}
