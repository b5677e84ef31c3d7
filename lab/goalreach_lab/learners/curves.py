"""Paths and bumps that learners need until the policy leads to the goal from every start."""

from collections.abc import Iterator, Mapping, Sequence
import functools
import importlib.util
from pathlib import Path
import sys
from typing import Final

import numpy as np

from goalreach_evaluation.choices import choose_arena
from goalreach_evaluation.statistics import (
    bootstrap_interval,
    interquartile_mean,
    probability_of_improvement,
)
from goalreach_evaluation.sweep import CurveCase, learn_case
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_lab.template import table
from goalreach_msgs_py.arena import Arena, paper_starts
from goalreach_msgs_py.arena_file import knots_around
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import FloatArray

ARENAS: Final = ('paper', 'large', 'narrow', 'side_goal')
RANDOM: Final = 'random'
RANDOM_ARENAS: Final = 50
IMAGES: Final = 'images, nominal noise'
NO_IMAGES: Final = 'neither images nor noise'
_EXAMPLES: Final = Path(__file__).parents[3] / 'examples'
_OTHERS: Final = ('paper', 'q-lambda', 'dyna-q')
DQN: Final = 'stable_baselines3_learner:DqnLearner'
LIMIT: Final = 440
AFTER: Final = 22
"""Further paths in which a policy should not be lost, without images, and of the planner."""
AFTER_IMAGES: Final = 5
"""The same with images in all other cases. Chosen."""
_THIRDS: Final = np.array([1 / 3, 2 / 3])
KEY: Final = ('learner', 'arena', 'drive', 'number')
_BOUNDS: Final = {
    'paths, median': 15.0, 'paths, 95th percentile': 40.0, 'bumps, median': 5.0,
    'bumps, 95th percentile': 8.0, 'runs that lost it': 0.0,
}  # fmt: skip
"""Goals of the planner with images. Chosen."""

Group = tuple[str, str, str]
"""Learner, arena and drive; all random arenas are one."""


