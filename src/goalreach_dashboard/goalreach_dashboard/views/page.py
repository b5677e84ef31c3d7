"""The whole page as one view: summary, health of the graph, and all panels."""

from typing import Final

from goalreach_dashboard.health import NodeStatus
from goalreach_dashboard.state import TOPICS_OF, PageState
from goalreach_dashboard.views.arena import arena_view
from goalreach_dashboard.views.decision import decide, decision_view, learning_view
from goalreach_dashboard.views.sensing import camera_view, membership_view, pose_view
from goalreach_dashboard.views.svg import Elements, View, fragment
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, ROBOT

_RECENT_S: Final = 0.5


def run_status(state: PageState, now_s: float) -> str:
    """Return the status of the run in a few words."""
    health = state.health
    found = {name: health.status(name, now_s) for name in health.nodes}
    down = [name for name, status in found.items() if status is NodeStatus.DOWN]
    if down:
        first = max(down, key=lambda name: health.silence_s(name, now_s))
        return f'{first} is silent' if len(down) < len(found) else 'the graph is silent'
    if set(found.values()) == {NodeStatus.UNSEEN}:
        return 'waiting for a graph'
    if state.is_paused or found[ROBOT] is NodeStatus.QUIET:
        return 'paused'
    return 'learning' if state.learning else 'driving'


def is_state_lost(state: PageState, now_s: float) -> bool:
    """Return whether the robot runs and no region state arrives: the one shown is outdated."""
    health = state.health
    running = health.status(ROBOT, now_s) is NodeStatus.UP
    return running and health.status(ESTIMATOR, now_s) is not NodeStatus.UP


def summary_view(state: PageState, now_s: float) -> Elements:
    """Return the figures at the top."""
    status, paths, robot = run_status(state, now_s), state.paths, state.parameters[ROBOT]
    goals, total = paths.outcomes['goal'], paths.outcomes.total()
    mode = 'learning' if state.learning else state.mode
    view = {
        'status': {'text': status, 'class': f'chip {_tone(status)}'},
        'mode': {'text': mode if state.parameters[CONTROLLER] else '–'},
        'success': {'text': f'{goals} of {total}' if total else '–'},
        'sim-time': {'text': f'{state.clock_ns * 1e-9:.1f} s' if state.clock_ns else '–'},
    }
    if paths.last is not None:
        number = paths.last.path + (2 if paths.last.outcome is not None else 1)
        view['path'] = {'text': str(number)}
    if robot.get('clock') == 'lockstep':
        view['speed'] = {'text': 'lockstep'}
    elif 'speed' in robot:
        view['speed'] = {'text': f'{robot["speed"]:g}×'}
    return view


def _tone(status: str) -> str:
    if 'silent' in status:
        return 'down'
    return 'quiet' if status in ('paused', 'waiting for a graph') else 'up'


def health_view(state: PageState, now_s: float) -> Elements:
    """Return nodes and topics; every colour has its word."""
    health = state.health
    view: Elements = {}
    for name in health.nodes:
        status, silence_s = health.status(name, now_s), health.silence_s(name, now_s)
        rate = health.topics.get(TOPICS_OF[name][0])
        words = {
            NodeStatus.UP: f'{rate.rate_hz(now_s):.0f}\N{NO-BREAK SPACE}Hz' if rate else 'up',
            NodeStatus.QUIET: 'responds, publishes nothing',
            NodeStatus.DOWN: f'silent for {silence_s:.0f} s',
            NodeStatus.UNSEEN: 'not seen',
        }
        if silence_s < _RECENT_S:
            words[NodeStatus.DOWN] = 'was silent, is back'
        view[f'node-{name}'] = {'class': f'node {status.value}'}
        view[f'word-{name}'] = {'text': words[status]}
    rates = [(topic, rate.rate_hz(now_s)) for topic, rate in sorted(health.topics.items())]
    view['topics'] = fragment('topic_rates', rates)
    return view


def page_view(state: PageState, now_s: float) -> View:
    """Return the attributes of every element of the page.

    Args:
        state: The page's state.
        now_s: Time of the monotonic clock, for rates and silences.
    """
    lost = is_state_lost(state, now_s)
    cast, heading_rad = ((), None) if lost else decide(state)
    return {
        **summary_view(state, now_s),
        **health_view(state, now_s),
        **arena_view(state, cast, heading_rad, lost=lost),
        **camera_view(state.picture),
        **pose_view(state.poses),
        **membership_view(state, lost=lost),
        **decision_view(state, cast, heading_rad),
        **learning_view(state),
    }
