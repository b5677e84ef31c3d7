"""Other grids and action sets: learned by the planner, and driven fuzzy from random starts."""

from collections.abc import Sequence
import functools
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_lab.template import table
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import LENGTH_M, WIDTH_M, Arena, paper_starts
from goalreach_msgs_py.arena_file import knots_around
from goalreach_msgs_py.regions import RegionMap, region_name
from goalreach_msgs_py.values import Region

GRIDS: Final[dict[str, tuple[int, int, Region, float]]] = {
    '5 x 7': (5, 7, (2, 0), 0.3),
    '2 x 2': (2, 2, (0, 0), 0.5),
}
"""Columns, rows, goal, and width of the transition areas, metres. Chosen."""
ACTIONS: Final = 16
_BATCH: Final = 25


def grid_study(*, starts: int, seed: int, jobs: int) -> Study:
    """Return the study of other grids.

    Args:
        starts: Random starts in each grid.
        seed: Seed of learning, starts and noise.
        jobs: Number of processes.
    """
    return Study(
        name='grids',
        key=('grid', 'batch', 'starts'),
        settings={'seed': seed, 'actions': ACTIONS},
        cases=[
            {'grid': grid, 'batch': batch, 'starts': min(_BATCH, starts - batch * _BATCH)}
            for grid in GRIDS
            for batch in range(math.ceil(starts / _BATCH))
        ],
        measure=per_case(functools.partial(_measure, seed=seed), jobs=jobs),
        analyse=_analyse,
        rows=_rows,
    )


def grid_arena(columns: int, rows: int, goal: Region, width_m: float) -> Arena:
    """Return the paper's room with another grid, in equal parts."""
    x_knots_m, y_knots_m = (
        knots_around(tuple(size_m * k / count for k in range(1, count)), width_m, size_m)
        for count, size_m in ((columns, WIDTH_M), (rows, LENGTH_M))
    )
    regions = RegionMap(x_knots_m=x_knots_m, y_knots_m=y_knots_m, goal=goal, actions=ACTIONS)
    return Arena(name='grid', regions=regions, starts=paper_starts(regions))


@functools.lru_cache
def _learned(grid: str, seed: int) -> tuple[Arena, Policy]:
    """Learn along 44 paths without images."""
    arena, config = grid_arena(*GRIDS[grid]), LearningConfig(trials=2)
    rng = np.random.default_rng(seed)
    agent = Agent('planner', arena.regions, config, rng)
    return arena, train(arena, config, rng=rng, agent=agent).policy


def _measure(case: Case, *, seed: int) -> Result:
    """Drive a batch of random starts."""
    arena, policy = _learned(case['grid'], seed)
    driven = evaluate(
        EvaluationRequest(
            policy=policy,
            arena=arena,
            starts=f'random:{case["starts"]}',
            seed=int(np.random.default_rng([seed, case['batch']]).integers(2**31)),
        )
    )
    return {
        'learned': sum(greedy_successes(arena, policy)),
        'outcomes': [path.outcome for path in driven.paths],
        'steps_deg': [math.degrees(path.max_heading_step_rad) for path in driven.paths],
    }


def _analyse(results: Sequence[Result]) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for one in results:
        grid = found.setdefault(one['grid'], {'outcomes': [], 'steps_deg': []})
        grid['learned'] = one['learned']
        grid['outcomes'] += one['outcomes']
        grid['steps_deg'] += one['steps_deg']
    return found


def _rows(found: dict[str, dict[str, Any]]) -> list[BenchRow]:
    return [
        BenchRow.none_allowed(
            f'{grid} regions, {ACTIONS} actions: paths not to the goal',
            len(one['outcomes']) - one['outcomes'].count('goal'),
            n=len(one['outcomes']),
            note=f'largest heading step {max(one["steps_deg"]):.1f} deg',
        )
        for grid, one in found.items()
    ]


def grid_table(found: dict[str, dict[str, Any]]) -> str:
    """Return outcomes and largest heading step of each grid."""
    return table(
        ('grid', 'goal', 'starts learned', 'paths', 'to the goal', 'largest heading step, deg'),
        (
            (
                grid,
                region_name(GRIDS[grid][2], GRIDS[grid][:2]),
                f'{one["learned"]} of 22',
                len(one['outcomes']),
                one['outcomes'].count('goal'),
                f'{max(one["steps_deg"]):.1f}',
            )
            for grid, one in found.items()
        ),
    )
