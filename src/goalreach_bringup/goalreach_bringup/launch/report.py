"""Output of a run on the terminal and on its page, and requests from the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
import logging
import math
from pathlib import Path
import sys
from typing import Final

from goalreach_bringup.launch.auxiliary_processes import PageProcess, RecorderProcess
from goalreach_bringup.launch.options import RunOptions, parse_start
from goalreach_bringup.launch.plan import choose_starts
from goalreach_evaluation.choices import arena_names, choose_arena, choose_policy
from goalreach_evaluation.path_metrics import PathResult, PathTally
from goalreach_learning.policy_file import policy_names
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.ros.process import StopRequest

_LOGGER: Final = 'goalreach_bringup'
_LOG: Final = logging.getLogger(__name__)
_LEARNED: Final = 'learned'
_BAD: Final = 'bold red'
_STYLES: Final = {logging.WARNING: 'yellow', logging.ERROR: _BAD}


class RunReport(logging.Handler):
    """Prints one line per event and a table at the end; plain text unless on a terminal.

    As a context manager it prints what the modules of the launcher log: warnings and errors to
    stderr, everything else to stdout. A total of 0 paths stands for a run without end.
    """

    def __init__(self, *, quiet: bool, total: int) -> None:
        super().__init__(logging.WARNING if quiet else logging.INFO)
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
        """Print a log message; in colour on a terminal where it has a style."""
        style = _STYLES.get(record.levelno, getattr(record, 'style', ''))
        if not style:
            print(record.getMessage(), flush=True)
            return
        from rich.console import Console  # slow to import

        is_problem = record.levelno >= logging.WARNING
        console = Console(stderr=is_problem, highlight=False, soft_wrap=True)
        console.print(record.getMessage(), markup=False, style=style)

    @property
    def is_complete(self) -> bool:
        """Whether all paths of the run have been printed."""
        return 0 < self._total <= self._done

    def path(self, result: PathResult | None) -> None:
        """Print the result of a path, or that it ended without being judged."""
        self._done += 1
        number = f'{self._done}/{self._total}' if self._total else str(self._done)
        if result is None:
            _LOG.warning('path %7s  its end was not received: not judged', number)
            return
        start = result.start
        line = (
            f'path {number:>7}  start {start.x_m:5.2f} m {start.y_m:5.2f} m '
            f'{math.degrees(start.heading_rad):6.1f} deg  '
            f'{result.outcome:<10} {result.duration_s:5.1f} s  {result.length_m:5.2f} m'
        )
        style = '' if result.outcome in ('goal', 'declared') else _BAD
        _LOG.info(line, extra={'style': style})

    def table(self, tally: PathTally, *, mode: str, sim_time_s: float, wall_time_s: float) -> None:
        """Print the table at the end of a run."""
        from goalreach_evaluation.terminal import show_paths_table  # imports rich

        if self.level < logging.WARNING:
            show_paths_table(tally, mode=mode, sim_time_s=sim_time_s, wall_time_s=wall_time_s)


@dataclass
class RunRequests:
    """Reports a run to the page, and serves the requests of the page.

    Attributes:
        ends: Whether the page has requested the end of the run.
        has_lost_bag: Whether a recording that was stopped or replaced had failed.
    """

    page: PageProcess
    options: RunOptions
    _: KW_ONLY
    directory: Path
    recorder_words: Sequence[str]
    stop: StopRequest
    ends: bool = False
    has_lost_bag: bool = False
    _next: RunOptions | None = None
    _bags: int = 0

    def __post_init__(self) -> None:
        options = self.options
        policy = options.policy or _LEARNED
        self.page.report(
            'begin', seed=options.seed, external=options.external,
            arena=options.arena, arenas=sorted({*arena_names(), options.arena}),
            policy=policy, policies=sorted({*policy_names(), policy, _LEARNED}),
        )  # fmt: skip
        if options.record is not None:
            self.page.report('record', on=True, bag=str(options.record))

    def add_path(self, result: PathResult) -> None:
        """Report a finished path to the page."""
        start = result.start
        self.page.report(
            'path', x_m=start.x_m, y_m=start.y_m, heading_deg=math.degrees(start.heading_rad),
            outcome=result.outcome, duration_s=result.duration_s, length_m=result.length_m,
        )  # fmt: skip

    def serve(self, recorder: RecorderProcess | None) -> RecorderProcess | None:
        """Serve the requests of the page; return the recorder, if one is recording."""
        for request in self.page.poll():
            name, value = request['request'], request.get('value')
            if name == 'stop':
                self.ends = True
            elif name == 'start':
                self._next = self._checked(value) or self._next
                self.ends = self.ends or self._next is not None
            elif name == 'record':
                recorder = self._record(recorder, on=value is True)
        return recorder

    def _record(self, recorder: RecorderProcess | None, *, on: bool) -> RecorderProcess | None:
        """Stop the recording, or start one in the folder of the logs where none runs."""
        if on == (recorder is not None and recorder.exit_status is None):
            return recorder
        if recorder is not None:
            _LOG.info(recorder.stop())
            self.has_lost_bag |= recorder.failed
        if not on:
            self.page.report('record', on=False)
            return None
        self._bags += 1
        bag = self.directory / f'bag_{self._bags}'
        self.page.report('record', on=True, bag=str(bag))
        words, storage = self.recorder_words, self.options.storage
        return RecorderProcess(bag, storage, self.directory, *words)

    def next_options(self) -> RunOptions | None:
        """Keep the page after the run; return the options of the next run, or None to end.

        The page is kept while a browser has it open, where a person is at the terminal or has
        stopped the run from the page: a run in a script ends with its last path. Ctrl-C ends it.
        """
        present = sys.stdin.isatty() and sys.stdout.isatty()
        if self.stop.requested or not (present or self.ends):
            return None
        while self._next is None:
            request = self.page.keep(self.stop)
            if request is None:
                return None
            if request['request'] == 'start':
                self._next = self._checked(request.get('value'))
        return self._next

    def _checked(self, value: object) -> RunOptions | None:
        """Return the options of a run that the page requests; refuse an invalid request."""
        try:
            return self._options_of(value)
        except GoalreachError as error:
            self.page.report('refused', reason=str(error))
            return None

    def _options_of(self, value: object) -> RunOptions:
        if not isinstance(value, dict):
            raise ConfigurationError('start', value, 'arena, policy, starts and paths')
        paths = value.get('paths')
        if type(paths) is not int or paths < 0:
            raise ConfigurationError('paths', paths, 'a whole number >= 0')
        starts, policy = str(value.get('starts')), str(value.get('policy'))
        named = starts in ('paper', 'random')
        options = replace(
            self.options,
            arena=str(value.get('arena')),
            policy=None if policy == _LEARNED else policy,
            starts=starts if named else 'paper',
            start_poses=() if named else (parse_start(starts),),
            paths=paths, learn=False, learner=None, record=None, summary=None,
        )  # fmt: skip
        arena = choose_arena(options.arena)
        choose_starts(options, arena)
        choose_policy(options.policy, arena, options.seed)
        return options
