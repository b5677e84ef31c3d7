from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovariance
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import String
import yaml

from goalreach_bringup.ros2cli.messages import message_to_yaml


def test_yaml_keeps_the_order_of_the_definition() -> None:
    message = JointState(name=['pan_joint'], position=[0.5])
    assert message_to_yaml(message) == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\n"
        'name:\n- pan_joint\nposition:\n- 0.5\nvelocity: []\neffort: []\n'
    )


def test_byte_is_a_character() -> None:
    text = message_to_yaml(DiagnosticStatus(level=b'\x02'))
    assert text.startswith('level: "\\x02"\nname: \'\'\n')


def test_text_of_any_language_stays_legible() -> None:
    assert message_to_yaml(String(data='Nähe')) == 'data: Nähe\n'


def test_long_arrays_and_strings_end_with_dots() -> None:
    assert message_to_yaml(String(data='abcd'), 3) == 'data: abc...\n'
    assert message_to_yaml(String(data='abc'), 3) == 'data: abc\n'
    image = Image(data=[1, 2, 3, 4])
    assert message_to_yaml(image, 3).endswith("data:\n- 1\n- 2\n- 3\n- '...'\n")
    image = Image(data=[1, 2, 3])
    assert message_to_yaml(image, 3).endswith('data:\n- 1\n- 2\n- 3\n')


def test_without_arrays_their_types_are_told() -> None:
    text = message_to_yaml(Image(data=[1, 2, 3]), arrays=False)
    assert text.endswith("data: '<sequence type: uint8, length: 3>'\n")
    text = message_to_yaml(PoseWithCovariance(), arrays=False)
    assert text.endswith("covariance: '<array type: double[36]>'\n")


# PyYAML, which ros2 prints with too, takes the three other line ends of Unicode for spaces.
NO_TEXT = '\0\x85\u2028\u2029'


@settings(max_examples=50, deadline=None)
@given(
    name=st.text(st.characters(codec='utf-8', exclude_characters=NO_TEXT), max_size=20),
    position=st.lists(st.floats(allow_nan=False), max_size=5),
)
def test_yaml_reads_back(name: str, position: list[float]) -> None:
    read = yaml.safe_load(message_to_yaml(JointState(name=[name], position=position)))
    assert read['name'] == [name]
    assert read['position'] == position
