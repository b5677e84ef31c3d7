from __future__ import annotations

import argparse

import pytest

from goalreach_bringup.ros2cli.arguments import (
    non_negative_int,
    positive_float,
    positive_int,
    ros_name,
)


def test_numbers_in_range() -> None:
    assert (non_negative_int('0'), positive_int('12'), positive_float('2.5')) == (0, 12, 2.5)


@pytest.mark.parametrize('text', ['-1', '1.5', 'x', ''])
def test_not_an_index(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match='non-negative integer'):
        non_negative_int(text)


def test_zero_is_not_positive() -> None:
    with pytest.raises(argparse.ArgumentTypeError, match='positive integer'):
        positive_int('0')


@pytest.mark.parametrize('text', ['0', '-1.0', 'nan', 'inf', 'x'])
def test_not_a_rate(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match='positive number'):
        positive_float(text)


@pytest.mark.parametrize('name', ['/a', 'a', '~/a', '/a/b_1', '_a', '/{node}/a'])
def test_names_of_ros(name: str) -> None:
    assert ros_name(name) == name
