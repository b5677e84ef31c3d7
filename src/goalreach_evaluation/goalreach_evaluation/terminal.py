"""What commands show: progress on stderr, tables on stdout, plain text off a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import sys

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from goalreach_evaluation.path_metrics import PathTally
from goalreach_msgs_py.angles import INCH_M


@contextmanager
def progress_bar(
    label: str, *, total: int, quiet: bool = False
) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on stderr while the context lasts; nothing off a terminal.

    Args:
        label: What is going on.
        total: Steps in all.
        quiet: Whether to show nothing.

    Yields:
        A function that moves the bar on by a number of steps.
    """
    console = Console(stderr=True)
    with Progress(
        TextColumn('{task.description}'),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        redirect_stdout=sys.stdout.isatty(),
        disable=quiet or not console.is_terminal,
    ) as progress:
        task = progress.add_task(label, total=total)
        yield lambda steps: progress.advance(task, steps)


@contextmanager
def at_work(label: str) -> Iterator[None]:
    """Show on stderr that something goes on, and for how long; nothing off a terminal.

    Args:
        label: What goes on. Bars that are shown meanwhile stand below it.
    """
    console = Console(stderr=True)
    with Progress(
        SpinnerColumn(),
        TextColumn('{task.description}'),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        redirect_stdout=sys.stdout.isatty(),
        disable=not console.is_terminal,
    ) as progress:
        progress.add_task(label, total=None)
        yield


def show_paths_table(
    tally: PathTally,
    *,
    mode: str,
    sim_time_s: float,
    wall_time_s: float,
    console: Console | None = None,
) -> None:
    """Show how many paths reached the goal and how they were driven.

    Args:
        tally: Of the paths; nothing is shown where there are none.
        mode: How they were driven.
        sim_time_s: Simulated seconds.
        wall_time_s: Seconds on the wall clock.
        console: Where to show it; stdout if None.
    """
    if not tally.paths:
        return
    out = console or Console(highlight=False)
    table = Table(title=f'{tally.goals} of {tally.paths} paths reached the goal ({mode})')
    table.add_column('per path')
    for heading in ('mean', 'worst'):
        table.add_column(heading, justify='right')
    degrees = math.degrees(1.0)
    rows = (
        ('time to the end', 'duration_s', 1.0, 1, 's'),
        ('length', 'length_m', 1.0, 2, 'm'),
        ('turning', 'turning_rad', degrees, 0, 'deg'),
        ('position error p95', 'pose_error_m', 1 / INCH_M, 2, 'in'),
        ('heading error p95', 'heading_error_rad', degrees, 2, 'deg'),
    )
    for label, name, factor, digits, unit in rows:
        mean, worst = tally.mean(name) * factor, tally.spreads[name].worst * factor
        table.add_row(label, f'{mean:.{digits}f} {unit}', f'{worst:.{digits}f} {unit}')
    out.print(table)
    speed = sim_time_s / max(wall_time_s, 1e-9)
    out.print(
        f'{sim_time_s:.1f} s simulated in {wall_time_s:.1f} s: {speed:.1f} times real time',
        soft_wrap=True,
    )
