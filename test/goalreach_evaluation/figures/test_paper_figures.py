from dataclasses import replace
import math
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np
import pytest

from goalreach_evaluation.figures.figure_file import write_figure
from goalreach_evaluation.figures.paper_figures import (
    blended_paths,
    crisp_paths,
    membership_functions,
    optimal_actions,
    path_figure,
    state_space,
    transition_areas,
)
from goalreach_learning.policy import Policy
from goalreach_learning.training import train
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.regions import RegionMap

ARENA = Arena()


@pytest.fixture(scope='module')
def policy() -> Policy:
    return train(ARENA, rng=np.random.default_rng(0)).policy


def texts(figure: Figure) -> list[str]:
    axes = figure.axes[0]
    legend = axes.get_legend()
    in_legend = [] if legend is None else legend.get_texts()
    return [text.get_text() for text in [*axes.texts, *in_legend]]


def test_state_space_names_nine_regions_and_the_goal() -> None:
    found = [text for text in texts(state_space(ARENA)) if '\n' in text]
    assert len(found) == 9
    assert 'FRONT\nNEAR\ngoal' in found
    assert 'LEFT-SIDE\nFAR' in found


def test_axes_are_in_inches_with_metres_beside() -> None:
    axes = state_space(ARENA).axes[0]
    assert axes.get_xlabel() == 'x (in)'
    assert axes.get_xlim()[1] == pytest.approx(140, abs=5)
    assert axes.get_ylim()[1] == pytest.approx(200, abs=5)
    metres = [(child.get_xlabel(), child.get_ylabel()) for child in axes.child_axes]
    assert metres == [('x (m)', ''), ('', 'y (m)')]


def test_optimal_actions_are_written_in_degrees(policy: Policy) -> None:
    found = texts(optimal_actions(ARENA, policy))
    assert sum(text.endswith('°') for text in found) == 8
    assert 'goal' in found
    unknown = texts(optimal_actions(ARENA, Policy.unlearned(ARENA.regions)))
    assert unknown.count('not learned') == 8


@pytest.mark.parametrize('draw', [crisp_paths, blended_paths])
def test_paths_from_all_22_starts(draw: object, policy: Policy) -> None:
    assert callable(draw)
    assert 'goal reached: 22 of 22' in texts(draw(ARENA, policy))


def test_driven_paths_mark_failures() -> None:
    line = np.array([[1.0, 2.0], [1.2, 2.2]])
    paths = [(line, outcome) for outcome in ('goal', 'false-goal')]
    found = texts(path_figure(ARENA, paths, 'fuzzy'))
    assert 'goal reached: 1 of 2' in found
    assert 'goal not reached' in found


def test_a_forbidden_region_is_named_so() -> None:
    regions = replace(ARENA.regions, forbidden=((0, 2),))
    found = texts(optimal_actions(ARENA, Policy.unlearned(regions)))
    assert (found.count('forbidden'), found.count('not learned')) == (1, 7)


def test_obstacles_are_drawn_and_the_straight_paths_say_that_they_ignore_them(
    policy: Policy,
) -> None:
    post = Obstacle(x_m=1.0, y_m=2.0, radius_m=0.2)
    box = Obstacle(x_m=2.0, y_m=2.5, length_m=0.8, width_m=0.2, heading_rad=0.3, height_m=0.8)
    arena = replace(ARENA, obstacles=(post, box))
    crisp, blended = crisp_paths(arena, policy), blended_paths(arena, policy)
    for figure in (crisp, blended):
        assert 'obstacle' in texts(figure)
        axes = figure.axes[0]
        there = axes.patches[-2:]
        for obstacle, patch in zip((post, box), there, strict=True):
            for turn in np.linspace(0.1, 6.2, 12):
                for reach_m in (0.08, 0.15, 0.3):
                    x_m = obstacle.x_m + reach_m * math.cos(turn)
                    y_m = obstacle.y_m + reach_m * math.sin(turn)
                    depth_m = -obstacle.contact(x_m, y_m)[0]
                    x_px, y_px = axes.transData.transform((x_m / INCH_M, y_m / INCH_M))
                    inside = patch.contains_point((x_px, y_px), radius=0.0)
                    assert abs(depth_m) < 1e-3 or inside == (depth_m > 0.0)
    titles = [figure.axes[0].get_title() for figure in (crisp, blended)]
    assert ['obstacles ignored' in title for title in titles] == [True, False]


def test_transition_areas_are_named() -> None:
    assert 'transition area' in texts(transition_areas(ARENA))


def test_membership_functions_cross_at_the_middle_of_a_transition() -> None:
    upper = membership_functions(ARENA).axes[0]
    left, front = upper.lines[0], upper.lines[1]
    border_in = (36.5 + 56.5) / 2
    at_border = [
        float(np.interp(border_in, np.array(line.get_xdata()), np.array(line.get_ydata())))
        for line in (left, front)
    ]
    assert at_border == pytest.approx([0.5, 0.5], abs=1e-3)
    ticks = [label.get_text() for label in upper.get_xticklabels()]
    assert ticks[1] == '$x_1$\n36.5'


def test_same_figure_same_bytes(tmp_path: Path) -> None:
    for name in ('a', 'b'):
        write_figure(state_space(ARENA), tmp_path, name)
    for ending in ('svg', 'png'):
        assert (tmp_path / f'a.{ending}').read_bytes() == (tmp_path / f'b.{ending}').read_bytes()


def test_refuses_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(FileFormatError, match='cannot be made'):
        write_figure(state_space(ARENA), tmp_path / 'file', 'a')


@pytest.mark.parametrize('side', [1, 2, 4])
def test_figures_of_other_numbers_of_regions(side: int) -> None:
    steps = np.arange(1, side)
    knots = [
        (0.0, *np.stack([steps - 0.1, steps + 0.1], axis=1).reshape(-1).tolist(), float(side))
        for _ in 'xy'
    ]
    regions = RegionMap(x_knots_m=knots[0], y_knots_m=knots[1], goal=(0, 0))
    arena = Arena(
        width_m=float(side),
        length_m=float(side),
        landmarks_m=tuple((0.1 * side * k, 0.0, 1.4) for k in (2, 5, 8)),
        regions=regions,
        starts=(),
    )
    assert len(transition_areas(arena).axes[0].patches) >= 2 * (side - 1)
    assert state_space(arena).axes[0].get_title() == f'State space: {side**2} regions'
