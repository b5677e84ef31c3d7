"""The learning study: success, trials needed and values of Q-learning over many seeds."""

from collections.abc import Sequence
import functools
import statistics
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent, LearnerSetup
from goalreach_learning.learners.tabular import PaperLearner
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import Rewards
from goalreach_msgs_py.values import FloatArray, Region

SUCCESS: Final = 'greedy policy reaches the goal from all 22 starts'
SETTLED: Final = 'trial after which it always does, median'
VALUES: Final = 'largest difference of the mean values of the regions from value iteration'
GOAL_END, BUMP_END = 9, 10
_REWARDS = Rewards()
_REGIONS = 9
_COUNTS = (3, 3, 8, 11)
_BATCH = 500
# Chosen, not from the paper: each free parameter well to either side of its default.
_VARIATIONS: tuple[dict[str, float], ...] = (
    {}, {'alpha': 0.1}, {'alpha': 0.8}, {'gamma': 0.5}, {'gamma': 0.95},
    {'temperature_start': 0.3}, {'temperature_end': 0.05},
    {'temperature_start': 0.1, 'temperature_end': 0.1},
    {'temperature_start': 1.0, 'temperature_end': 1.0},
    {'start_jitter_m': 0.0, 'overshoot_m': 0.0},
)  # fmt: skip
"""Changes of the configuration; the first is the default."""


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
    """Return the results of a batch of seeds.

    Returns:
        'first_trials': for each seed the trial after which its greedy policy always reached the
        goal from all starts; 'successes': number of seeds whose last policy does; 'values': sum
        over the seeds of the best value of each region; 'counts': number of transitions.
    """
    arena, config = Arena(), _config(case['variation'])
    reached, values, counts = [], np.zeros((3, 3)), np.zeros(_COUNTS, dtype=np.int64)
    for number in range(case['seeds']):
        sequence = np.random.SeedSequence(seed, spawn_key=(case['batch'], number))
        policies, transitions = _learn_phase(config, np.random.default_rng(sequence))
        reached.append([all(greedy_successes(arena, policy)) for policy in policies])
        values += policies[-1].q.max(axis=-1)
        counts += transitions
    return {
        'first_trials': [settled_after(row) for row in reached],
        'successes': sum(row[-1] for row in reached),
        'values': values.tolist(),
        'counts': counts.tolist(),
    }


def _learn_phase(
    config: LearningConfig, rng: np.random.Generator
) -> tuple[list[Policy], NDArray[np.int64]]:
    """Return the policies after each trial of a learning phase, and the transition counts."""
    arena = Arena()
    policies: list[Policy] = []
    agent = Agent(f'{__name__}:CountingLearner', arena.regions, config, rng)
    train(arena, config, rng=rng, on_trial=lambda _, p: policies.append(p), agent=agent)
    return policies, cast(CountingLearner, agent.learner).counts


class CountingLearner(PaperLearner):
    """A learner that counts transitions, see `value_iteration`."""

    def __init__(self, setup: LearnerSetup) -> None:
        super().__init__(setup)
        self.counts = np.zeros(_COUNTS, dtype=np.int64)

    def learn(
        self, state: Region, action: int, reward: float, next_state: Region, *, terminal: bool
    ) -> None:
        """Count the transition and learn from it."""
        end = 3 * next_state[0] + next_state[1]
        if terminal:
            end = GOAL_END if reward == _REWARDS.goal else BUMP_END
        self.counts[state[0], state[1], action, end] += 1
        super().learn(state, action, reward, next_state, terminal=terminal)


def value_iteration(
    counts: NDArray[np.int64], *, gamma: float, tolerance: float = 1e-12
) -> FloatArray:
    """Return the optimal Q-values of the decision process with given transition frequencies.

    The nine regions are not a Markov state: the end of an action depends on where in the region
    it began. The frequencies average over that, as the learner does.

    Args:
        counts: Number of transitions, (3, 3, 8, 11), by region, action and end: a region
            3 * i + j, `GOAL_END` or `BUMP_END`.
        gamma: Discount factor, below 1.
        tolerance: Largest change of a value in the last iteration.

    Returns:
        (3, 3, 8); zero where an action was never tried.
    """
    total = counts.sum(axis=-1, keepdims=True)
    share = counts / np.maximum(total, 1)
    reward = _REWARDS.goal * share[..., GOAL_END] + _REWARDS.bump * share[..., BUMP_END]
    tried = total[..., 0] > 0
    q = np.zeros(reward.shape)
    while True:
        best = np.where(tried, q, -np.inf).max(axis=-1)
        values = np.where(np.isfinite(best), best, 0.0).reshape(_REGIONS)
        update = reward + gamma * (share[..., :_REGIONS] @ values)
        if np.abs(update - q).max() <= tolerance:
            return np.asarray(update)
        q = update


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
    least = None if one['name'] else 99.9
    note = f'; always after trial {statistics.median(one["first_trials"]):.0f} (median)'
    count, n = one['successes'], one['seeds']
    return BenchRow.share(name, count, n, unit='% of seeds', least=least, note=note)
