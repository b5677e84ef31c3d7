"""Selecting topics by name and by pattern, and robots by namespace."""

import argparse

import pytest

from goalreach_bags.options import RecordOptions, TopicSelection
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.options import add_options, read_options


@pytest.mark.parametrize(
    ('selection', 'expected'),
    [
        (TopicSelection(), {'/odom', '/camera/image_raw'}),
        (TopicSelection(names=('odom',)), {'/odom'}),
        (TopicSelection(names=('/_hidden',)), {'/_hidden'}),
        (TopicSelection(patterns=('^/camera/',)), {'/camera/image_raw'}),
        (TopicSelection(exclude=('camera',)), {'/odom'}),
        (TopicSelection(excluded_names=('odom',)), {'/camera/image_raw'}),
        (TopicSelection(names=('/odom',), patterns=('image',)), {'/odom', '/camera/image_raw'}),
    ],
)
def test_selection(selection: TopicSelection, expected: set[str]) -> None:
    topics = ['/odom', '/camera/image_raw', '/_hidden', '/a/_hidden/b']

    assert {topic for topic in topics if selection.includes(topic)} == expected


def test_bad_pattern_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='--regex'):
        TopicSelection(patterns=('(',))


def robots(*words: str) -> tuple[str, ...]:
    parser = argparse.ArgumentParser()
    add_options(parser, RecordOptions)
    return read_options(RecordOptions, parser.parse_args(words)).robots


def test_robots_are_namespaces_with_or_without_a_leading_slash() -> None:
    assert robots('--robot', '/r1', '--robot', 'lab/r2') == ('r1', 'lab/r2')


@pytest.mark.parametrize('name', ['', '/', 'a b', '//r1', 'r1/', '1r'])
def test_a_robot_of_another_name_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r'--robot = .*: must be a ROS 2 namespace'):
        robots('--robot', name)
