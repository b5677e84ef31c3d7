"""The `figures` command: every figure of the paper, from data."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from goalreach_evaluation.choices import add_arena_option

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from goalreach_evaluation.figures.evaluation_file import Evaluation
    from goalreach_learning.policy import Policy
    from goalreach_msgs_py.arena import Arena


SUMMARY = 'Draw every figure of the paper from a policy and an evaluation, as SVG and PNG'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        '--policy', type=Path, default=None, help='policy file; without it, learns one'
    )
    parser.add_argument(
        '--evaluation',
        type=Path,
        default=None,
        help='file of `evaluate --json` or `run --summary`, for the paths with all sensors',
    )
    parser.add_argument(
        '--animate',
        action='store_true',
        help='also draw a path as a short GIF: of the evaluation, or of the policy alone',
    )
    parser.add_argument(
        '--drive',
        action='store_true',
        help='without --evaluation: drive from every start through rendered images first',
    )
    parser.add_argument('--format', choices=('svg', 'png', 'both'), default='both')
    add_arena_option(parser)
    parser.add_argument('--out', type=Path, default=Path('figures'), help='folder for the files')


def execute(options: argparse.Namespace) -> int:
    """Draw and write the figures.

    Raises:
        GoalreachError: A file cannot be read or written.
    """
    from goalreach_evaluation.choices import choose_arena, choose_policy
    from goalreach_evaluation.figures.figure_file import write_figure

    arena = choose_arena(options.arena)
    if options.policy is None:
        print('no --policy given: learning one')
    policy = choose_policy(options.policy, arena, options.seed)
    endings = ('svg', 'png') if options.format == 'both' else (options.format,)
    for name, figure in _figures(options, arena, policy).items():
        for file in write_figure(figure, options.out, name, endings):
            print(file)
    if options.animate:
        print(_animate(options, arena, policy))
    if options.evaluation is None and not options.drive:
        print('figure 7 (paths with all sensors) needs --evaluation FILE or --drive: left out')
    return 0


def _animate(options: argparse.Namespace, arena: Arena, policy: Policy) -> Path:
    from goalreach_evaluation.figures.evaluation_file import read_evaluation
    from goalreach_evaluation.figures.figure_file import write_animation
    from goalreach_evaluation.figures.path_animation import Course, animate
    from goalreach_evaluation.figures.policy_figures import course_tracks

    if options.evaluation is not None:
        evaluation = read_evaluation(options.evaluation)
        longest = max(evaluation.paths, key=lambda path: len(path.points_m))
        label = f'{evaluation.mode}, {longest.outcome}'
        courses = [Course(label=label, points_m=longest.points_m)]
        title = 'A path with the full sensor chain'
    else:
        tracks = course_tracks(arena, policy)
        courses = [Course(label=name, points_m=track.points_m) for name, track in tracks.items()]
        title = 'From the same start, fuzzy and crisp (kinematic)'
    return write_animation(animate(arena, courses, title), options.out, 'path')


def _figures(options: argparse.Namespace, arena: Arena, policy: Policy) -> dict[str, Figure]:
    from goalreach_evaluation.figures import policy_figures, region_figures

    learned = options.policy.name if options.policy else f'learned with seed {options.seed}'
    figures = {
        'figure_1_state_space': region_figures.state_space(arena),
        'figure_2_optimal_actions': policy_figures.optimal_actions(arena, policy),
        'figure_3_crisp_paths': policy_figures.crisp_paths(arena, policy),
        'figure_4_transition_areas': region_figures.transition_areas(arena),
        'figure_5_membership_functions': region_figures.membership_functions(arena),
        'figure_6_fuzzy_paths': policy_figures.blended_paths(arena, policy),
    }
    for number in (1, 2, 5):
        _caption(list(figures.values())[number], f'Policy: {learned}')
    evaluation = _evaluation(options, arena, policy)
    if evaluation is not None:
        figure = policy_figures.recorded_paths(arena, evaluation.paths, evaluation.mode)
        _caption(figure, f'Driven with images, {evaluation.origin}'.rstrip(', '))
        figures['figure_7_full_chain_paths'] = figure
    return figures


def _caption(figure: Figure, text: str) -> None:
    figure.supxlabel(text, fontsize=8)


def _evaluation(options: argparse.Namespace, arena: Arena, policy: Policy) -> Evaluation | None:
    """Return the paths of the file, or those driven now, or None."""
    import numpy as np

    from goalreach_evaluation.figures.evaluation_file import (
        Evaluation,
        RecordedPath,
        read_evaluation,
    )
    from goalreach_evaluation.sessions import EvaluationPlan, evaluate
    from goalreach_evaluation.starts import RunSeeds
    from goalreach_learning.controller_config import ControllerConfig
    from goalreach_msgs_py.noise import noise_preset

    if options.evaluation is not None:
        return read_evaluation(options.evaluation)
    if not options.drive:
        return None
    plan = EvaluationPlan(
        arena=arena,
        noise=noise_preset('nominal'),
        policy=policy,
        controller=ControllerConfig(),
        starts=arena.starts,
        seed=RunSeeds.spawn(options.seed).simulator,
    )
    paths = [path for session in evaluate(plan) for path in session.paths]
    return Evaluation(
        mode=plan.controller.mode,
        paths=tuple(
            RecordedPath(points_m=np.array(path.trace), outcome=path.outcome) for path in paths
        ),
        origin=f'nominal noise, seed {options.seed}',
    )
