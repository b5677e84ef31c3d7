"""Starting poses of the paths, and the seeds of a run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math
from typing import Final

import numpy as np

from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Pose2

BORDER_CLEARANCE_M: Final = 0.1
"""Distance between body and wall at a start at the borders, as at the 22 starts. Chosen."""
_CLEARANCE_M: Final = 0.05
_MAX_STARTS: Final = 1_000_000
_MOST_DRAWS: Final = 10_000
"""Draws per start after which there seems to be no floor for it. Chosen."""


@dataclass(frozen=True, kw_only=True)
class RunSeeds:
    """Independent seeds of the random parts of a run, derived from one number."""

    simulator: int
    controller: int
    starts: int
    training: int

    @classmethod
    def spawn(cls, seed: int) -> 'RunSeeds':
        """Derive the seeds from the seed of the run."""
        words = np.random.SeedSequence(seed).generate_state(4, dtype=np.uint32) >> 1
        simulator, controller, starts, training = (int(word) for word in words)
        return cls(simulator=simulator, controller=controller, starts=starts, training=training)


def choose_starts(starts: Sequence[Pose2] | str, arena: Arena, seed: int) -> tuple[Pose2, ...]:
    """Return the starts that `paper`, `random:N` or `border:N` stands for, or those given.

    Raises:
        ConfigurationError: It is none of the words, or a given start is not on the free floor.
    """
    if not isinstance(starts, str):
        if not starts:
            raise ConfigurationError('starts', starts, 'at least one pose')
        return replace(arena, starts=tuple(starts)).starts
    if starts == 'paper':
        if not arena.starts:
            raise ConfigurationError('starts', starts, 'random:N: the arena has none of its own')
        return arena.starts
    kind, _, number = starts.partition(':')
    count = int(number) if number.isdecimal() else 0
    if kind not in ('random', 'border') or not 0 < count <= _MAX_STARTS:
        allowed = 'paper, random:N or border:N with N from 1 to 1000000'
        raise ConfigurationError('starts', starts, allowed)
    draw = random_starts if kind == 'random' else border_starts
    return draw(arena, count, np.random.default_rng(seed))


def random_starts(
    arena: Arena, count: int, rng: np.random.Generator, *, clearance_m: float = _CLEARANCE_M
) -> tuple[Pose2, ...]:
    """Draw poses evenly outside the goal and forbidden regions, with any heading.

    The clearance is kept between body and wall or obstacle.
    """
    inset_m = BODY_RADIUS_M + clearance_m
    starts: list[Pose2] = []
    for _ in _draws(starts, count):
        x_m = rng.uniform(inset_m, arena.width_m - inset_m)
        y_m = rng.uniform(inset_m, arena.length_m - inset_m)
        heading_rad = rng.uniform(-math.pi, math.pi)
        free = arena.is_free(x_m, y_m, body_radius_m=inset_m)
        if free and arena.regions.region_at(x_m, y_m) not in arena.regions.ends:
            starts.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return tuple(starts)


def _draws(starts: list[Pose2], count: int) -> Iterator[None]:
    """Let starts be drawn until there are so many of them."""
    for _ in range(_MOST_DRAWS * count):
        if len(starts) == count:
            return
        yield
    raise ConfigurationError('starts', count, 'none: no floor is free outside goal and forbidden')


def border_starts(arena: Arena, count: int, rng: np.random.Generator) -> tuple[Pose2, ...]:
    """Draw poses evenly along the four walls, outside the same regions, with any heading.

    "The starting positions considered are 22 different points at the borders of the environment"
    (section "The Simulation Phase"); here their number is free.
    """
    inset_m = BODY_RADIUS_M + BORDER_CLEARANCE_M
    width_m, length_m = arena.width_m - 2.0 * inset_m, arena.length_m - 2.0 * inset_m
    starts: list[Pose2] = []
    for _ in _draws(starts, count):
        along_m = rng.uniform(0.0, 2.0 * (width_m + length_m))
        heading_rad = rng.uniform(-math.pi, math.pi)
        x_m, y_m = (inset_m + offset for offset in _on_rectangle(along_m, width_m, length_m))
        outside = arena.regions.region_at(x_m, y_m) not in arena.regions.ends
        if outside and arena.is_free(x_m, y_m):
            starts.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return tuple(starts)


def _on_rectangle(along_m: float, width_m: float, length_m: float) -> tuple[float, float]:
    """Return the point that far along the edge of a rectangle, counter-clockwise from (0, 0)."""
    if along_m < width_m:
        return along_m, 0.0
    if along_m < width_m + length_m:
        return width_m, along_m - width_m
    if along_m < 2.0 * width_m + length_m:
        return 2.0 * width_m + length_m - along_m, length_m
    return 0.0, 2.0 * (width_m + length_m) - along_m
