"""The `evaluate` command: a policy driven through images, localizer and state in one process."""

from __future__ import annotations

import argparse
from pathlib import Path

from goalreach_bringup.launch.options import MODES
from goalreach_evaluation.choices import add_arena_option

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
    from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
    from goalreach_evaluation.terminal import progress_bar, show_paths_table
    from goalreach_msgs_py.files import require_writable

    if options.json:
        require_writable(options.json)
    request = EvaluationRequest(
        policy=options.policy,
        arena=options.arena,
        starts=options.starts,
        noise=options.noise,
        mode=options.mode,
        seed=options.seed,
    )
    paths = len(request.plan.starts)
    with progress_bar('driving', total=paths, quiet=options.quiet) as advance:
        evaluation = evaluate(request, jobs=options.jobs, progress=advance)
    if options.json:
        evaluation.write(options.json)
    tally = evaluation.tally
    if not options.quiet:
        show_paths_table(
            tally,
            mode=options.mode,
            sim_time_s=tally.spreads['duration_s'].total,
            wall_time_s=evaluation.wall_time_s,
        )
    return 0 if tally.goals == tally.paths else 1
