"""Selecting topics by name and by pattern."""

import pytest

from goalreach_bags.options import TopicSelection
from goalreach_msgs_py.errors import ConfigurationError


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
