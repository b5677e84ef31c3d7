"""The RViz configuration and the Foxglove layout name what the graph has."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
import json
from typing import Any

import yaml

from goalreach_msgs_py import topics

CONFIG = resources.files('goalreach_bringup') / 'config'
NAMES = {
    value for name, value in vars(topics).items() if name.isupper() and str(value).startswith('/')
}
MESSAGES = {
    'MarkerArray': {topics.MARKERS, topics.BEHAVIOR_MARKERS},
    'PoseWithCovariance': {topics.POSE},
    'Odometry': {topics.ODOM, topics.GROUND_TRUTH},
    'Path': {topics.PATH},
    'LaserScan': {topics.BUMPERS},
    'Image': {topics.IMAGE},
}


def rviz_displays() -> list[dict[str, Any]]:
    tree = yaml.safe_load((CONFIG / 'goalreach.rviz').read_text())
    assert tree['Visualization Manager']['Global Options']['Fixed Frame'] == topics.MAP_FRAME
    displays: list[dict[str, Any]] = tree['Visualization Manager']['Displays']
    return displays


def test_rviz_shows_each_topic_with_a_display_of_its_type() -> None:
    shown = {}
    for display in rviz_displays():
        kind = display['Class'].removeprefix('rviz_default_plugins/')
        if 'Topic' in display:
            topic = display['Topic']['Value']
            assert topic in MESSAGES[kind]
            shown[topic] = display['Topic']
    assert set(shown) == set().union(*MESSAGES.values())
    assert shown[topics.MARKERS]['Durability Policy'] == 'Transient Local'
    assert shown[topics.IMAGE]['Reliability Policy'] == 'Best Effort'


def foxglove_layout() -> dict[str, Any]:
    layout: dict[str, Any] = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    return layout


def panels(tree: str | dict[str, Any]) -> Iterator[str]:
    if isinstance(tree, str):
        yield tree
    else:
        assert tree['direction'] in ('row', 'column')
        assert 0 < tree['splitPercentage'] < 100
        for side in ('first', 'second'):
            yield from panels(tree[side])


def topic_paths(value: object) -> Iterator[str]:
    """Yield every text that names a topic, or a field in one."""
    if isinstance(value, str) and value.startswith('/'):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from topic_paths(key)
            yield from topic_paths(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from topic_paths(inner)


def test_foxglove_places_every_panel_once() -> None:
    layout = foxglove_layout()
    placed = list(panels(layout['layout']))
    assert sorted(placed) == sorted(layout['configById'])


def test_foxglove_names_topics_of_the_graph() -> None:
    found = {path.partition('.')[0] for path in topic_paths(foxglove_layout()['configById'])}
    assert found <= NAMES
    assert {topics.IMAGE, topics.POSE, topics.MARKERS, topics.STATE} <= found
    image = foxglove_layout()['configById']['Image!camera']['imageMode']
    assert image['annotations'] == {topics.LANDMARK_MARKERS: {'visible': True}}
