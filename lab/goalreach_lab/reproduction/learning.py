"""Learning: how surely, how soon, how fast, and how near to the optimum."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import statistics
import time
from typing import TYPE_CHECKING, NamedTuple

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_learning.q_learning import LearningConfig
    from goalreach_msgs_py.arena import Arena
from goalreach_evaluation.path_metrics import wilson_interval

SUMMARY = 'Learning over many seeds: success, trials needed, time, distance from the optimum'

_BATCH = 1000
# Chosen, not from the paper: each free parameter well to either side of its default.
_VARIATIONS = (
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


class _Study(NamedTuple):
    """What the seeds of one configuration gave."""

    successes: int
    seeds: int
    first_trials: list[int]
    largest_value_error: float
    batch_s: list[float]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument('--seeds', type=int, default=10_000, help='learning seeds')
    parser.add_argument(
        '--variation-seeds', type=int, default=2000, help='seeds for each changed parameter'
    )
    parser.add_argument('--phases', type=int, default=50, help='learning phases to time')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure.

    Raises:
        ConfigurationError: An option is refused.
    """
    from goalreach_learning.q_learning import LearningConfig
    from goalreach_msgs_py.arena import Arena
    from goalreach_msgs_py.errors import ConfigurationError

    for name in ('seeds', 'variation_seeds', 'phases'):
        if getattr(options, name) < 1:
            raise ConfigurationError(f'--{name}', getattr(options, name), 'a whole number >= 1')
    arena = Arena()
    study = _study(arena, LearningConfig(), options.seeds, options.seed)
    rows = _main_rows(arena, study, options)
    for changed in _VARIATIONS:
        config = LearningConfig(**changed)  # type: ignore[arg-type]
        varied = _study(arena, config, options.variation_seeds, options.seed)
        name = ', '.join(f'{key} {value:g}' for key, value in changed.items())
        rows.append(_success_row(f'with {name}', varied, goal=None))
    return rows


def _main_rows(arena: Arena, study: _Study, options: argparse.Namespace) -> list[BenchRow]:
    from goalreach_learning.q_learning import LearningConfig

    phases_ms = _time_phases(arena, LearningConfig(), options.phases, options.seed)
    return [
        _success_row(
            'greedy policy reaches the goal from all 22 starts',
            study,
            goal=Goal(of='ours', relation='>=', bound=99.9),
        ),
        BenchRow(
            name='trial after which it always does, median',
            unit='trials',
            ours=statistics.median(study.first_trials),
            reference=20.0,
            reference_name="(the paper's)",
            n=study.seeds,
            note=f'slowest seed: {max(study.first_trials)}',
        ),
        BenchRow(
            name='value of a region, mean over seeds, against value iteration',
            unit='largest difference',
            ours=study.largest_value_error,
            n=study.seeds,
        ),
        BenchRow(
            name='one learning phase of 440 paths, median',
            unit='ms',
            ours=statistics.median(phases_ms),
            goal=Goal(of='ours', relation='<=', bound=15.0),
            n=options.phases,
            note='processor time of one core',
        ),
        BenchRow(
            name='1000 learning phases at once, median',
            unit='s',
            ours=statistics.median(study.batch_s),
            goal=Goal(of='ours', relation='<=', bound=2.0),
            n=len(study.batch_s),
            note='processor time of one core',
        ),
    ]


def _success_row(name: str, study: _Study, *, goal: Goal | None) -> BenchRow:
    low, high = wilson_interval(study.successes, study.seeds)
    return BenchRow(
        name=name,
        unit='% of seeds',
        ours=100.0 * study.successes / study.seeds,
        goal=goal,
        n=study.seeds,
        note=f'95 % interval {100 * low:.2f} to {100 * high:.2f} %; '
        f'always from trial {statistics.median(study.first_trials):.0f} on (median)',
    )


def _study(arena: Arena, config: LearningConfig, seeds: int, seed: int) -> _Study:
    import numpy as np

    from goalreach_lab.batch.batch_training import (
        greedy_successes_batch,
        train_batch,
        value_iteration,
    )

    successes, first, seconds = 0, [], []
    learned, counts = np.zeros((3, 3)), np.zeros((3, 3, 8, 11), dtype=np.int64)
    sizes = [_BATCH] * (seeds // _BATCH) + ([seeds % _BATCH] if seeds % _BATCH else [])
    for number, size in enumerate(sizes):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        began_s = time.process_time()
        batch = train_batch(arena, config, rng=rng, n=size)
        seconds.append((time.process_time() - began_s) * _BATCH / size)
        reached = np.stack(
            [
                greedy_successes_batch(
                    arena,
                    batch.q_by_trial[:, trial],
                    batch.visits_by_trial[:, trial],
                    gamma=config.gamma,
                ).all(axis=1)
                for trial in range(config.trials)
            ],
            axis=1,
        )
        successes += int(reached[:, -1].sum())
        first += [_settled_after(row) for row in reached.tolist()]
        learned += batch.q_by_trial[:, -1].max(axis=-1).sum(axis=0) / seeds
        counts += batch.counts
    optimal = value_iteration(counts, gamma=config.gamma).max(axis=-1)
    return _Study(successes, seeds, first, float(np.abs(learned - optimal).max()), seconds)


def _settled_after(reached: Sequence[bool]) -> int:
    """Return the trial from which on it was reached after each; one past the last if never."""
    lost = [trial for trial, good in enumerate(reached) if not good]
    return 1 if not lost else lost[-1] + 2


def _time_phases(arena: Arena, config: LearningConfig, phases: int, seed: int) -> list[float]:
    import numpy as np

    from goalreach_learning.training import train

    times_ms = []
    for number in range(phases):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        began_s = time.process_time()
        train(arena, config, rng=rng)
        times_ms.append(1e3 * (time.process_time() - began_s))
    return times_ms
