"""Arenas with random obstacles, and the shortest way through them."""

from collections.abc import Callable, Iterable
from dataclasses import replace
import heapq
import itertools
import math
from typing import Final

import numpy as np

from goalreach_msgs_py.arena import BODY_RADIUS_M, FACING_GOAL_WALL_RAD, Arena
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Pose2
from goalreach_sim.camera_view import is_hidden

MOST_OBSTACLES: Final = 8
PASSAGE_M: Final = 0.15
"""Free space beside the body, on both sides, of a way that counts as passable. Chosen."""
_START_GAP_M: Final = 0.4
"""Gap between the body at its start and anything, wherever that moves. Chosen."""
_LEAST_M: Final = 1.5
"""Least length of the way to the goal. Chosen."""
_MOVING: Final = 0.25
"""Share of the obstacles that move. Chosen."""
_CAMERA_M: Final = 1.1
_ASIDE_M: Final = 0.1
_LOW_M: Final = 1.0
_CELL_M: Final = 0.05
_STEPS: Final = [
    (i, j, _CELL_M * math.hypot(i, j))
    for i, j in itertools.product(range(-2, 3), repeat=2)
    if math.gcd(i, j) == 1
]
"""To the 16 next cells of a grid: lengths exceed straight ones by 1.3 % on average."""


def random_arena(seed: int, arena: Arena | None = None) -> Arena:
    """Return an arena with 1 to 8 obstacles, some moving, and one start from which a way leads on.

    The way keeps `PASSAGE_M` clear of all that stands; what moves is left out. Sizes and speeds
    are chosen: furniture, bins and people that stroll.

    Args:
        seed: Seed of all draws.
        arena: Walls, LEDs and regions; the paper's if None.
    """
    arena = arena or Arena()
    rng = np.random.default_rng([seed, 1])
    while True:
        count = int(rng.integers(1, MOST_OBSTACLES + 1))
        obstacles = tuple(_obstacle(arena, rng) for _ in range(count))
        start = Pose2(
            x_m=rng.uniform(BODY_RADIUS_M, arena.width_m - BODY_RADIUS_M),
            y_m=rng.uniform(BODY_RADIUS_M, arena.length_m - BODY_RADIUS_M),
            heading_rad=FACING_GOAL_WALL_RAD,
        )
        if arena.regions.region_at(start.x_m, start.y_m) == arena.regions.goal:
            continue
        everywhere = [one for track in obstacles for one in _places(track)]
        if any(
            one.contact(start.x_m, start.y_m)[0] < BODY_RADIUS_M + _START_GAP_M
            for one in everywhere
        ):
            continue
        if not _sees_all(arena, start, obstacles):
            continue
        made = replace(arena, starts=(start,), obstacles=obstacles, name=f'random:{seed}')
        if _LEAST_M <= shortest_way_m(made, start) < math.inf:
            return made


def _sees_all(arena: Arena, start: Pose2, obstacles: Iterable[Obstacle]) -> bool:
    """Return whether no obstacle hides an LED at the start and around it.

    The robot looks for all LEDs there. An LED at the very edge of an obstacle is seen in part.
    """
    standing = [one.after(0.0) for one in obstacles]
    return not any(
        is_hidden((start.x_m + aside_m, start.y_m, camera_m), led_m, standing)
        for led_m in arena.landmarks_m
        for aside_m, camera_m in ((-_ASIDE_M, _CAMERA_M), (_ASIDE_M, _CAMERA_M), (0.0, _LOW_M))
    )


def _obstacle(arena: Arena, rng: np.random.Generator) -> Obstacle:
    x_m, y_m = rng.uniform(0.0, arena.width_m), rng.uniform(0.0, arena.length_m)
    sizes = (
        {'radius_m': rng.uniform(0.08, 0.25)}
        if rng.random() < 0.5  # noqa: PLR2004 - as many cylinders as boxes
        else {
            'length_m': rng.uniform(0.2, 0.8),
            'width_m': rng.uniform(0.15, 0.4),
            'heading_rad': rng.uniform(0.0, math.pi),
        }
    )
    one = Obstacle(x_m=x_m, y_m=y_m, height_m=rng.uniform(0.3, 1.6), **sizes)  # type: ignore[arg-type]
    if rng.random() >= _MOVING:
        return one
    turn, length_m = rng.uniform(0.0, math.tau), rng.uniform(0.5, 1.5)
    end_m = (
        min(max(x_m + length_m * math.cos(turn), 0.0), arena.width_m),
        min(max(y_m + length_m * math.sin(turn), 0.0), arena.length_m),
    )
    return replace(one, track_m=(end_m,), speed_m_per_s=rng.uniform(0.05, 0.2))


def _places(one: Obstacle) -> list[Obstacle]:
    """Return an obstacle along its track, a decimetre apart."""
    corners_m = ((one.x_m, one.y_m), *one.track_m, (one.x_m, one.y_m))
    lap_m = sum(itertools.starmap(math.dist, itertools.pairwise(corners_m)))
    return [one.after(driven_m) for driven_m in np.arange(0.0, lap_m + 0.1, 0.1).tolist()]


def shortest_way_m(arena: Arena, start: Pose2, passage_m: float = PASSAGE_M) -> float:
    """Return the length of the shortest way to the goal region among what stands.

    Args:
        arena: The arena, seen as it truly is.
        start: Where the way begins.
        passage_m: Free space beside the body at obstacles; at walls the body alone must fit.

    Returns:
        Metres, by Dijkstra's algorithm on a grid of 5 cm; infinite where there is no way.
    """
    standing = [one for one in arena.obstacles if not one.track_m]
    reach_m, goal = BODY_RADIUS_M + passage_m, arena.regions.goal
    walls = replace(arena, obstacles=(), starts=())

    def is_free(cell: tuple[int, int]) -> bool:
        x_m, y_m = cell[0] * _CELL_M, cell[1] * _CELL_M
        return walls.is_free(x_m, y_m) and all(
            one.contact(x_m, y_m)[0] >= reach_m for one in standing
        )

    def is_goal(cell: tuple[int, int]) -> bool:
        return arena.regions.region_at(cell[0] * _CELL_M, cell[1] * _CELL_M) == goal

    first = (round(start.x_m / _CELL_M), round(start.y_m / _CELL_M))
    return _dijkstra(first, is_free, is_goal)


_Test = Callable[[tuple[int, int]], bool]


def _dijkstra(first: tuple[int, int], is_free: _Test, is_goal: _Test) -> float:
    known: dict[tuple[int, int], bool] = {first: True}
    best, queue = {first: 0.0}, [(0.0, first)]
    while queue:
        length_m, cell = heapq.heappop(queue)
        if is_goal(cell):
            return length_m
        if length_m > best[cell]:
            continue
        for i, j, step_m in _STEPS:
            there = (cell[0] + i, cell[1] + j)
            if there not in known:
                known[there] = is_free(there)
            if known[there] and length_m + step_m < best.get(there, math.inf):
                best[there] = length_m + step_m
                heapq.heappush(queue, (best[there], there))
    return math.inf
