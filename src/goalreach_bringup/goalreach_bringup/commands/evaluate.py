"""The `evaluate` command: a policy driven through images, localizer and state in one process."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import time
from typing import TYPE_CHECKING

from goalreach_bringup.launch.options import MODES
from goalreach_evaluation.choices import add_arena_option
from goalreach_msgs_py.errors import ConfigurationError

if TYPE_CHECKING:
    from goalreach_evaluation.sessions import EvaluationPlan, SessionResult


SUMMARY = 'Drive a policy through rendered images, localizer and fuzzy state, without ROS'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add(
        '--policy', type=Path, metavar='FILE', help='policy to drive; without it, learns one first'
    )
    add('--mode', choices=MODES, default='fuzzy', help='how the heading is chosen')
    add_arena_option(parser)
    add(
        '--starts',
        default='paper',
        metavar='paper|random:N|border:N',
        help='where the paths begin: the 22 of the paper, or N drawn over the floor or the walls',
    )
    add('--noise', default='nominal', metavar='none|nominal|harsh|FILE', help='sensor errors')
    add('--jobs', type=int, default=1, metavar='N', help='processes; the result is the same')
    add('--json', type=Path, metavar='FILE', help='write every path and the summary')
    add('--quiet', action='store_true', help='show errors only')


def execute(options: argparse.Namespace) -> int:
    """Drive all paths; return 0 where every one reached the goal, else 1.

    Raises:
        GoalreachError: An option or a file is refused.
    """
    from goalreach_evaluation.path_metrics import PathTally
    from goalreach_evaluation.sessions import evaluate
    from goalreach_evaluation.summary_file import summarise, write_summary
    from goalreach_evaluation.terminal import progress_bar, show_paths_table
    from goalreach_msgs_py.files import require_writable

    if options.json:
        require_writable(options.json)
    plan = _plan(options)
    began_s = time.perf_counter()
    with progress_bar('driving', total=len(plan.starts), quiet=options.quiet) as advance:
        sessions = evaluate(plan, jobs=options.jobs, progress=advance)
    wall_time_s = time.perf_counter() - began_s
    paths = [path for session in sessions for path in session.paths]
    tally = PathTally.of(paths)
    sim_time_s = tally.spreads['duration_s'].total
    if options.json:
        summary = summarise(
            paths,
            seed=options.seed,
            mode=options.mode,
            policy=str(options.policy or 'learned'),
            sim_time_s=sim_time_s,
            wall_time_s=wall_time_s,
            config=_config(options, sessions),
        )
        write_summary(options.json, summary)
    if not options.quiet:
        show_paths_table(tally, mode=options.mode, sim_time_s=sim_time_s, wall_time_s=wall_time_s)
    return 0 if tally.goals == tally.paths else 1


def _plan(options: argparse.Namespace) -> EvaluationPlan:
    from goalreach_evaluation.choices import choose_arena, choose_noise, choose_policy
    from goalreach_evaluation.sessions import EvaluationPlan
    from goalreach_evaluation.starts import RunSeeds, starts_of
    from goalreach_learning.controller_config import ControllerConfig

    if options.seed < 0:
        raise ConfigurationError('--seed', options.seed, 'a whole number >= 0')
    if options.jobs < 1:
        raise ConfigurationError('--jobs', options.jobs, 'a whole number >= 1')
    arena = choose_arena(options.arena)
    seeds = RunSeeds.spawn(options.seed)
    return EvaluationPlan(
        arena=arena,
        noise=choose_noise(options.noise),
        policy=choose_policy(options.policy, arena, seeds.training),
        controller=ControllerConfig(mode=options.mode),
        starts=starts_of(options.starts, arena, seeds.starts),
        seed=seeds.simulator,
    )


def _config(options: argparse.Namespace, sessions: Sequence[SessionResult]) -> dict[str, object]:
    return {
        'arena': options.arena,
        'noise': options.noise,
        'starts': options.starts,
        'frames': sum(session.frames for session in sessions),
    }
