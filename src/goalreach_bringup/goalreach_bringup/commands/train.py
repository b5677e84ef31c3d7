"""The `train` command: the paper's learning phase in one process."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import time
from typing import Any

import numpy as np

from goalreach_evaluation.choices import arena_option, choose_arena, learner_option
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import TrainingResult, train
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import SeededOptions, option

SUMMARY = "Learn a policy by the paper's procedure, in one process, and write it to a file"

_BAR = 22
_WORTH_A_BAR = 500
"""So many trials take a quarter of a second."""


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    """Options of the command."""

    trials: int = option(20, 'trials, each one path from every start')
    arena: str = arena_option()
    learner: str = learner_option()
    out: Path = option(Path('policy.json'), 'policy file to write')
    json: Path | None = option(None, 'write trials, seconds and success by trial')
    quiet: bool = option(False, 'show errors only')


def execute(options: Options) -> int:
    """Learn, show what was learned, and write it."""
    from goalreach_evaluation.summary_file import write_summary
    from goalreach_evaluation.terminal import progress_bar

    for file in filter(None, (options.out, options.json)):
        require_writable(file)
    arena = choose_arena(options.arena)
    config = LearningConfig(trials=options.trials)
    rng = np.random.default_rng(options.seed)
    long = config.trials >= _WORTH_A_BAR
    began_s = time.perf_counter()
    with progress_bar('learning', total=config.trials, quiet=options.quiet or not long) as advance:
        result = train(
            arena,
            config,
            rng=rng,
            on_trial=(lambda *_: advance(1)) if long else None,
            agent=Agent(options.learner, arena.regions, config, rng),
        )
    seconds = time.perf_counter() - began_s
    policy = replace(result.policy, learning={**result.policy.learning, 'seed': options.seed})
    greedy = greedy_successes(arena, policy)
    write_policy(options.out, policy)
    if not options.quiet:
        _show(result, policy, greedy, seconds, paths=config.trials * len(arena.starts))
        print(f'policy written to {options.out}')
    if options.json is not None:
        write_summary(options.json, _report(options, result, greedy, seconds))
    return 0


def _report(
    options: Options, result: TrainingResult, greedy: Sequence[bool], seconds: float
) -> dict[str, Any]:
    return {
        'seed': options.seed,
        'arena': options.arena,
        'learner': options.learner,
        'trials': options.trials,
        'seconds': seconds,
        'success_by_trial': list(result.success_by_trial),
        'actions_taken': result.options,
        'greedy_success': list(greedy),
        'policy': str(options.out),
        'learning': dict(result.policy.learning),
    }


def _show(
    result: TrainingResult, policy: Policy, greedy: Sequence[bool], seconds: float, *, paths: int
) -> None:
    print(f'{paths} paths, {result.options} actions, {seconds * 1e3:.1f} ms')
    print('\npaths that reached the goal while learning, by trial')
    for trial, share in enumerate(result.success_by_trial, start=1):
        print(f'  {trial:3d}  {100 * share:5.1f} %  {"#" * round(_BAR * share)}')
    print('\nheading learned in each region, degrees (the goal wall is below)')
    print(_action_table(policy))
    print(f'\nthe best actions lead to the goal from {sum(greedy)} of {len(greedy)} starts')


def _action_table(policy: Policy) -> str:
    columns, rows = policy.regions.labels
    lines = [' ' * 8 + ''.join(f'{label:>12}' for label in columns)]
    for j, row in reversed(list(enumerate(rows))):
        cells = []
        for i in range(len(columns)):
            action = policy.greedy_action((i, j))
            unknown = 'goal' if (i, j) == policy.regions.goal else '-'
            heading = f'{360.0 / policy.regions.actions * (action or 0):g}'
            cells.append(unknown if action is None else heading)
        lines.append(f'  {row:<6}' + ''.join(f'{cell:>12}' for cell in cells))
    return '\n'.join(lines)
