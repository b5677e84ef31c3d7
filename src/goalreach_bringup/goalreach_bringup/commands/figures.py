"""The `figures` command: every figure of the paper, from data."""

from dataclasses import dataclass
from pathlib import Path

from goalreach_evaluation.choices import arena_option, choose_arena, choose_policy, policy_option
from goalreach_msgs_py.options import SeededOptions, option

SUMMARY = 'Draw every figure of the paper from a policy and an evaluation, as SVG and PNG'


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    """Options of the command."""

    policy: str | None = policy_option()
    evaluation: Path | None = option(
        None, 'file of `evaluate --json` or `run --summary`, for the paths with all sensors'
    )
    drive: bool = option(
        False, 'without --evaluation: drive from every start through rendered images first'
    )
    format: str = option('both', 'format of the files', choices=('svg', 'png', 'both'))
    arena: str = arena_option()
    out: Path = option(Path('figures'), 'folder for the files', metavar='DIR')


def execute(options: Options) -> int:
    """Draw and write the figures."""
    from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
    from goalreach_evaluation.figures.figure_file import write_figure
    from goalreach_evaluation.figures.paper_figures import paper_figures
    from goalreach_evaluation.summary_file import read_recorded_run, recorded_run

    arena = choose_arena(options.arena)
    if options.policy is None:
        print('no --policy given: learning one')
    policy = choose_policy(options.policy, arena, options.seed)
    driven = None
    if options.evaluation is not None:
        driven = read_recorded_run(options.evaluation)
    elif options.drive:
        request = EvaluationRequest(policy=policy, arena=options.arena, seed=options.seed)
        driven = recorded_run(evaluate(request).to_json())
    origin = Path(options.policy).name if options.policy else f'learned with seed {options.seed}'
    endings = ('svg', 'png') if options.format == 'both' else (options.format,)
    for name, figure in paper_figures(arena, policy, driven, origin=origin).items():
        for file in write_figure(figure, options.out, name, endings):
            print(file)
    if driven is None:
        print('figure 7 (paths with all sensors) needs --evaluation FILE or --drive: left out')
    return 0
