"""Every figure of the paper by its file name, and the animation of a path."""

from __future__ import annotations

from matplotlib.figure import Figure

from goalreach_evaluation.figures.path_animation import Animation, Course, animate
from goalreach_evaluation.figures.policy_figures import (
    blended_paths,
    course_tracks,
    crisp_paths,
    optimal_actions,
    recorded_paths,
)
from goalreach_evaluation.figures.region_figures import (
    membership_functions,
    state_space,
    transition_areas,
)
from goalreach_evaluation.summary_file import RecordedRun
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena


def paper_figures(
    arena: Arena, policy: Policy, run: RecordedRun | None = None, *, origin: str = ''
) -> dict[str, Figure]:
    """Draw figures 1 to 6, and 7 from a recorded run.

    Args:
        arena: The arena that the policy was learned in.
        policy: The policy.
        run: Paths driven with images; without them there is no figure 7.
        origin: Origin of the policy for the captions: a file or a seed.

    Returns:
        The figures by file name without suffix, in the paper's order.
    """
    figures = {
        'figure_1_state_space': state_space(arena),
        'figure_2_optimal_actions': optimal_actions(arena, policy),
        'figure_3_crisp_paths': crisp_paths(arena, policy),
        'figure_4_transition_areas': transition_areas(arena),
        'figure_5_membership_functions': membership_functions(arena),
        'figure_6_fuzzy_paths': blended_paths(arena, policy),
    }
    if origin:
        for name, figure in figures.items():
            if name.startswith(('figure_2', 'figure_3', 'figure_6')):
                figure.supxlabel(f'Policy: {origin}', fontsize=8)
    if run is not None:
        figure = recorded_paths(arena, run.paths, run.mode)
        figure.supxlabel(f'Driven with images, {run.origin}'.rstrip(', '), fontsize=8)
        figures['figure_7_full_chain_paths'] = figure
    return figures


def path_animation(arena: Arena, policy: Policy, run: RecordedRun | None = None) -> Animation:
    """Animate the longest path of a recorded run, or else a fuzzy and a crisp path.

    Args:
        arena: The arena.
        policy: Driven without sensors, fuzzy and crisp, if there is no run.
        run: Paths driven with images.
    """
    if run is not None:
        longest = max(run.paths, key=lambda path: len(path.points_m))
        label = f'{run.mode}, {longest.outcome}'
        courses = [Course(label=label, points_m=longest.points_m)]
        return animate(arena, courses, 'A path with the full sensor chain')
    tracks = course_tracks(arena, policy)
    courses = [Course(label=name, points_m=track.points_m) for name, track in tracks.items()]
    return animate(arena, courses, 'From the same start, fuzzy and crisp (kinematic)')
