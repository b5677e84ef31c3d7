"""Starts by word, and points drawn along the walls."""

from dataclasses import replace

import numpy as np
import pytest

from goalreach_evaluation.starts import _on_rectangle, border_starts, choose_starts
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.errors import ConfigurationError

ARENA = Arena()


@pytest.mark.parametrize(
    ('along_m', 'point'),
    [
        (0.0, (0.0, 0.0)),
        (1.0, (1.0, 0.0)),
        (3.5, (3.0, 0.5)),
        (8.0, (2.0, 4.0)),
        (13.0, (0.0, 1.0)),
    ],
)
def test_points_on_a_rectangle_of_3_by_4(along_m: float, point: tuple[float, float]) -> None:
    assert _on_rectangle(along_m, 3.0, 4.0) == pytest.approx(point)


def test_border_starts_keep_their_clearance_from_every_wall() -> None:
    starts = border_starts(ARENA, 400, np.random.default_rng(0))
    nearest = []
    for start in starts:
        gaps = (start.x_m, start.y_m, ARENA.width_m - start.x_m, ARENA.length_m - start.y_m)
        assert min(gaps) == pytest.approx(BODY_RADIUS_M + 0.1)
        assert ARENA.regions.region_at(start.x_m, start.y_m) != ARENA.regions.goal
        nearest.append(int(np.argmin(gaps)))
    assert set(nearest) == {0, 1, 2, 3}
    assert min(np.bincount(nearest)) > 400 * 0.08  # the goal wall loses its middle to the goal


def test_starts_by_word() -> None:
    assert choose_starts('paper', ARENA, 0) == ARENA.starts
    assert len(choose_starts('random:3', ARENA, 0)) == 3
    assert choose_starts('border:3', ARENA, 5) == border_starts(ARENA, 3, np.random.default_rng(5))


@pytest.mark.parametrize('text', ['', 'random', 'border:0', 'border:-1', 'wall:3', 'random:1e3'])
def test_refuses_other_words(text: str) -> None:
    with pytest.raises(ConfigurationError, match='starts = '):
        choose_starts(text, ARENA, 0)


def test_an_arena_without_starts_or_free_floor_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='has none of its own'):
        choose_starts('paper', replace(ARENA, starts=()), 0)
    ends = tuple(cell for cell in ARENA.regions.cells if cell not in {ARENA.regions.goal, (1, 1)})
    regions = replace(ARENA.regions, forbidden=ends)
    with pytest.raises(ConfigurationError, match='no floor is free'):
        choose_starts('border:1', replace(ARENA, regions=regions, starts=()), 0)
