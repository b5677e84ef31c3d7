"""Terminal output of commands: progress on stderr, tables on stdout, plain text in a pipe."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import sys

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column, Table

from goalreach_evaluation.path_metrics import PathTally
from goalreach_msgs_py.angles import INCH_M


@contextmanager
def progress_bar(
    label: str, *, total: int, quiet: bool = False
) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on stderr within the context, unless quiet or stderr is no terminal.

    Yields:
        A function that advances the bar by a number of steps.
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


def show_paths_table(
    tally: PathTally, *, mode: str, sim_time_s: float, wall_time_s: float
) -> None:
    """Print success rate, measures and speed of many paths; nothing without a path."""
    if not tally.paths:
        return
    numbers = (Column(heading, justify='right') for heading in ('mean', 'worst'))
    table = Table('per path', *numbers, title=f'{_count_ends(tally)} ({mode})')
    degrees = math.degrees(1.0)
    rows = (
        ('time to the end', 'duration_s', 1.0, 1, 's'),
        ('length', 'length_m', 1.0, 2, 'm'),
        ('turning', 'turning_rad', degrees, 0, 'deg'),
        ('position error p95', 'pose_error_m', 1 / INCH_M, 2, 'in'),
        ('heading error p95', 'heading_error_rad', degrees, 2, 'deg'),
    )
    for label, name, factor, digits, unit in rows[: None if tally.judged else 3]:
        mean, worst = tally.mean(name) * factor, tally.worst[name] * factor
        table.add_row(label, f'{mean:.{digits}f} {unit}', f'{worst:.{digits}f} {unit}')
    console = Console(highlight=False, soft_wrap=True)
    console.print(table)
    speed = sim_time_s / max(wall_time_s, 1e-9)
    line = f'{sim_time_s:.1f} s simulated in {wall_time_s:.1f} s: {speed:.1f} times real time'
    console.print(line)


def _count_ends(tally: PathTally) -> str:
    if tally.declared:
        return f'{tally.declared} of {tally.paths} paths declared in the goal, unjudged'
    return f'{tally.goals} of {tally.paths} paths reached the goal'
