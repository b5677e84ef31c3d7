"""What a run prints: log messages, a line per path, and a table at the end."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from goalreach_evaluation.path_metrics import PathResult, PathTally

if TYPE_CHECKING:
    from rich.console import Console

_LOGGER: Final = 'goalreach_bringup'
_LOG: Final = logging.getLogger(__name__)


class RunReport(logging.Handler):
    """Prints one line per event and a table at the end; plain text unless on a terminal.

    As a context manager it prints what the modules of the launcher log: warnings and errors to
    stderr, everything else to stdout.

    Args:
        quiet: Whether to print warnings and errors only.
        total: Number of paths to come, 0 where there is no end.
    """

    def __init__(self, *, quiet: bool, total: int) -> None:
        super().__init__()
        self._quiet = quiet
        self._total = total
        self._done = 0

    def __enter__(self) -> RunReport:  # noqa: PYI034 - Self is newer than 3.10
        logger = logging.getLogger(_LOGGER)
        logger.addHandler(self)
        logger.setLevel(logging.INFO)
        return self

    def __exit__(self, *_: object) -> None:
        logging.getLogger(_LOGGER).removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Print a log message."""
        level = record.levelno
        bad = 'yellow' if level == logging.WARNING else 'bold red'
        style = '' if level < logging.WARNING else bad
        self._print(record.getMessage(), style, stderr=bool(style))

    def path(self, result: PathResult) -> None:
        """Print the result of a path."""
        self._done += 1
        start = result.start
        self._print(
            f'path {self._number:>7}  start {start.x_m:5.2f} m {start.y_m:5.2f} m '
            f'{math.degrees(start.heading_rad):6.1f} deg  '
            f'{result.outcome:<10} {result.duration_s:5.1f} s  {result.length_m:5.2f} m',
            '' if result.outcome == 'goal' else 'bold red',
        )

    def _print(self, line: str, style: str, *, stderr: bool = False) -> None:
        """Print a line; in colour on a terminal where it has a style."""
        if style:
            self._console(stderr=stderr).print(line, markup=False, style=style)
        elif not self._quiet:
            print(line, flush=True)

    def _console(self, *, stderr: bool = False) -> Console:
        from rich.console import Console  # slow to import

        quiet = self._quiet and not stderr
        return Console(stderr=stderr, highlight=False, soft_wrap=True, quiet=quiet)

    def unjudged(self) -> None:
        """Print that a path ended without being judged."""
        self._done += 1
        _LOG.warning('path %7s  its end was not received: not judged', self._number)

    @property
    def _number(self) -> str:
        return f'{self._done}/{self._total}' if self._total else str(self._done)

    def table(self, tally: PathTally, *, mode: str, sim_time_s: float, wall_time_s: float) -> None:
        """Print the table at the end of a run."""
        from goalreach_evaluation.terminal import show_paths_table  # imports rich

        out = self._console()
        show_paths_table(
            tally, mode=mode, sim_time_s=sim_time_s, wall_time_s=wall_time_s, console=out
        )
