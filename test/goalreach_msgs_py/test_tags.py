from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import FileFormatError, GoalreachError
from goalreach_msgs_py.tags import Tag, tags_from_flat, tags_to_flat

TAG = Tag(id=7, size_m=0.2, x_m=1.0, y_m=0.0, z_m=1.3, facing_rad=math.pi / 2)
REST = """
name: room
width_m: 3.0
length_m: 4.0
regions:
  {x_borders_m: [1.0, 2.0], y_borders_m: [1.3, 2.6], transition_width_m: 0.4, goal: FRONT/NEAR}
starts: {border: 4}
"""
GOOD = 'tags:\n  - {id: 7, size_m: 0.2, x_m: 1.0, y_m: 0.0, z_m: 1.3, facing_deg: 90}\n'


def test_corners_run_clockwise_from_the_upper_left_of_who_looks_at_it() -> None:
    assert TAG.corners_m == pytest.approx(
        np.array([(1.1, 0.0, 1.4), (0.9, 0.0, 1.4), (0.9, 0.0, 1.2), (1.1, 0.0, 1.2)])
    )


def test_errors_of_place_move_all_corners_and_errors_of_angles_turn_them() -> None:
    covariance = TAG.corner_covariance_m2(0.003)
    across, out = covariance[0::3, 0::3], covariance[1::3, 1::3]
    assert across[0, 1] == pytest.approx(0.003**2 + 0.01**2 * 0.1**2)
    assert out[0, 0] == pytest.approx(0.003**2 + 2 * (0.01 * 0.1) ** 2 + 0.0003**2)
    assert out[0, 2] == pytest.approx(0.003**2 - 2 * (0.01 * 0.1) ** 2)


def test_the_numbers_of_a_parameter_are_read_back() -> None:
    assert tags_from_flat(tags_to_flat([TAG, TAG])) == (TAG, TAG)
    with pytest.raises(GoalreachError, match='id, size, x, y, z and facing'):
        tags_from_flat((1.0, 2.0))


def test_an_arena_may_have_tags_alone(tmp_path: Path) -> None:
    (tmp_path / 'arena.yaml').write_text(GOOD + REST)
    arena = read_arena(tmp_path / 'arena.yaml')
    assert arena.tags == (TAG,)
    assert arena.landmarks_m == ()


@pytest.mark.parametrize(
    ('tags', 'line'),
    [
        (GOOD.replace('7', '587'), r'tags\[0\].id = 587'),
        (GOOD.replace('7', '7.5'), r'tags\[0\].id = 7.5'),
        (GOOD.replace('size_m: 0.2', 'size_m: 0'), r'tags\[0\].size_m = 0'),
        (GOOD.replace('z_m: 1.3', 'z_m: 0.05'), r'tags\[0\].z_m = 0.05'),
        (GOOD.replace('x_m: 1.0', 'x_m: 9'), r'tags\[0\] = '),
        (GOOD.replace(', facing_deg: 90', ''), r'tags\[0\].facing_deg is missing'),
        (GOOD + GOOD.splitlines()[1] + '\n', r'tags\[1\].id = 7'),
        (GOOD + 'tag_family: 41h12\n', "tag_family = '41h12'"),
        ('tags: 3\n', 'tags = 3'),
        ('tags: []\n', r'leds_m'),
    ],
)
def test_bad_tags_get_one_line(tmp_path: Path, tags: str, line: str) -> None:
    (tmp_path / 'arena.yaml').write_text(tags + REST)
    with pytest.raises(FileFormatError, match=line):
        read_arena(tmp_path / 'arena.yaml')
