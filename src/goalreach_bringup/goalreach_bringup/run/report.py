"""What a run shows on the screen."""

from __future__ import annotations

from collections.abc import Sequence
import math

from rich.console import Console
from rich.table import Table

from goalreach_bringup.path_metrics import PathResult
from goalreach_msgs_py.units import INCH_M

__all__ = ['RunReport']


class RunReport:
    """One line per event while it runs, a table at the end; plain text off a terminal.

    Args:
        quiet: Whether to show errors only.
        total: Number of paths to come, 0 where there is no end.
    """

    def __init__(self, *, quiet: bool, total: int) -> None:
        """Take the terminal as it is."""
        self._out = Console(highlight=False, soft_wrap=True, quiet=quiet)
        self._err = Console(highlight=False, soft_wrap=True, stderr=True)
        self._total = total
        self._done = 0

    def say(self, line: str) -> None:
        """Show one line of progress."""
        self._out.print(line, markup=False)

    def warn(self, line: str) -> None:
        """Show one line of trouble, quiet or not, on stderr."""
        self._err.print(line, markup=False, style='bold red' if 'error' in line else 'yellow')

    def path(self, result: PathResult) -> None:
        """Show one finished path."""
        self._done += 1
        number = f'{self._done}/{self._total}' if self._total else str(self._done)
        start = result.start
        self._out.print(
            f'path {number:>7}  start {start.x_m:5.2f} m {start.y_m:5.2f} m '
            f'{math.degrees(start.heading_rad):6.1f} deg  '
            f'{result.outcome:<10} {result.duration_s:5.1f} s  {result.length_m:5.2f} m',
            markup=False,
            style=None if result.outcome == 'goal' else 'bold red',
        )

    def table(
        self, results: Sequence[PathResult], *, mode: str, sim_time_s: float, wall_time_s: float
    ) -> None:
        """Show the table at the end of a run."""
        goals = sum(result.outcome == 'goal' for result in results)
        table = Table(title=f'{goals} of {len(results)} paths reached the goal ({mode})')
        table.add_column('per path')
        for heading in ('mean', 'worst'):
            table.add_column(heading, justify='right')
        rows: tuple[tuple[str, list[float], float, int, str], ...] = (
            ('time to the end', [r.duration_s for r in results], 1.0, 1, 's'),
            ('length', [r.length_m for r in results], 1.0, 2, 'm'),
            ('turning', [r.turning_rad for r in results], math.degrees(1), 0, 'deg'),
            ('position error p95', [r.pose_error_m['p95'] for r in results], 1 / INCH_M, 2, 'in'),
            (
                'heading error p95',
                [r.heading_error_rad['p95'] for r in results],
                math.degrees(1),
                2,
                'deg',
            ),
        )
        for name, values, factor, digits, unit in rows:
            mean, worst = sum(values) / len(values) * factor, max(values) * factor
            table.add_row(name, f'{mean:.{digits}f} {unit}', f'{worst:.{digits}f} {unit}')
        self._out.print(table)
        self.say(
            f'{sim_time_s:.1f} s simulated in {wall_time_s:.1f} s: '
            f'{sim_time_s / wall_time_s:.1f} times real time'
        )
