"""What a run prints, what it tells its page, and what the page asks of it."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from driven_paths import driven_path
from goalreach_bringup.launch import report
from goalreach_bringup.launch.options import RunOptions
from goalreach_evaluation.choices import arena_names
from goalreach_evaluation.path_metrics import PathTally
from goalreach_msgs_py.values import Pose2

START = {'arena': 'paper', 'policy': 'paper', 'starts': '0.9,3.0,90', 'paths': 2}
WORDS = ('--with-run', 'realtime', '--robot', 'robot1')

LOG = logging.getLogger('goalreach_bringup.launch.session')
Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize('quiet', [False, True])
def test_problems_go_to_stderr_and_all_else_to_stdout_unless_quiet(
    quiet: bool,  # noqa: FBT001
    capsys: Capture,
) -> None:
    long = 'x' * 300 + ' [red]not a colour[/red] 1'
    with report.RunReport(quiet=quiet, total=1) as run:
        LOG.debug('never')
        LOG.info(long)
        LOG.warning('%s2', long)
        LOG.error('%s3', long)
        run.path(driven_path())
        run.table(PathTally.of([driven_path()]), mode='crisp', sim_time_s=2.5, wall_time_s=1.0)
    LOG.error('after the end')
    told = capsys.readouterr()
    assert told.err == f'{long}2\n{long}3\n'
    if quiet:
        assert told.out == ''
    else:
        assert told.out.startswith(f'{long}\npath     1/1  ')
        assert '1 of 1 paths reached the goal (crisp)' in told.out


def test_a_path_is_a_line_with_its_number(capsys: Capture) -> None:
    with report.RunReport(quiet=False, total=2) as run:
        assert not run.is_complete
        run.path(driven_path())
        assert not run.is_complete
        run.path(None)
        assert run.is_complete
    told = capsys.readouterr()
    line = 'start  1.00 m  2.25 m  -90.0 deg  goal         2.5 s   1.50 m'
    assert told.out == f'path     1/2  {line}\n'
    assert told.err == 'path     2/2  its end was not received: not judged\n'
    with report.RunReport(quiet=False, total=0) as endless:
        endless.path(driven_path())
        assert not endless.is_complete
    assert capsys.readouterr().out == f'path       1  {line}\n'


@pytest.mark.parametrize(
    ('outcome', 'coloured'), [('goal', False), ('declared', False), ('bump', True)]
)
def test_on_a_terminal_a_path_that_missed_the_goal_has_a_colour(
    outcome: str, coloured: object, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('FORCE_COLOR', '1')
    monkeypatch.setenv('TERM', 'xterm')
    monkeypatch.delenv('NO_COLOR', raising=False)
    with report.RunReport(quiet=False, total=1) as run:
        run.path(driven_path(outcome))
        LOG.warning('careful')
    told = capsys.readouterr()
    assert ('\x1b[1;31m' in told.out) == coloured
    assert '\x1b[33mcareful' in told.err


def made(directory: Path, options: RunOptions) -> report.RunRequests:
    stop: Any = SimpleNamespace(requested=False)
    return report.RunRequests(
        Mock(), options, directory=directory, recorder_words=WORDS, stop=stop
    )


@pytest.fixture
def requests(tmp_path: Path) -> report.RunRequests:
    return made(tmp_path, RunOptions(learn=True))


def serve(requests: report.RunRequests, recorder: Any, name: str, value: object) -> Any:  # noqa: ANN401 - a mock
    requests.page.poll.return_value = [{'request': name, 'value': value}]  # type: ignore[attr-defined]
    return requests.serve(recorder)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'paths': -1}, 'paths = -1'),
        ({'paths': 1.0}, 'paths = 1.0'),
        ({'paths': 1_000_001}, '--paths = 1000001'),
        ({'starts': '1,2'}, "--start = '1,2'"),
        ({'policy': 'none.json'}, 'none.json: '),
    ],
)
def test_a_start_that_does_not_fit_is_refused(
    requests: report.RunRequests, changes: dict[str, object], reason: str
) -> None:
    serve(requests, None, 'start', {**START, **changes})
    told = requests.page.report.call_args  # type: ignore[attr-defined]
    assert told.args == ('refused',)
    assert told.kwargs['reason'].startswith(reason)
    assert not requests.ends


def test_a_start_ends_the_run_for_the_next(requests: report.RunRequests) -> None:
    assert requests.next_options() is None
    serve(requests, None, 'start', START)
    assert requests.next_options() == RunOptions(
        policy='paper', paths=2, start_poses=(Pose2(x_m=0.9, y_m=3.0, heading_rad=math.pi / 2),)
    )
    serve(requests, None, 'start', {**START, 'policy': 'learned', 'starts': 'random', 'paths': 0})
    assert requests.next_options() == RunOptions(starts='random')
    serve(requests, None, 'start', {**START, 'paths': -1})
    assert requests.next_options() == RunOptions(starts='random')


def test_a_recording_is_started_once_and_stopped(
    requests: report.RunRequests, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(report, 'RecorderProcess', made := Mock())
    assert serve(requests, None, 'record', value=False) is None
    recorder = serve(requests, None, 'record', value=True)
    recorder.exit_status, recorder.failed = None, False
    assert serve(requests, recorder, 'record', value=True) is recorder
    assert serve(requests, recorder, 'record', value=False) is None
    assert recorder.stop.call_count == made.call_count == 1
    assert made.call_args.args == (tmp_path / 'bag_1', 'mcap', tmp_path, *WORDS)
    assert not requests.has_lost_bag


def test_a_recorder_that_has_ended_by_itself_is_replaced(
    requests: report.RunRequests, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, 'RecorderProcess', Mock())
    dead: Any = SimpleNamespace(exit_status=3, failed=True, stop=lambda: 'no space')
    assert serve(requests, dead, 'record', value=True) is report.RecorderProcess.return_value  # type: ignore[attr-defined]
    assert requests.has_lost_bag
    name, values = told(requests)[-1]
    assert (name, values['on']) == ('record', True)


def test_a_bag_that_failed_before_the_page_stopped_it_is_not_forgotten(
    requests: report.RunRequests,
) -> None:
    failing: Any = SimpleNamespace(exit_status=None, failed=True, stop=lambda: 'no space')
    assert serve(requests, failing, 'record', value=False) is None
    assert requests.has_lost_bag


def told(requests: report.RunRequests) -> list[Any]:
    """Return the events of the page, as name and values."""
    calls = requests.page.report.call_args_list  # type: ignore[attr-defined]
    return [(*call.args, call.kwargs) for call in calls]


def test_the_page_is_told_what_runs_and_what_could_run(tmp_path: Path) -> None:
    for options, expected in (
        (RunOptions(seed=7), {'policy': 'learned', 'arena': 'paper', 'seed': 7, 'external': ()}),
        (
            RunOptions(policy='my.json', arena='a.yaml', external=('nomad200',), record=Path('b')),
            {'policy': 'my.json', 'arena': 'a.yaml', 'seed': 0, 'external': ('nomad200',)},
        ),
    ):
        requests = made(tmp_path, options)
        requests.add_path(driven_path('bump'))
        (name, begin), *events = told(requests)
        assert (name, begin['policies']) == (
            'begin', sorted({'learned', 'paper', str(expected['policy'])}),
        )  # fmt: skip
        assert begin['arenas'] == sorted({*arena_names(), str(expected['arena'])})
        assert begin.items() >= expected.items()
        values = {
            'x_m': 1.0, 'y_m': 2.25, 'heading_deg': -90.0, 'outcome': 'bump', 'duration_s': 2.5,
            'length_m': 1.5,
        }  # fmt: skip
        recording = [('record', {'on': True, 'bag': 'b'})] * (options.record is not None)
        assert events == [*recording, ('path', values)]


def test_a_page_can_stop_a_run_and_start_another_later(requests: report.RunRequests) -> None:
    serve(requests, None, 'start', {**START, 'paths': -1})
    serve(requests, None, 'start', 'soon')
    assert not requests.ends
    serve(requests, None, 'stop', None)
    assert requests.ends
    keep: Any = requests.page.keep
    keep.side_effect = [
        {'request': 'stop'},
        {'request': 'start', 'value': {**START, 'arena': 'none'}},
        {'request': 'start', 'value': {**START, 'starts': 'paper'}},
    ]
    assert requests.next_options() == RunOptions(policy='paper', paths=2)
    assert keep.call_count == 3


def test_what_a_run_leaves_is_not_asked_of_the_next(tmp_path: Path) -> None:
    options = RunOptions(
        seed=7, learn=True, learner='paper', policy='new.json', record=Path('bag'),
        summary=Path('a.json'), mode='crisp',
    )  # fmt: skip
    requests = made(tmp_path, options)
    serve(requests, None, 'start', {**START, 'starts': 'random', 'paths': 0})
    expected = RunOptions(seed=7, policy='paper', starts='random', mode='crisp')
    assert requests.next_options() == expected


@pytest.mark.parametrize(
    ('streams', 'stopped', 'kept'),
    [
        ({'stdin', 'stdout'}, False, True),
        ({'stdin'}, False, False),
        ({'stdout'}, False, False),
        ({'stdin', 'stdout'}, True, False),
    ],
)
def test_the_page_is_kept_for_a_person_at_a_terminal(
    requests: report.RunRequests,
    monkeypatch: pytest.MonkeyPatch,
    streams: set[str],
    stopped: bool,  # noqa: FBT001
    kept: object,
) -> None:
    for name in ('stdin', 'stdout'):
        terminal = Mock(isatty=Mock(return_value=name in streams))
        monkeypatch.setattr(f'sys.{name}', terminal)
    requests.stop.requested = stopped
    requests.page.keep.return_value = None  # type: ignore[attr-defined]
    assert requests.next_options() is None
    assert requests.page.keep.called == kept  # type: ignore[attr-defined]


def test_each_recording_has_a_bag_of_its_own(
    requests: report.RunRequests, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, 'RecorderProcess', made := Mock())
    made.return_value.exit_status, made.return_value.failed = None, False
    for value in (True, False, True, 'yes', None):
        recorder = serve(requests, made() if value is False else None, 'record', value=value)
    assert recorder is None
    directory = requests.directory
    assert [call.args[0] for call in made.call_args_list if call.args] == [
        directory / 'bag_1',
        directory / 'bag_2',
    ]
    assert told(requests)[1:] == [
        ('record', {'on': True, 'bag': str(directory / 'bag_1')}),
        ('record', {'on': False}),
        ('record', {'on': True, 'bag': str(directory / 'bag_2')}),
    ]
