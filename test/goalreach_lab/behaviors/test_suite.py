"""The obstacles suite: arenas, drivers, and rows from results by hand."""

import math
from pathlib import Path

import pytest

from goalreach_lab.behaviors.irsim_driver import drive_irsim
from goalreach_lab.behaviors.random_arenas import random_arena, shortest_way_m
from goalreach_lab.behaviors.suite import (
    DRIVERS,
    IRSIM,
    MUJOCO,
    Options,
    drive_arena,
    execute,
    frame_cost,
    rows_of,
)
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Pose2

START = Pose2(x_m=1.778, y_m=4.2, heading_rad=-math.pi / 2)
PATH = {
    'driver': 'behaviours',
    'outcome': 'goal',
    'bumps': 0,
    'ends_pressed': False,
    'length_m': 3.0,
    'shortest_m': 2.0,
}


def test_an_arena_repeats_and_has_a_way_to_its_goal() -> None:
    first, again, other = random_arena(5), random_arena(5), random_arena(6)
    assert first == again
    assert first.obstacles != other.obstacles
    assert 1 <= len(first.obstacles) <= 8
    assert 1.5 <= shortest_way_m(first, first.starts[0]) < 6.0


def test_the_shortest_way_goes_round_what_stands() -> None:
    goal_y_m = Arena().regions.bounds(Arena().regions.goal)[3]
    straight_m = shortest_way_m(Arena(), START)
    assert straight_m == pytest.approx(4.2 - goal_y_m, abs=0.06)
    wall = Obstacle(x_m=1.778, y_m=3.0, length_m=3.6, width_m=0.2)
    assert shortest_way_m(Arena(obstacles=(wall,), starts=()), START) == math.inf
    box = Obstacle(x_m=1.778, y_m=3.0, length_m=1.0, width_m=0.2)
    assert (
        straight_m + 0.2
        < shortest_way_m(Arena(obstacles=(box,), starts=()), START)
        < 1.5 * straight_m
    )


def test_rows_count_goals_bumps_and_lengths() -> None:
    results = [
        PATH,
        {**PATH, 'bumps': 1},
        {**PATH, 'outcome': 'timeout', 'bumps': 2, 'ends_pressed': True},
        {**PATH, 'driver': 'goal alone', 'outcome': 'bump'},
    ]
    rows = {row.name: row for row in rows_of('behaviours', results)}
    assert rows['behaviours: paths that reach the goal'].ours == pytest.approx(200 / 3)
    assert rows['behaviours: paths with a bump'].ours == pytest.approx(200 / 3)
    assert rows['behaviours: paths that end pressed'].met is False
    assert rows['behaviours: length over the shortest way'].ours == pytest.approx(1.5)
    assert all(row.goal is None for row in rows_of('goal alone', results))
    for goals, met in ((97, True), (96, False)):
        paths = [{**PATH, 'driver': MUJOCO, 'outcome': 'goal'}] * goals
        paths += [{**PATH, 'driver': MUJOCO, 'outcome': 'timeout'}] * (100 - goals)
        assert rows_of(MUJOCO, paths)[0].met is met


def test_both_drivers_drive_and_their_paths_are_drawn(tmp_path: Path) -> None:
    rows = execute(
        Options(
            seed=2,
            arenas=2,
            peer_arenas=0,
            mujoco_arenas=0,
            results=tmp_path,
            figures=tmp_path / 'figures',
        )
    )
    assert {row.name.partition(':')[0] for row in rows} >= set(DRIVERS)
    assert (tmp_path / 'figures' / 'obstacles.png').stat().st_size > 10_000
    assert drive_arena({'driver': 'behaviours', 'arena': 200_000})['outcome'] == 'goal'


def test_behaviours_add_to_a_frame() -> None:
    cost = frame_cost(200_000, arenas=1)
    assert 1.0 < cost.ours < 2.0
    assert cost.n > 20


def test_the_peer_reaches_a_free_goal_and_bumps_into_what_it_cannot_pass() -> None:
    pytest.importorskip('irsim', reason='the extra bench is not installed')
    free = drive_irsim(Arena(), START, 60.0)
    assert free['outcome'] == 'goal'
    assert free['length_m'] == pytest.approx(4.2 - Arena().regions.bounds((1, 0))[3], abs=0.4)
    wall = Obstacle(x_m=1.778, y_m=3.0, length_m=3.6, width_m=0.2)
    assert drive_irsim(Arena(obstacles=(wall,), starts=()), START, 10.0)['outcome'] != 'goal'
    assert drive_arena({'driver': IRSIM, 'arena': 100_006})['shortest_m'] > 1.5
