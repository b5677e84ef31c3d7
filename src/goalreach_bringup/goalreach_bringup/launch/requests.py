"""What a person asks of a run from its page: stop, record, replay the last path, run again."""

from collections.abc import Mapping
from dataclasses import replace
import logging
import math
from pathlib import Path
import sys
from typing import Final

from goalreach_bringup.launch.auxiliary_processes import PageProcess, RecorderProcess
from goalreach_bringup.launch.options import RunOptions, parse_start
from goalreach_bringup.launch.plan import choose_starts
from goalreach_evaluation.choices import arena_names, choose_arena, choose_policy
from goalreach_evaluation.path_metrics import PathResult
from goalreach_evaluation.starts import RunSeeds
from goalreach_learning.policy_file import policy_names
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.ros.process import StopRequest

_LOG: Final = logging.getLogger(__name__)
_LEARNED: Final = 'learned'


class RunRequests:
    """Tells the page what happens in a run, and does what the page asks for.

    Args:
        page: The page.
        options: Options of the run.
        directory: Directory of the run.
        environment: Environment of the graph.
        stop: Ends the run.

    Attributes:
        ends: Whether the page has asked for the end of the run.
    """

    def __init__(
        self,
        page: PageProcess,
        options: RunOptions,
        *,
        directory: Path,
        environment: Mapping[str, str],
        stop: StopRequest,
    ) -> None:
        self._page = page
        self._options = options
        self._directory = directory
        self._environment = environment
        self._stop = stop
        self.ends = False
        self._next: RunOptions | None = None
        self._bags = 0
        policy = options.policy or _LEARNED
        page.report(
            'begin',
            arena=options.arena,
            arenas=sorted({*arena_names(), options.arena}),
            policy=policy,
            policies=sorted({*policy_names(), policy, _LEARNED}),
            seed=options.seed,
        )
        if options.record is not None:
            page.report('record', on=True, bag=str(options.record))

    def add_path(self, result: PathResult) -> None:
        """Tell the page of a finished path."""
        start = result.start
        self._page.report(
            'path',
            x_m=start.x_m,
            y_m=start.y_m,
            heading_deg=math.degrees(start.heading_rad),
            outcome=result.outcome,
            duration_s=result.duration_s,
            length_m=result.length_m,
        )

    def end(self, reason: str) -> None:
        """Tell the page that the run has ended, and why."""
        self._page.report('end', reason=reason)

    def serve(self, recorder: RecorderProcess | None) -> RecorderProcess | None:
        """Do what the page asks for; return the recorder, where one records.

        Args:
            recorder: The recorder so far.
        """
        for request in self._page.poll():
            name, value = request['request'], request.get('value')
            if name == 'stop':
                self.ends = True
            elif name == 'start':
                self._next = self._checked(value)
                self.ends = self.ends or self._next is not None
            elif name == 'record' and (value is True) != (recorder is not None):
                recorder = self._record(recorder)
        return recorder

    def _record(self, recorder: RecorderProcess | None) -> RecorderProcess | None:
        """End a recording or begin one, beside the logs."""
        if recorder is not None:
            _LOG.info(recorder.stop())
            self._page.report('record', on=False)
            return None
        self._bags += 1
        bag = self._directory / f'bag_{self._bags}'
        self._page.report('record', on=True, bag=str(bag))
        words = ['--storage', self._options.storage, '--use-sim-time']
        words += ['--parameters', str(self._directory / 'parameters.yaml')]
        return RecorderProcess(bag, words, self._directory, self._environment)

    def next_options(self) -> RunOptions | None:
        """Keep the page after the run; return the options of the next run, or None to end.

        The page is kept while a browser has it open, where a person is at the terminal or has
        stopped the run from the page: a run in a script ends with its last path. Ctrl-C ends it.
        """
        present = sys.stdin.isatty() and sys.stdout.isatty()
        if self._stop.requested or not (present or self.ends):
            return None
        while self._next is None:
            request = self._page.keep(self._stop)
            if request is None:
                return None
            if request['request'] == 'start':
                self._next = self._checked(request.get('value'))
        return self._next

    def _checked(self, value: object) -> RunOptions | None:
        """Return the options of a run that the page asks for; refuse what cannot be driven."""
        try:
            return self._options_of(value)
        except GoalreachError as error:
            self._page.report('refused', reason=str(error))
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
            self._options,
            arena=str(value.get('arena')),
            policy=None if policy == _LEARNED else policy,
            starts=starts if named else 'paper',
            start_poses=() if named else (parse_start(starts),),
            paths=paths,
            learn=False,
            record=None,
            summary=None,
        )
        arena = choose_arena(options.arena)
        choose_starts(options, arena, RunSeeds.spawn(options.seed))
        choose_policy(options.policy, arena, options.seed)
        return options
