"""Tables about bags, line by line."""

import json
from pathlib import Path

import pytest

from goalreach_bags.compare import FieldDifference, TopicComparison, TopicResult
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import CLOCK_KEY, LOST_KEY, PARAMETERS_KEY
from goalreach_bags.report import show_bag, show_comparison, show_recomputation
from small_bags import string_topic, texts, write_bag

Capture = pytest.CaptureFixture[str]


def shown(capsys: Capture) -> list[str]:
    out = capsys.readouterr().out.replace('│', '|')
    return [' '.join(line.split()) for line in out.splitlines()]


def test_bytes_seconds_messages_and_losses_are_counted(tmp_path: Path, capsys: Capture) -> None:
    custom = {LOST_KEY: json.dumps({'/text': 3, '/other': 4})}
    write_bag(tmp_path / 'bag', texts(11, 100_000), custom=custom)
    with BagReader(tmp_path / 'bag') as bag:
        show_bag(bag, check=None)
    assert {
        'files: 1, 1.1 MB',
        'time: 0.001 s to 0.011 s: 0.010 s',
        'messages: 11, lost 7',
        '| /text | std_msgs/msg/String | 11 | 1000.00 | 3 |',
    } <= {*shown(capsys)}


def test_clock_state_and_parameters_are_told(tmp_path: Path, capsys: Capture) -> None:
    """A rate needs two messages."""
    custom = {CLOCK_KEY: 'sim', PARAMETERS_KEY: 'a: 1'}
    topics = [string_topic(name) for name in ('/text', '/once', '/never')]
    messages = [('/text', 1, b''), ('/once', 1, b''), ('/text', 2_000_000_001, b'')]
    write_bag(tmp_path / 'bag', messages, topics=topics, custom=custom)
    with BagReader(tmp_path / 'bag') as bag:
        show_bag(bag, check=True)
        lines = shown(capsys)
        show_bag(bag, check=False)
    assert 'state: not checked: --check reads all of it' in shown(capsys)
    assert {
        'clock: /clock',
        'state: sound',
        'parameters: those of the run are kept',
        '| /text | std_msgs/msg/String | 2 | 0.50 | 0 |',
        '| /once | std_msgs/msg/String | 1 | | 0 |',
        '| /never | std_msgs/msg/String | 0 | | 0 |',
    } <= {*lines}


def test_a_bag_of_one_moment_has_no_rate(tmp_path: Path, capsys: Capture) -> None:
    write_bag(tmp_path / 'bag', [('/text', 1, b''), ('/text', 1, b'')])
    with BagReader(tmp_path / 'bag') as bag:
        show_bag(bag, check=None)
    lines = shown(capsys)
    assert '| /text | std_msgs/msg/String | 2 | | 0 |' in lines
    assert {'clock: unknown', 'state: sound', 'parameters: unknown'} <= {*lines}


def test_a_comparison_ends_with_the_first_difference(capsys: Capture) -> None:
    differs = TopicComparison(topic='/a', counts=(3, 2), where='message 2: only in the first')
    same = TopicComparison(topic='/b', counts=(5, 5))
    show_comparison([differs, same])
    lines = shown(capsys)
    assert {'| /a | 3 and 2 | message 2: only in the first |'} <= {*lines}
    assert lines[-1] == '1 of 2 topics differ, first /a: message 2: only in the first'
    show_comparison([same, same])
    assert shown(capsys)[-1] == 'the same: 10 messages of 2 topics'


def test_a_recomputation_ends_with_the_first_difference(capsys: Capture) -> None:
    difference = FieldDifference('x', 1.0, 1.25, 0.25)
    pose = TopicResult('/pose', 3, 2, 0.25, 'x', difference, 2e9)
    show_recomputation([pose, TopicResult('/state', 3)], tolerance=1e-9)
    lines = shown(capsys)
    assert {'| /pose | 3 | 2 | 0.25 x | 2.000 s x |'} <= {*lines}
    assert lines[-1] == 'differs first at 2.000 s in /pose: x was 1.0 and is 1.25'
    show_recomputation([TopicResult('/state', 3)], tolerance=1e-9)
    assert shown(capsys)[-1] == 'the same within 1e-09'
