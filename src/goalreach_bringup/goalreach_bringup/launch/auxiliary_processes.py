"""Auxiliary processes of a run: the live page and the recorder."""

from importlib.util import find_spec
import json
import logging
import math
from pathlib import Path
import secrets
import signal
import sys
import time
from typing import Any, Final

from goalreach_bringup.launch.child_process import ChildProcess, start_fork_server, stop_all
from goalreach_dashboard.address import REQUEST, TOKEN_VARIABLE, bind, url
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.process import StopRequest

_LOG: Final = logging.getLogger(__name__)
_COMMAND_LINE: Final = 'goalreach_bringup.cli'
_POLL_S: Final = 0.05
_PAGE_CLOSED_S: Final = 5.0
"""Longest time without a browser that counts as a reload of the page. Chosen."""


def _missing_libraries() -> list[str]:
    return [name for name in ('starlette', 'uvicorn', 'websockets') if find_spec(name) is None]


def require_page() -> None:
    """Check that the web libraries of the live page are installed.

    Raises:
        GoalreachError: They are not. A script of a clone installs it into the clone's `.venv`.
    """
    if missing := ' '.join(_missing_libraries()):
        script = Path(sys.prefix).parent / 'scripts' / 'dashboard.py'
        python = sys.executable
        pip = f'{python} -m pip install' if find_spec('pip') else f'uv pip install -p {python}'
        cure = f'python3 {script}' if script.is_file() else f'{pip} {missing}'
        raise GoalreachError(f'the live page needs {missing}: `{cure}` installs it')


def is_page_wanted(*, requested: bool | None, clock: str) -> bool:
    """Return whether a run shows its page.

    Unless an option says so, it does where the run is for a person: on a terminal, in real time,
    with the web library installed.
    """
    if requested:
        require_page()
    if requested is not None:
        return requested
    return not _missing_libraries() and clock == 'realtime' and sys.stdout.isatty()


class PageProcess(ChildProcess):
    """Runs `goalreach dashboard` for one or several runs, and exchanges messages with it.

    Anyone with the logged URL may steer: it holds a token that is nowhere else. The socket is
    bound here, so that the URL is known, and a browser that opens it waits, before the page is up.
    """

    def __init__(self, arena: str, namespace: str, directory: Path) -> None:
        start_fork_server()
        words = ['dashboard', '--arena', arena, '--robot', namespace]
        token = secrets.token_urlsafe(16)
        self._events = (directory / 'page.jsonl').open('w', encoding='utf-8', buffering=1)
        self._viewers = 0
        self._failed = False
        with bind('127.0.0.1', None) as listener:
            _LOG.info('live page: %s', url('127.0.0.1', listener.getsockname()[1], token))
            super().__init__(
                'dashboard', _COMMAND_LINE, [*words, '--events', self._events.name, '--listener'],
                log_path=directory / 'dashboard.log', variables={TOKEN_VARIABLE: token},
                listener=listener,
            )  # fmt: skip

    def report(self, event: str, **values: object) -> None:
        """Report an event of the run to the page."""
        self._events.write(json.dumps({'event': event, **values}) + '\n')

    def poll(self) -> list[dict[str, Any]]:
        """Return the requests of the page; log its end, which does not end the run."""
        requests = []
        for line in self.read_log():
            if line.startswith(REQUEST):
                message = json.loads(line[len(REQUEST) :])
                self._viewers = message.get('viewers', self._viewers)
                requests += [message] if 'request' in message else []
        if self.exit_status is not None and not self._failed:
            self._failed = True
            _LOG.error('dashboard: error: %s', self.last_log_line())
        return requests

    def keep(self, stop: StopRequest) -> dict[str, Any] | None:
        """Keep the page after a run; return a request, a start first, or None once closed."""
        seen_s = -math.inf
        while not (stop.requested or self._failed):
            if requests := self.poll():
                starts = (one for one in requests if one['request'] == 'start')
                return next(starts, requests[0])
            if self._viewers:
                if seen_s < 0.0:
                    _LOG.info('the live page stays until it is closed; Ctrl-C ends it')
                seen_s = time.monotonic()
            if time.monotonic() - seen_s > _PAGE_CLOSED_S:
                return None
            time.sleep(_POLL_S)
        return None

    def stop(self) -> None:
        """End it."""
        stop_all([self])
        self._events.close()


_DRAIN_S: Final = 30.0
"""Longest wait for a bag to be closed: the recorder flushes messages and writes a summary."""


class RecorderProcess(ChildProcess):
    """Runs `goalreach record` for a run, whose parameters `Graph` writes to the same directory."""

    def __init__(self, bag: Path, storage: str, directory: Path, *options: str) -> None:
        self.failed = False
        self._bag = bag
        self._reported = False
        words = ['record', str(bag), '--storage', storage, *options]
        words += ['--parameters', str(directory / 'parameters.yaml')]
        super().__init__('record', _COMMAND_LINE, words, log_path=directory / 'recorder.log')

    def poll(self, *, began: bool) -> str:
        """Check that it runs: a run continues without a recorder, but does not start without.

        Returns:
            How it has ended, once; else an empty text.

        Raises:
            GoalreachError: It ended before the run began.
        """
        if self._reported:
            return ''
        self.read_log()
        if self.exit_status is None:
            return ''
        summary = self.exit_summary()
        if not began:
            raise GoalreachError(f'the recorder {summary}')
        self._reported = True
        _LOG.error('recorder: error: %s', summary)
        return f'the recorder {summary}'

    def stop(self) -> str:
        """End it and wait until the bag is closed; return its last log line."""
        self.signal(signal.SIGINT)
        if not self.wait(_DRAIN_S):
            stop_all([self])
        status = self.exit_status
        self.failed = status != 0
        if status is not None and status < 0:
            return f'the recorder was killed: goalreach record --repair {self._bag}'
        return self.last_log_line()
