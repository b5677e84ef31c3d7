"""What a run shows on the screen."""

from __future__ import annotations

import math

from rich.console import Console

from goalreach_evaluation.path_metrics import PathResult, PathTally
from goalreach_evaluation.terminal import show_paths_table


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
        start = result.start
        self._out.print(
            f'path {self._number:>7}  start {start.x_m:5.2f} m {start.y_m:5.2f} m '
            f'{math.degrees(start.heading_rad):6.1f} deg  '
            f'{result.outcome:<10} {result.duration_s:5.1f} s  {result.length_m:5.2f} m',
            markup=False,
            style=None if result.outcome == 'goal' else 'bold red',
        )

    def unheard(self) -> None:
        """Show that a path ended without being judged."""
        self._done += 1
        self.warn(f'path {self._number:>7}  its end was not heard: not judged')

    @property
    def _number(self) -> str:
        return f'{self._done}/{self._total}' if self._total else str(self._done)

    def table(self, tally: PathTally, *, mode: str, sim_time_s: float, wall_time_s: float) -> None:
        """Show the table at the end of a run."""
        show_paths_table(
            tally,
            mode=mode,
            sim_time_s=sim_time_s,
            wall_time_s=wall_time_s,
            console=self._out,
        )
