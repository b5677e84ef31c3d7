"""Messages compared field by field, bags message by message."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalreach_bags.compare import TopicResult, _numbers, compare_bags, differences
from goalreach_bags.decode import Decoder
from goalreach_bags.reader import BagReader
from small_bags import (
    JOINTS,
    joints,
    serialize,
    status,
    string_topic,
    text_message,
    texts,
    write_bag,
)


def found(first: Any, second: Any) -> list[tuple[str, float]]:  # noqa: ANN401
    return [(d.field, d.amount) for d in differences(first, second)]


def test_equal_messages_do_not_differ() -> None:
    assert found(joints([1.0, math.nan]), joints([1.0, math.nan])) == []


def test_worst_element_of_an_array_is_named() -> None:
    assert found(joints([1.0, 2.0]), joints([1.5, 4.0])) == [('position[1]', 2.0)]


def test_seen_and_not_seen_differ_without_end() -> None:
    assert found(joints([1.0, math.nan]), joints([1.0, 0.0])) == [('position[1]', math.inf)]


def test_lengths_and_texts_differ() -> None:
    assert found(joints([1.0]), joints([1.0, 2.0])) == [('position.length', math.inf)]
    assert found(joints([], 'map'), joints([], 'odom')) == [('header.frame_id', math.inf)]


def test_values_of_diagnostics_are_numbers_by_their_keys() -> None:
    assert found(status(x_m='1.0', r='A'), status(x_m='1.25', r='B')) == [
        ('values.x_m', 0.25),
        ('values.r', math.inf),
    ]
    assert found(status(x_m='1.0'), status(x_m='1.00')) == []
    assert found(status(x='1'), status(y='1'))[0][1] == math.inf


def test_recomputation_names_the_first_beyond_the_tolerance() -> None:
    names = ('/landmarks', '/pose', '/state')
    decoder = Decoder([string_topic(name, type_name=JOINTS, type_hash='') for name in names])
    landmarks, pose, state = (TopicResult(topic=name) for name in names)
    before = serialize(joints([1.0, 2.0]), JOINTS)
    for stamp_ns, now in ((1, [1.0, 2.0 + 5e-10]), (2, [1.1, 2.0]), (3, [1.2, 2.0])):
        pose.add(decoder, stamp_ns, (before, serialize(joints(now), JOINTS)), 1e-9)
        state.add(decoder, stamp_ns, (before, before), 1e-9)

    assert (pose.compared, pose.different, pose.worst_field) == (3, 2, 'position[0]')
    assert pose.first is not None
    assert (pose.first_ns, pose.first.second) == (2, 1.1)
    assert state.same
    assert not landmarks.same, 'what was not compared is not the same'


@pytest.fixture
def bags(tmp_path: Path) -> tuple[Path, list[tuple[str, int, bytes]]]:
    messages = texts(10)
    write_bag(tmp_path / 'a', messages)
    return tmp_path, messages


def compared(folder: Path, other: list[tuple[str, int, bytes]], **options: Any) -> str:  # noqa: ANN401
    write_bag(folder / 'b', other, storage='sqlite3')
    with BagReader(folder / 'a') as first, BagReader(folder / 'b') as second:
        (comparison,) = compare_bags(first, second, lambda _: True, **options)
    assert comparison.counts == (10, len(other))
    return comparison.where


Bags = tuple[Path, list[tuple[str, int, bytes]]]


def test_same_messages_in_another_storage_are_the_same(bags: Bags) -> None:
    assert compared(*bags) == ''


def test_missing_message_is_found(bags: Bags) -> None:
    assert compared(bags[0], bags[1][:9]) == 'message 9: only in the first'


def test_further_message_is_found(bags: Bags) -> None:
    further = [*bags[1], ('/text', 20_000_000, text_message('new'))]

    assert compared(bags[0], further) == 'message 10: only in the second'


def test_what_differs_comes_first_the_earliest_on_top(tmp_path: Path) -> None:
    topics = [string_topic(name) for name in ('/a', '/b', '/c')]
    for bag, texts_of in (('1', 'abcxyz'), ('2', 'abXxYz')):
        at = zip(('/a', '/b', '/c', '/a', '/b', '/c'), range(1, 7), texts_of, strict=True)
        messages = [(name, 10 * k, text_message(text)) for name, k, text in at]
        write_bag(tmp_path / bag, messages, topics=topics)
    with BagReader(tmp_path / '1') as first, BagReader(tmp_path / '2') as second:
        comparisons = compare_bags(first, second, lambda _: True)

    found = [(one.topic, one.same, one.time_ns) for one in comparisons]
    assert found == [('/c', False, 30), ('/b', False, 50), ('/a', True, None)]


def test_changed_field_is_named(bags: Bags) -> None:
    changed = [*bags[1][:4], ('/text', bags[1][4][1], text_message('new')), *bags[1][5:]]

    assert compared(bags[0], changed) == ('message 4 at 0.005 s: data = 000004xxxxxxxxxx and new')


def test_other_receive_times_are_told_or_ignored(bags: Bags, tmp_path: Path) -> None:
    later = [(topic, time_ns + 2_000_000, data) for topic, time_ns, data in bags[1]]

    assert compared(bags[0], later, times=False) == ''
    write_bag(tmp_path / 'c', later)
    with BagReader(tmp_path / 'a') as first, BagReader(tmp_path / 'c') as second:
        (comparison,) = compare_bags(first, second, lambda _: True)
    assert comparison.where == 'message 0 at 0.001 s: received at 0.003 s in the second'


def test_topic_of_one_bag_alone_is_named(bags: Bags, tmp_path: Path) -> None:
    write_bag(tmp_path / 'c', [], topics=[string_topic('/other')])
    with BagReader(tmp_path / 'a') as first, BagReader(tmp_path / 'c') as second:
        comparisons = compare_bags(first, second, lambda _: True)

    assert {c.topic: c.where for c in comparisons} == {
        '/other': 'only in one of them',
        '/text': 'only in one of them',
    }
    assert bags


def test_large_integers_that_differ_by_one_differ() -> None:
    assert _numbers(2**53 + 1)[0] - _numbers(2**53)[0] == 1  # type: ignore[index]
    stamps = np.array([2**60, 2**60 + 1], np.uint64)
    assert np.diff(_numbers(stamps)) == [1]  # type: ignore[arg-type]
