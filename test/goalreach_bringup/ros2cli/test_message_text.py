from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Point32, Polygon, PoseWithCovariance
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Float64MultiArray, String
import yaml

from goalreach_bringup.ros2cli.message_text import TextOptions, message_to_csv, message_to_yaml

ALL = TextOptions()


def test_yaml_keeps_the_order_of_the_definition() -> None:
    message = JointState(name=['pan_joint'], position=[0.5])
    assert message_to_yaml(message, ALL) == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\n"
        'name:\n- pan_joint\nposition:\n- 0.5\nvelocity: []\neffort: []\n'
    )


def test_flow_style_puts_lists_on_one_line_and_keeps_mappings() -> None:
    options = TextOptions(flow_style=True)
    assert message_to_yaml(String(data='é'), options) == 'data: é\n'
    points = Polygon(points=[Point32(x=1.0), Point32()])
    text = 'points: [{x: 1.0, y: 0.0, z: 0.0}, {x: 0.0, y: 0.0, z: 0.0}]\n'
    assert message_to_yaml(points, options) == text
    assert message_to_yaml(Polygon(), options) == 'points: []\n'


def test_byte_in_csv_is_cut_like_a_text() -> None:
    status = DiagnosticStatus(level=b'\x02')
    assert message_to_csv(status, ALL) == "b'\\x02',,,,"
    assert message_to_csv(status, TextOptions(truncate_length=0)) == "b'...',,,,"


def test_byte_is_a_character() -> None:
    text = message_to_yaml(DiagnosticStatus(level=b'\x02'), ALL)
    assert text.startswith('level: "\\x02"\nname: \'\'\n')


def test_long_arrays_and_strings_end_with_dots() -> None:
    options = TextOptions(truncate_length=3)
    assert message_to_yaml(String(data='abcd'), options) == 'data: abc...\n'
    image = Image(data=[1, 2, 3, 4])
    assert message_to_yaml(image, options).endswith("data:\n- 1\n- 2\n- 3\n- '...'\n")
    image = Image(data=[1, 2, 3])
    assert message_to_yaml(image, options).endswith('data:\n- 1\n- 2\n- 3\n')


@pytest.mark.parametrize(
    ('message', 'line'),
    [
        (PoseWithCovariance(), "covariance: '<array type: double[36]>'\n"),
        (Polygon(points=[Point32()]), "points: '<sequence type: geometry_msgs/msg/Point32, "),
        (Float64MultiArray(data=[1.0]), "data: '<sequence type: double, length: 1>'\n"),
    ],
)
def test_no_arr_describes_arrays(message: object, line: str) -> None:
    assert line in message_to_yaml(message, TextOptions(no_arr=True))


def test_no_str_describes_strings() -> None:
    options = TextOptions(no_str=True)
    assert message_to_yaml(String(data='abc'), options) == "data: '<string length: <3>>'\n"
    assert message_to_csv(String(data='abc'), options) == '<string length: <3>>'


def test_csv_flattens_nested_fields() -> None:
    message = Polygon(points=[Point32(x=1.0, y=2.0), Point32(z=0.5)])
    assert message_to_csv(message, ALL) == '1.0,2.0,0.0,0.0,0.0,0.5'
    assert message_to_csv(message, TextOptions(truncate_length=1)) == '1.0,2.0,0.0,...'
    no_arr = message_to_csv(message, TextOptions(no_arr=True))
    assert no_arr == '<sequence type: geometry_msgs/msg/Point32, length: 2>'


# PyYAML, which ros2 prints with too, takes the three other line ends of Unicode for spaces.
NO_TEXT = '\0\x85\u2028\u2029'


@settings(max_examples=50, deadline=None)
@given(
    name=st.text(st.characters(codec='utf-8', exclude_characters=NO_TEXT), max_size=20),
    position=st.lists(st.floats(allow_nan=False), max_size=5),
)
def test_yaml_reads_back(name: str, position: list[float]) -> None:
    read = yaml.safe_load(message_to_yaml(JointState(name=[name], position=position), ALL))
    assert read['name'] == [name]
    assert read['position'] == position
