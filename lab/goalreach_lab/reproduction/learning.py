"""The learning suite: success, trials needed and values of Q-learning over many seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import statistics
from typing import Any, Final

import numpy as np

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.batch.batch_training import (
    greedy_successes_batch,
    train_batch,
    value_iteration,
)
from goalreach_lab.options import StudyOptions
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, find, per_case
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.options import option

SUMMARY = 'Q-learning over many seeds: success, trials needed, difference from the optimal values'

SUCCESS: Final = 'greedy policy reaches the goal from all 22 starts'
SETTLED: Final = 'trial after which it always does, median'
VALUES: Final = 'largest difference of the mean values of the regions from value iteration'
_BATCH = 1000
# Chosen, not from the paper: each free parameter well to either side of its default.
_VARIATIONS: tuple[dict[str, float], ...] = (
    {},
    {'alpha': 0.1},
    {'alpha': 0.8},
    {'gamma': 0.5},
    {'gamma': 0.95},
    {'temperature_start': 0.3},
    {'temperature_end': 0.05},
    {'temperature_start': 0.1, 'temperature_end': 0.1},
    {'temperature_start': 1.0, 'temperature_end': 1.0},
    {'start_jitter_m': 0.0, 'overshoot_m': 0.0},
)
"""Changes of the configuration; the first is the default."""


@dataclass(frozen=True, kw_only=True)
class Options(StudyOptions):
    """Options of the suite."""

    seeds: int = option(10_000, 'learning seeds', minimum=1)
    variation_seeds: int = option(2000, 'seeds for each changed parameter', minimum=1)


def execute(options: Options) -> list[BenchRow]:
    """Learn with all seeds and return the rows.

    Raises:
        FileFormatError: The results are refused or cannot be written.
    """
    study = learning_study(
        seeds=options.seeds,
        variation_seeds=options.variation_seeds,
        seed=options.seed,
        jobs=options.jobs,
    )
    return study.rows(find(study, options.results, measure=not options.as_it_is) or [])


def learning_study(*, seeds: int, variation_seeds: int, seed: int, jobs: int) -> Study:
    """Return the study of learning with the default and with changed parameters.

    Args:
        seeds: Learning seeds of the default.
        variation_seeds: Learning seeds for each changed parameter.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    return Study(
        name='learning',
        key=('variation', 'batch', 'seeds'),
        settings={'seed': seed},
        cases=[
            {'variation': name, 'batch': batch, 'seeds': min(_BATCH, count - batch * _BATCH)}
            for name, count in (
                (_name(changed), variation_seeds if changed else seeds) for changed in _VARIATIONS
            )
            for batch in range(-(-count // _BATCH))
        ],
        measure=per_case(functools.partial(_learn, seed=seed), jobs=jobs),
        analyse=_analyse,
        rows=_rows,
    )


def _name(changed: dict[str, float]) -> str:
    return ', '.join(f'{name} {value:g}' for name, value in changed.items())


def _config(name: str) -> LearningConfig:
    changed = next(one for one in _VARIATIONS if _name(one) == name)
    return LearningConfig(**changed)  # type: ignore[arg-type]


def _learn(case: Case, *, seed: int) -> Result:
    """Return what a batch of seeds learned.

    Returns:
        'first_trials': for each seed the trial after which its greedy policy always reached the
        goal from all starts; 'successes': number of seeds whose last policy does; 'values': sum
        over the seeds of the best value of each region; 'counts': number of transitions.
    """
    arena, config = Arena(), _config(case['variation'])
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(case['batch'],)))
    batch = train_batch(arena, config, rng=rng, n=case['seeds'])
    reached = np.array(
        [
            greedy_successes_batch(
                arena, batch.q_by_trial[:, k], batch.visits_by_trial[:, k], gamma=config.gamma
            ).all(axis=1)
            for k in range(config.trials)
        ]
    ).T
    return {
        'first_trials': [settled_after(row) for row in reached.tolist()],
        'successes': int(reached[:, -1].sum()),
        'values': batch.q_by_trial[:, -1].max(axis=-1).sum(axis=0).tolist(),
        'counts': batch.counts.tolist(),
    }


def settled_after(reached: Sequence[bool]) -> int:
    """Return the trial after which the goal was always reached; one past the last if never."""
    lost = [trial for trial, good in enumerate(reached) if not good]
    return 1 if not lost else lost[-1] + 2


def _analyse(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Return the findings of each variation, the default first."""
    found = []
    for name in map(_name, _VARIATIONS):
        batches = [result for result in results if result['variation'] == name]
        if not batches:
            continue
        seeds = sum(batch['seeds'] for batch in batches)
        values, counts = (
            np.sum([batch[field] for batch in batches], axis=0) for field in ('values', 'counts')
        )
        optimal = value_iteration(counts, gamma=_config(name).gamma).max(axis=-1)
        found.append(
            {
                'name': name,
                'seeds': seeds,
                'successes': sum(batch['successes'] for batch in batches),
                'first_trials': [trial for batch in batches for trial in batch['first_trials']],
                'value_error': float(np.abs(values / seeds - optimal).max()),
            }
        )
    return found


def _rows(found: Sequence[dict[str, Any]]) -> list[BenchRow]:
    rows = []
    for one in found:
        name = f'with {one["name"]}' if one['name'] else SUCCESS
        rows.append(_success_row(name, one))
        if not one['name']:
            rows += [
                BenchRow(
                    name=SETTLED,
                    unit='trials',
                    ours=statistics.median(one['first_trials']),
                    reference=20.0,
                    reference_name="the paper's",
                    n=one['seeds'],
                    note=f'slowest seed: {max(one["first_trials"])}',
                ),
                BenchRow(name=VALUES, unit='', ours=one['value_error'], n=one['seeds']),
            ]
    return rows


def _success_row(name: str, one: dict[str, Any]) -> BenchRow:
    low, high = wilson_interval(one['successes'], one['seeds'])
    return BenchRow(
        name=name,
        unit='% of seeds',
        ours=100.0 * one['successes'] / one['seeds'],
        goal=None if one['name'] else Goal(of='ours', relation='>=', bound=99.9),
        n=one['seeds'],
        note=f'95 % interval {100 * low:.2f} to {100 * high:.2f} %; '
        f'always after trial {statistics.median(one["first_trials"]):.0f} (median)',
    )
