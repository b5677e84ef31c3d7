"""Where the paths of an evaluation begin: what `--starts` means."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Pose2

if TYPE_CHECKING:
    import numpy as np

    from goalreach_msgs_py.arena import Arena
from dataclasses import dataclass

import numpy as np

from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena

BORDER_GAP_M: Final = 0.1
"""Gap between body and wall at a start at the borders, metres; chosen, as at the 22 starts."""

_MAX_STARTS = 1_000_000


def border_starts(arena: Arena, count: int, rng: np.random.Generator) -> tuple[Pose2, ...]:
    """Return poses drawn evenly along the four walls, outside the goal region, any heading.

    "The starting positions considered are 22 different points at the borders of the environment"
    (section "The Simulation Phase"); these are any number of them.

    Args:
        arena: The arena.
        count: How many.
        rng: Source of randomness.
    """
    from goalreach_msgs_py.arena import BODY_RADIUS_M

    inset_m = BODY_RADIUS_M + BORDER_GAP_M
    width_m, length_m = arena.width_m - 2.0 * inset_m, arena.length_m - 2.0 * inset_m
    starts: list[Pose2] = []
    while len(starts) < count:
        along_m = rng.uniform(0.0, 2.0 * (width_m + length_m))
        heading_rad = rng.uniform(-math.pi, math.pi)
        x_m, y_m = (inset_m + part_m for part_m in _on_rectangle(along_m, width_m, length_m))
        if arena.regions.region_at(x_m, y_m) != arena.regions.goal:
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


def starts_of(text: str, arena: Arena, seed: int) -> tuple[Pose2, ...]:
    """Return the starts that `paper`, `random:N` or `border:N` stands for.

    Args:
        text: What a person wrote.
        arena: The arena.
        seed: Seed of the drawn ones.

    Raises:
        ConfigurationError: It is none of them.
    """
    import numpy as np

    if text == 'paper':
        return arena.starts
    kind, _, number = text.partition(':')
    count = int(number) if number.isdecimal() else 0
    if kind not in ('random', 'border') or not 0 < count <= _MAX_STARTS:
        allowed = 'paper, random:N or border:N with N from 1 to 1000000'
        raise ConfigurationError('--starts', text, allowed)
    draw = random_starts if kind == 'random' else border_starts
    return draw(arena, count, np.random.default_rng(seed))


_START_CLEARANCE_M = 0.05


@dataclass(frozen=True, kw_only=True)
class RunSeeds:
    """Independent seeds of the random parts of a run, all from one number."""

    simulator: int
    controller: int
    starts: int
    training: int

    @classmethod
    def spawn(cls, seed: int) -> RunSeeds:
        """Derive the seeds from the run's one seed."""
        words = np.random.SeedSequence(seed).generate_state(4, dtype=np.uint32) >> 1
        simulator, controller, starts, training = (int(word) for word in words)
        return cls(simulator=simulator, controller=controller, starts=starts, training=training)


def random_starts(
    arena: Arena, count: int, rng: np.random.Generator, *, clearance_m: float = _START_CLEARANCE_M
) -> tuple[Pose2, ...]:
    """Return poses drawn evenly over the free floor outside the goal region, any heading.

    Args:
        arena: The arena.
        count: How many.
        rng: Source of randomness.
        clearance_m: Distance kept between body and wall.
    """
    inset_m = BODY_RADIUS_M + clearance_m
    starts: list[Pose2] = []
    while len(starts) < count:
        x_m = rng.uniform(inset_m, arena.width_m - inset_m)
        y_m = rng.uniform(inset_m, arena.length_m - inset_m)
        heading_rad = rng.uniform(-math.pi, math.pi)
        if arena.regions.region_at(x_m, y_m) != arena.regions.goal:
            starts.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return tuple(starts)
