"""The figures of docs/LEARNERS.md."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from goalreach_evaluation.figures.arena_axes import BLUE, GREEN, GREY, ORANGE, VERMILION
from goalreach_evaluation.figures.figure_file import write_figure
from goalreach_lab.learners.curves import NO_IMAGES, Group, needed
from goalreach_lab.learners.sitting import course
from goalreach_lab.study import Result

_STYLES = ((GREEN, '-'), (BLUE, '--'), (VERMILION, '-.'), (ORANGE, ':'), (GREY, '-'))
_GRID = '#dddddd'


def draw(
    folder: Path, found: Mapping[Group, Sequence[Result]], sittings: Sequence[Result]
) -> None:
    """Write the figures of what was measured: performance profiles, and the sittings."""
    if found:
        write_figure(_profiles(found), folder, 'learners_profiles')
    if sittings:
        write_figure(_sittings(sittings), folder, 'learners_sitting')


def _profiles(found: Mapping[Group, Sequence[Result]]) -> Figure:
    """Return the share of runs that needed at most so many paths, and so many bumps."""
    figure = Figure(figsize=(8.0, 3.6), layout='constrained')
    chosen = [(key[0], results) for key, results in found.items() if key[2] == NO_IMAGES]
    for axes, field in zip(figure.subplots(1, 2), ('paths', 'bumps'), strict=True):
        for (learner, results), (color, line) in zip(chosen, _STYLES, strict=False):
            values = np.sort(needed(results, field))
            shares = 100.0 * np.arange(1, len(values) + 1) / len(values)
            name, finite = learner.rpartition(':')[2], np.isfinite(values)
            axes.step(values[finite], shares[finite], line, where='post', color=color, label=name)
        axes.set_xscale('symlog', linthresh=1.0)  # some runs need no bump
        axes.set(
            xlabel=f'{field} until all starts lead to the goal', ylabel='runs, %', xlim=(0, None)
        )
        axes.grid(color=_GRID)
    axes.legend(fontsize=8)
    figure.suptitle(f'Arena of the paper, {NO_IMAGES}', fontsize=11)
    return figure


def _sittings(sittings: Sequence[Result]) -> Figure:
    """Return over minutes how many starts lead to the goal; bumps in a row below for each."""
    figure = Figure(figsize=(7.0, 3.6), layout='constrained')
    axes = figure.add_subplot()
    for one, (color, line) in zip(sittings, _STYLES, strict=False):
        minutes, bumps, leads = zip((0.0, 0, 0), *course(one), strict=True)
        number, marks = one['number'] + 1, np.flatnonzero(np.diff(bumps)) + 1
        axes.step(minutes, leads, line, where='post', color=color, label=f'session {number}')
        axes.plot(np.array(minutes)[marks], [-1.3 * number] * len(marks), 'x', color=color)
    axes.set(xlabel='minutes of driving; x: a bump', ylabel='starts that lead to the goal')
    axes.set_yticks(range(0, 23, 2))
    axes.grid(color=_GRID)
    axes.legend(fontsize=8)
    return figure