def curve_study(*, seeds: int, image_seeds: int, seed: int, jobs: int) -> Study:
    """Return the study of what learners need.

    The planner drives with images in every arena. The others do so in the paper's arena with fewer
    seeds, because they take longer, and without images with all seeds. DQN takes part where
    stable-baselines3 is installed.

    Args:
        seeds: Runs of each learner in each arena, and in all random arenas together.
        image_seeds: Runs of the other learners with images.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    return Study(
        name='curves',
        key=KEY,
        settings={'seed': seed},
        cases=[
            dict(zip(KEY, case, strict=True)) for case in _cases(seeds, min(seeds, image_seeds))
        ],
        measure=per_case(functools.partial(_measure, seed=seed), jobs=jobs),
        analyse=groups,
        rows=rows,
    )


def _cases(seeds: int, image_seeds: int) -> Iterator[tuple[str, str, str, int]]:
    """Yield the cases, number by number, so that what is measured so far is balanced."""
    others = [*_OTHERS, *([DQN] if is_sb3_installed() else [])]
    for number in range(seeds):
        for arena in (*ARENAS, f'{RANDOM} {1 + number % RANDOM_ARENAS}'):
            yield 'planner', arena, IMAGES, number
        for learner in ('planner', *others):
            yield learner, ARENAS[0], NO_IMAGES, number
        for learner in others if number < image_seeds else ():
            yield learner, ARENAS[0], IMAGES, number


def is_sb3_installed() -> bool:
    """Return whether `DQN` can learn (extra `sb3`), and make it known to `Agent`."""
    if str(_EXAMPLES) not in sys.path:
        sys.path.append(str(_EXAMPLES))
    return all(importlib.util.find_spec(name) for name in ('gymnasium', 'stable_baselines3'))


def _measure(case: Case, *, seed: int) -> Result:
    is_sb3_installed()
    learner, name, drive, number = (case[field] for field in KEY)
    kind, _, room = name.partition(' ')
    quick = drive == NO_IMAGES or (learner, name) == ('planner', ARENAS[0])
    found = learn_case(
        CurveCase(
            learner=learner,
            arena_name=name,
            arena=random_arena(seed, int(room)) if kind == RANDOM else choose_arena(name),
            noise_name=drive,
            noise=noise_preset('nominal') if drive == IMAGES else None,
            limit=LIMIT,
            after=AFTER if quick else AFTER_IMAGES,
            seed=seed + number,
        )
    )
    return {key: found[key] for key in ('learned', 'paths', 'bumps', 'length_m', 'time_s', 'lost')}


def random_arena(seed: int, number: int) -> Arena:
    """Return a rectangular room of 2.4 to 6 m each way, whose goal is any of nine regions."""
    rng = np.random.default_rng([seed, number])
    width_m, length_m = (round(float(size_m), 3) for size_m in rng.uniform(2.4, 6.0, 2))
    x_knots_m, y_knots_m = (
        knots_around(size_m * (_THIRDS + rng.uniform(-0.06, 0.06, 2)), size_m / 5, size_m)
        for size_m in (width_m, length_m)
    )
    goal = (int(rng.integers(3)), int(rng.integers(3)))
    regions = RegionMap(x_knots_m=x_knots_m, y_knots_m=y_knots_m, goal=goal)
    leds = ((0.25, 0.0, 1.42), (0.5, 0.5, 1.83), (0.75, 0.0, 1.63))
    return Arena(
        name=f'{RANDOM} {number}',
        width_m=width_m,
        length_m=length_m,
        regions=regions,
        landmarks_m=tuple((share * width_m, y_m, z_m) for share, y_m, z_m in leds),
        starts=paper_starts(regions),
    )


def groups(results: Sequence[Result]) -> dict[Group, list[Result]]:
    """Return the results by learner, arena and drive, in the order of the study."""
    found: dict[Group, list[Result]] = {}
    for one in results:
        group = one['learner'], one['arena'].partition(' ')[0], one['drive']
        found.setdefault(group, []).append(one)
    return found


def needed(results: Sequence[Result], field: str) -> FloatArray:
    """Return what each run needed, infinite where the limit came first."""
    return np.array([one[field] if one['learned'] else np.inf for one in results])


def spread(values: FloatArray) -> tuple[float, float]:
    """Return the median and the 95th percentile, each one of the values: they may be infinite."""
    half, most = np.quantile(values, (0.5, 0.95), method='inverted_cdf')
    return float(half), float(most)


def rows(found: Mapping[Group, Sequence[Result]]) -> list[BenchRow]:
    """Return the rows of the planner with images: paths, bumps, and runs that lost the goal."""
    made = []
    for (learner, arena, drive), results in found.items():
        if (learner, drive) == ('planner', IMAGES):
            lost = sum(one['lost'] > 0 for one in results)
            values = [v for field in ('paths', 'bumps') for v in spread(needed(results, field))]
            for (name, bound), value in zip(_BOUNDS.items(), (*values, lost), strict=True):
                goal, title = (
                    Goal(of='ours', relation='<=', bound=bound),
                    f'planner, {arena}: {name}',
                )
                made.append(BenchRow(name=title, unit='', ours=value, goal=goal, n=len(results)))
    return made


def curve_table(found: Mapping[Group, Sequence[Result]]) -> str:
    """Return what every learner needed in every arena, median and 95th percentile."""
    fields, lines = ('paths', 'bumps', 'length_m', 'time_s'), []
    for (learner, arena, drive), results in found.items():
        cells = [_cell(needed(results, field)) for field in fields]
        cells[-1] = cells[-1] if drive == IMAGES else '-'
        learned, lost = (sum(one[field] > 0 for one in results) for field in ('learned', 'lost'))
        name = learner.rpartition(':')[2]
        lines.append((name, arena, drive, len(results), learned, *cells, lost))
    heads = ('learner', 'arena', 'with', 'runs', 'learned', 'paths', 'bumps', 'm', 's', 'lost')
    return table(heads, lines)


def _cell(values: FloatArray) -> str:
    return ' / '.join('never' if np.isinf(one) else f'{one:.0f}' for one in spread(values))


def comparison_table(found: Mapping[Group, Sequence[Result]]) -> str:
    """Return interquartile means and probabilities of improvement without images, with intervals.

    R. Agarwal et al., NeurIPS 2021; see `goalreach_evaluation.statistics`.
    """
    scores = {
        learner: needed(results, 'paths')[:, None]
        for (learner, _, drive), results in found.items()
        if drive == NO_IMAGES and ('paper', ARENAS[0], drive) in found
    }
    rng, made = np.random.default_rng(0), []
    for learner, ours in scores.items():
        cells = [learner.rpartition(':')[2]]
        for statistic, *given in (
            (interquartile_mean, ours),
            (probability_of_improvement, ours, scores['paper']),
        ):
            low, high = bootstrap_interval(statistic, *given, rng=rng)
            cells.append(f'{statistic(*given):.2f} [{low:.2f}, {high:.2f}]')
        made.append(cells)
    return table(('learner', 'paths, interquartile mean', 'fewer paths than `paper`'), made)
