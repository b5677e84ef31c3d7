"""The `figures` command: every figure of the paper, from data."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from goalreach_bringup.arena_option import add_arena_option

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from goalreach_learning.policy import Policy
    from goalreach_msgs_py.arena import Arena

__all__ = ['SUMMARY', 'configure', 'execute']

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
    add_arena_option(parser)
    parser.add_argument('--out', type=Path, default=Path('figures'), help='folder for the files')


def execute(options: argparse.Namespace) -> int:
    """Draw and write the figures.

    Raises:
        GoalreachError: A file cannot be read or written.
    """
    from goalreach_bringup.arena_choice import choose_arena, choose_policy
    from goalreach_bringup.figures.figure_file import write_figure

    arena = choose_arena(options.arena)
    if options.policy is None:
        print('no --policy given: learning one')
    policy = choose_policy(options.policy, arena, options.seed)
    for name, figure in _figures(options, arena, policy).items():
        for file in write_figure(figure, options.out, name):
            print(file)
    if options.animate:
        print(_animate(options, arena, policy))
    if options.evaluation is None:
        print('figure 7 (paths with the full sensor chain) needs --evaluation FILE: left out')
    return 0


def _animate(options: argparse.Namespace, arena: Arena, policy: Policy) -> Path:
    from goalreach_bringup.figures.animation_file import write_animation
    from goalreach_bringup.figures.evaluation_file import read_evaluation
    from goalreach_bringup.figures.path_animation import Course, animate
    from goalreach_bringup.figures.policy_figures import course_tracks

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
    from goalreach_bringup.figures import policy_figures, region_figures
    from goalreach_bringup.figures.evaluation_file import read_evaluation

    figures = {
        'figure_1_state_space': region_figures.state_space(arena),
        'figure_2_optimal_actions': policy_figures.optimal_actions(arena, policy),
        'figure_3_crisp_paths': policy_figures.crisp_paths(arena, policy),
        'figure_4_transition_areas': region_figures.transition_areas(arena),
        'figure_5_membership_functions': region_figures.membership_functions(arena),
        'figure_6_fuzzy_paths': policy_figures.blended_paths(arena, policy),
    }
    if options.evaluation is not None:
        evaluation = read_evaluation(options.evaluation)
        figures['figure_7_full_chain_paths'] = policy_figures.recorded_paths(
            arena, evaluation.paths, evaluation.mode
        )
    return figures
