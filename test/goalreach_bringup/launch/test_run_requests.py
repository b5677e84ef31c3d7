"""What the page asks of a run."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from goalreach_bringup.launch import report
from goalreach_bringup.launch.options import RunOptions
from goalreach_msgs_py.values import Pose2

START = {'arena': 'paper', 'policy': 'paper', 'starts': '0.9,3.0,90', 'paths': 2}


@pytest.fixture
def requests(tmp_path: Path) -> report.RunRequests:
    stop: Any = SimpleNamespace(requested=False)
    return report.RunRequests(Mock(), RunOptions(learn=True), directory=tmp_path, stop=stop)


def serve(requests: report.RunRequests, recorder: Any, name: str, value: object) -> Any:  # noqa: ANN401 - a mock
    requests.page.poll.return_value = [{'request': name, 'value': value}]  # type: ignore[attr-defined]
    return requests.serve(recorder)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'paths': -1}, 'paths = -1'),
        ({'paths': 1.0}, 'paths = 1.0'),
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


def test_a_recording_is_started_once_and_stopped(
    requests: report.RunRequests, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, 'RecorderProcess', made := Mock())
    assert serve(requests, None, 'record', value=False) is None
    recorder = serve(requests, None, 'record', value=True)
    assert serve(requests, recorder, 'record', value=True) is recorder
    assert serve(requests, recorder, 'record', value=False) is None
    assert recorder.stop.call_count == made.call_count == 1
    assert made.call_args.args[0].name == 'bag_1'
