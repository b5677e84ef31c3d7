"""A run from its options to its result, with paths that a test gives in place of a graph's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import itertools
import json
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from driven_paths import driven_path
from goalreach_bringup.launch import session
from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.path_evaluator import Progress
from goalreach_bringup.launch.plan import ExternalNodes
from goalreach_bringup.launch.report import RunReport
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.parameter_file import NodeParameters, read_parameters
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.topics import LOCALIZER, ROBOT
import graphs

PAPER = RunOptions(policy='paper', dashboard=False)


class Session(session.RunSession):
    """A run whose paths are given."""

    def __init__(self, options: RunOptions, outcomes: Sequence[str | None] = ()) -> None:
        super().__init__(options)
        self.outcomes = outcomes
        self.changes: dict[str, Any] = {}
        self.parameters: NodeParameters = {}

    def _drive(self, policy: Policy, parameters: NodeParameters, *, shows_page: bool) -> None:
        assert not shows_page
        self.policy, self.parameters = policy, parameters
        vars(self).update(self.changes)
        for outcome in self.outcomes:
            self._on_path(None if outcome is None else driven_path(outcome))


@pytest.fixture(autouse=True)
def _place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = itertools.count()

    def make_run_directory() -> Path:  # two runs of a test begin in the same second
        directory = tmp_path / 'logs' / str(next(numbers))
        directory.mkdir(parents=True)
        return directory

    monkeypatch.setattr(session, 'make_run_directory', make_run_directory)
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))


@pytest.mark.parametrize(
    ('paths', 'outcomes', 'failed', 'status'),
    [
        (2, ('goal', 'goal'), None, 0),
        (2, ('goal', 'declared'), False, 0),
        (2, ('goal', 'bump'), None, 1),
        (2, ('goal', None), None, 1),
        (2, ('goal',), None, 1),
        (2, ('goal', 'goal'), True, 1),
        (0, ('bump', 'goal'), None, 0),
        (0, (), True, 1),
    ],
)
def test_the_status_tells_whether_each_path_that_was_asked_for_reached_the_goal(
    paths: int, outcomes: tuple[str | None, ...], failed: object, status: int
) -> None:
    run = Session(replace(PAPER, paths=paths), outcomes)
    if failed is not None:
        run.changes = {'_recorder': SimpleNamespace(failed=failed)}
    assert run.execute() == status
    assert run.next_options is None


@pytest.mark.parametrize('lost', [False, True])
def test_a_bag_that_was_lost_before_the_end_is_in_the_status(lost: bool) -> None:  # noqa: FBT001
    run = Session(replace(PAPER, paths=1), ('goal',))
    run.changes = {'_requests': Mock(has_lost_bag=lost)}
    assert run.execute() == lost


def test_a_summary_holds_each_path_that_was_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, policy in enumerate(('paper', None)):
        file = tmp_path / f'{number}.json'
        options = replace(PAPER, policy=policy, seed=7, paths=3, summary=file, mode='crisp')
        run = Session(options, ('goal', None, 'bump'))
        run.changes = {'_sim_time_s': 4.5}
        assert run.execute() == 1
        summary = json.loads(file.read_text())
        assert [one['outcome'] for one in summary['paths']] == ['goal', 'bump']
        assert (summary['seed'], summary['mode'], summary['sim_time_s']) == (7, 'crisp', 4.5)
        assert summary['policy'] == (policy or 'learned')
        assert 0.0 <= summary['wall_time_s'] < 100.0
        assert run._tally.paths == 2
    told, problems = capsys.readouterr()
    assert problems == 'path     2/3  its end was not received: not judged\n' * 2
    assert told.count('learned a policy: 20 trials of 22 paths') == 1
    assert told.count('1 of 2 paths reached the goal (crisp)') == 2
    assert len(list((tmp_path / 'logs').glob('*/policy.json'))) == 1


def test_results_are_kept_for_a_summary_only() -> None:
    run = Session(PAPER, ('goal', 'bump'))
    run.execute()
    assert (run._results, run._tally.paths) == ([], 2)


def test_what_cannot_be_written_is_refused_before_anything_is_driven(tmp_path: Path) -> None:
    (tmp_path / 'bag').mkdir()
    for options in (
        replace(PAPER, record=tmp_path / 'bag'),
        replace(PAPER, summary=tmp_path / 'no' / 'a.json'),
    ):
        run = Session(options, ('goal',))
        with pytest.raises(GoalreachError):
            run.execute()
        assert run._tally.paths == 0
    params = tmp_path / 'params.yaml'
    params.write_text('nomad200: {ros__parameters: {clock: lockstep}}')
    run = Session(replace(PAPER, no_drive=True, params_file=params), ('goal',))
    with pytest.raises(ConfigurationError, match='--no-drive'):
        run.execute()
    assert run._tally.paths == 0
    assert Session(replace(PAPER, no_drive=True)).execute() == 0


@pytest.mark.parametrize(('driven', 'total'), [(40, 4), (44, 0)])
def test_learning_drives_what_is_left(
    driven: int, total: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, params = tmp_path / 'policy.json', tmp_path / 'params.yaml'
    params.write_text('goal_reaching_controller: {ros__parameters: {learning.trials: 2}}')
    write_policy(file, replace(Policy.unlearned(RegionMap()), learning={'paths_driven': driven}))
    options = RunOptions(learn=True, policy=str(file), params_file=params, dashboard=False)
    run = Session(options, ('bump',) * total)
    assert run.execute() == 0
    assert bool(run.parameters) == bool(total)
    assert run._report.is_complete == bool(total)
    told = capsys.readouterr().out
    assert f'continuing with path {driven + 1} of 44' in told
    assert f'after {driven} paths the best actions lead to the goal from 0 of 22' in told
    assert ('(learning)' in told) == bool(total)
    assert not read_policy(file).visits.any()


@pytest.mark.parametrize(
    ('starts', 'service', 'asked'), [(True, '', 0), (False, '', 2), (False, '/put', 0)]
)
def test_a_person_is_asked_to_place_a_robot_that_nobody_places(
    starts: object, service: str, asked: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    external = (ROBOT,) if service else ()
    options = replace(PAPER, paths=3, placement_service=service, external=external)
    run = Session(options, ('goal',) * 3)
    run.changes = {} if starts else {'_starts': ()}
    assert run.execute() == 0
    lines = [line for line in caplog.messages if line.startswith('place the robot')]
    assert len(lines) == asked
    assert not run._waits_for_person


@pytest.mark.parametrize(
    ('namespace', 'remaps', 'words'),
    [
        ('', ('/a:=/b',), ()),
        (
            'robot1',
            ('/a:=/b', '__ns:=/robot1', '/clock:=/clock'),
            ('--robot', 'robot1', '--clock-topic', '/clock', '--regex', '^(/robot1/|/clock$)'),
        ),
    ],
)
def test_names_of_a_namespace_reach_nodes_and_recorder(
    namespace: str,
    remaps: tuple[str, ...],
    words: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(session, 'RecorderProcess', recorder := Mock())
    options = replace(PAPER, namespace=namespace, remaps=('/a:=/b',))
    run = Session(options)
    run.execute()
    assert run._remaps == remaps
    run._record()
    assert not recorder.called
    run._options = replace(options, record=tmp_path / 'bag')
    run._record()
    given = ('--with-run', 'realtime', *words)
    assert recorder.call_args.args == (tmp_path / 'bag', 'mcap', run._directory, *given)
    run.page, run._stop = Mock(), Mock()
    run._open_page()
    assert run._requests is not None
    assert tuple(run._requests.recorder_words) == given


@pytest.mark.parametrize(
    ('external', 'began_ns', 'last_ns', 'sim_time_s'),
    [
        ((), 2_000_000_000, 5_000_000_000, 5.0),
        ((ROBOT,), 2_000_000_000, 5_000_000_000, 3.0),
        ((ROBOT,), None, 0, 0.0),
        ((ROBOT,), 2_000_000_000, 0, 0.0),
    ],
)
def test_the_time_of_a_robot_of_others_begins_with_its_first_stamp(
    external: tuple[str, ...], began_ns: int | None, last_ns: int, sim_time_s: float
) -> None:
    run = Session(PAPER)
    run._external = ExternalNodes(names=external)
    run._report = RunReport(quiet=True, total=1)
    progress = Progress(path=0, placed=True, last_ns=last_ns, truth=None)
    monitor: Any = SimpleNamespace(began_ns=began_ns, progress=progress)
    run.page, run._recorder = page, recorder = Mock(), Mock()
    recorder.poll.return_value = ''
    assert not run._is_over(monitor)
    assert run._sim_time_s == pytest.approx(sim_time_s)
    assert recorder.poll.call_args.kwargs == {'began': last_ns > 0}
    assert not page.report.called
    recorder.poll.return_value = 'the recorder ended'
    run._report.path(driven_path('goal'))
    assert run._is_over(monitor)
    assert page.report.call_args.kwargs == {'on': False, 'error': 'the recorder ended'}


@pytest.mark.parametrize(
    ('stopped', 'ends', 'complete', 'reason'),
    [
        (False, False, True, 'all paths driven'),
        (True, False, True, 'all paths driven'),
        (True, False, False, 'stopped'),
        (False, True, False, 'stopped'),
        (False, False, False, 'an error'),
    ],
)
def test_the_page_is_told_why_a_run_has_ended(  # noqa: PLR0917 - four facts
    stopped: bool,  # noqa: FBT001
    ends: bool,  # noqa: FBT001
    complete: object,
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(session, 'StopRequest', lambda: SimpleNamespace(requested=stopped))
    monkeypatch.setattr(session, 'graph_environment', lambda *_: {})
    run, page = session.RunSession(PAPER), Mock()
    page.poll.return_value = []
    run.page, run._directory, run._report = page, tmp_path, RunReport(quiet=True, total=1)
    run._recorder_words = []

    def end() -> bool:
        assert run._requests is not None
        run._requests.ends = ends
        if complete:
            run._report.path(driven_path('goal'))
        return False

    monkeypatch.setattr(run, '_find_external', end)
    run._drive(Policy.unlearned(RegionMap()), {ROBOT: {'speed': 2.0}}, shows_page=True)
    assert [call.args[0] for call in page.report.call_args_list] == ['begin', 'end']
    assert page.report.call_args.kwargs == {'reason': reason}
    assert run._is_stopped() == (stopped or ends)
    assert read_parameters(tmp_path / 'parameters.yaml')[ROBOT] == {'speed': 2.0}


@pytest.mark.parametrize(
    ('found', 'service', 'placed'),
    [
        (None, '', True),
        (ExternalNodes(names=(ROBOT,)), '', True),
        (ExternalNodes(names=(ROBOT,), has_reset=False), '', False),
        (ExternalNodes(names=(ROBOT,)), '/put', False),
    ],
)
def test_what_nodes_of_others_offer_is_told_and_decides_who_places_the_robot(
    found: ExternalNodes | None,
    service: str,
    placed: object,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    search = Mock(return_value=found)
    monkeypatch.setattr('goalreach_bringup.launch.ros.external.find_external', search)
    assert session.RunSession(PAPER)._find_external()
    assert not search.called
    options = replace(PAPER, external=(LOCALIZER, ROBOT), placement_service=service)
    run = session.RunSession(options)
    run._remaps = ('/a:=/b',)
    assert run._find_external() == (found is not None)
    assert search.call_args.args[:2] == ((ROBOT, LOCALIZER), ('/a:=/b',))
    assert run._external == (found or ExternalNodes())
    assert caplog.messages == (found.lines(service) if found else [])
    assert bool(run._starts) == placed
