"""The `evaluate` command: a policy driven through images, localizer and state in one process."""

from dataclasses import dataclass
from pathlib import Path

from goalreach_evaluation.choices import arena_option, policy_option
from goalreach_learning.blending import MODES
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import SeededOptions, option

SUMMARY = 'Drive a policy through rendered images, localizer and fuzzy state, without ROS'


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    """Options of the command."""

    policy: str | None = policy_option()
    mode: str = option('fuzzy', 'how the heading is chosen', choices=MODES)
    arena: str = arena_option()
    starts: str = option(
        'paper',
        'start poses: the 22 of the paper, or N drawn over the floor or along the walls',
        metavar='paper|random:N|border:N',
    )
    noise: str = option('nominal', 'sensor errors', metavar='none|nominal|harsh|abroad|FILE')
    jobs: int = option(1, 'processes; the result is the same', minimum=1)
    json: Path | None = option(None, 'write every path and the summary')
    quiet: bool = option(False, 'show errors only')


def execute(options: Options) -> int:
    """Drive all paths; return 0 where every one reached the goal, else 1."""
    from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
    from goalreach_evaluation.terminal import progress_bar, show_paths_table

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
            sim_time_s=tally.total['duration_s'],
            wall_time_s=evaluation.wall_time_s,
        )
    return 0 if tally.goals == tally.paths else 1
