from collections.abc import Callable
import math

import numpy as np
import pytest

from goalreach_learning.kinematic_drive import blended_track, crisp_track
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import PathOutcome, Pose2, Region

PolicyMaker = Callable[[dict[Region, int]], Policy]
REGIONS = RegionMap()
X1, Y1 = 1.1811, 1.6891


def at(x_m: float, y_m: float) -> Pose2:
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=0.0)


def test_crisp_track_turns_at_the_borders(arena: Arena, make_policy: PolicyMaker) -> None:
    track = crisp_track(arena, make_policy({(0, 1): 0, (1, 1): 6}), at(0.5, 2.5))
    assert track.outcome is PathOutcome.GOAL
    assert track.points_m == pytest.approx(np.array([[0.5, 2.5], [X1, 2.5], [X1, Y1]]))
    assert track.length_m == pytest.approx(X1 - 0.5 + 2.5 - Y1)


def test_crisp_track_ends_at_a_wall(arena: Arena, make_policy: PolicyMaker) -> None:
    track = crisp_track(arena, make_policy({(0, 1): 4}), at(0.5, 2.5))
    assert track.outcome is PathOutcome.BUMP
    assert track.points_m[-1] == pytest.approx([0.225, 2.5])


def test_an_endless_path_is_truncated(arena: Arena, make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 1): 0, (1, 1): 4})
    assert crisp_track(arena, policy, at(0.5, 2.5)).outcome is PathOutcome.TIMEOUT


def test_blended_track_bends_into_the_goal(arena: Arena, make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 1): 0, (1, 1): 6})
    track = blended_track(arena, policy, at(0.5, 2.5), mode='fuzzy')
    assert track.outcome is PathOutcome.GOAL
    steps = np.diff(track.points_m, axis=0)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    assert np.abs(turns).max() < math.radians(6.0)
    assert track.length_m < X1 - 0.5 + 2.5 - Y1 + 0.3


@pytest.mark.parametrize('mode', ['fuzzy', 'fuzzy-eq3'])
def test_blended_tracks_keep_their_distance_from_walls(
    mode: str, arena: Arena, learned: Policy
) -> None:
    for x_m in np.linspace(0.24, arena.width_m - 0.24, 7):
        for y_m in np.linspace(0.24, arena.length_m - 0.24, 9):
            track = blended_track(arena, learned, at(x_m, y_m), mode=mode)
            assert track.outcome is PathOutcome.GOAL
            sizes = np.array([arena.width_m, arena.length_m])
            gaps = np.minimum(track.points_m, sizes - track.points_m).min(axis=1)
            assert gaps.min() >= min(gaps[0], 0.5) - 1e-9
