"""The whole page as one view."""

from __future__ import annotations

from typing import Final

from goalreach_dashboard.health import NodeStatus
from goalreach_dashboard.state import TOPICS_OF, PageState
from goalreach_dashboard.views.arena import arena_view
from goalreach_dashboard.views.decision import decide, decision_view, learning_view
from goalreach_dashboard.views.sensing import camera_view, membership_view, pose_view
from goalreach_dashboard.views.svg import View
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, ROBOT

_BACK_S: Final = 0.5


def run_status(state: PageState, now_s: float) -> str:
    """Return the state of the run in one word or two."""
    health = state.health
    found = {name: health.status(name, now_s) for name in health.nodes}
    if NodeStatus.DOWN in found.values():
        silent = [name for name in found if found[name] is NodeStatus.DOWN]
        first = max(silent, key=lambda name: health.silent_s(name, now_s))
        return f'{first} is silent' if len(silent) < len(found) else 'the graph is silent'
    if all(status is NodeStatus.UNSEEN for status in found.values()):
        return 'waiting for a graph'
    if state.stands_still or found[ROBOT] is NodeStatus.QUIET:
        return 'paused'
    return 'learning' if state.learning else 'driving'


def is_state_lost(state: PageState, now_s: float) -> bool:
    """Return whether the robot goes on and its state is not heard: what is shown is old."""
    health = state.health
    goes_on = health.status(ROBOT, now_s) is NodeStatus.UP
    return goes_on and health.status(ESTIMATOR, now_s) is not NodeStatus.UP


def summary_view(state: PageState, now_s: float) -> View:
    """Return the head's figures."""
    status = run_status(state, now_s)
    book = state.book
    parameters = state.parameters[ROBOT]
    view = {
        'status': {'text': status, 'class': f'chip {_tone(status)}'},
        'mode': {'text': 'learning' if state.learning else state.mode},
        'success': {'text': f'{book.goals} of {book.paths}' if book.paths else '–'},
        'sim-time': {'text': f'{state.clock_ns * 1e-9:.1f} s' if state.clock_ns else '–'},
    }
    if not state.parameters[CONTROLLER]:
        view['mode'] = {'text': '–'}
    if book.last is not None:
        number = book.last.path + (2 if book.last.outcome is not None else 1)
        view['path'] = {'text': str(number)}
    if parameters.get('clock') == 'lockstep':
        view['speed'] = {'text': 'lockstep'}
    elif 'speed' in parameters:
        view['speed'] = {'text': f'{parameters["speed"]:g}×'}
    return view


def _tone(status: str) -> str:
    if 'silent' in status:
        return 'down'
    return 'quiet' if status in ('paused', 'waiting for a graph') else 'up'


def _silence(silent_s: float) -> str:
    return f'silent for {silent_s:.0f} s' if silent_s >= _BACK_S else 'was silent, is back'


def health_view(state: PageState, now_s: float) -> View:
    """Return nodes and topics: a word beside every colour."""
    health = state.health
    view: dict[str, dict[str, str]] = {}
    for name in health.nodes:
        status = health.status(name, now_s)
        rate = health.topics.get(TOPICS_OF[name][0])
        words = {
            NodeStatus.UP: f'{rate.rate_hz(now_s):.0f}\N{NO-BREAK SPACE}Hz' if rate else 'up',
            NodeStatus.QUIET: 'answers, sends nothing',
            NodeStatus.DOWN: _silence(health.silent_s(name, now_s)),
            NodeStatus.UNSEEN: 'not seen',
        }
        view[f'node-{name}'] = {'class': f'node {status.value}'}
        view[f'word-{name}'] = {'text': words[status]}
    rows = []
    for topic, rate in sorted(health.topics.items()):
        rows.append(f'<li><span>{topic}</span><b>{rate.rate_hz(now_s):.1f}</b></li>')
    view['topics'] = {'html': ''.join(rows)}
    return view


def page_view(state: PageState, now_s: float) -> View:
    """Return every element of the page with the attributes it is to have.

    Args:
        state: What is known.
        now_s: Wall time, for rates and silences.
    """
    lost = is_state_lost(state, now_s)
    cast, heading_rad = ((), None) if lost else decide(state)
    return {
        **summary_view(state, now_s),
        **health_view(state, now_s),
        **arena_view(state, cast, heading_rad, lost=lost),
        **camera_view(state.picture),
        **pose_view(state),
        **membership_view(state, lost=lost),
        **decision_view(state, cast, heading_rad),
        **learning_view(state),
    }
