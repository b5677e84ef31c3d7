"""Decision and learning: the votes, the commanded heading, and the outcomes of the paths."""

from typing import Final

from goalreach_dashboard.state import WINDOW, PageState, PathStatistics
from goalreach_dashboard.views.svg import (
    HIDDEN,
    VISIBLE,
    Elements,
    degrees,
    fragment,
    polar,
    rotate,
)
from goalreach_learning.blending import Vote, blend, votes
from goalreach_learning.task import ACTION_HEADINGS_RAD, ACTIONS_DEG
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.values import Confidence

_COMMAND_LENGTH: Final = 82.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 34.0, 392.0, 10.0, 88.0
_NOTES: Final = {
    'crisp': 'crisp: one region decides',
    'fuzzy': 'fuzzy: up to four regions vote',
    'fuzzy-eq3': 'equation (3), unit vectors',
    'fuzzy-as-printed': 'equation (3) as printed',
}


def decide(state: PageState) -> tuple[tuple[Vote, ...], float | None]:
    """Return the votes in the present state and the heading they blend into.

    A learning controller explores at random and publishes an action only when it has ended: then
    the votes are those of the policy so far, and there is no heading.
    """
    now, policy = state.state, state.policy
    if now is None or policy is None or now.confidence is not Confidence.OK:
        return (), None
    if state.learning:
        return votes('crisp', now.mu_x, now.mu_y, policy), None
    cast = votes(state.mode, now.mu_x, now.mu_y, policy)
    return cast, blend(state.mode, cast)


def decision_view(state: PageState, cast: tuple[Vote, ...], heading_rad: float | None) -> Elements:
    """Return the compass and the list of votes.

    Args:
        state: The page's state.
        cast: The votes.
        heading_rad: The commanded heading, or None.
    """
    total = sum(vote.weight for vote in cast)
    rows = [
        {
            'region': region_name(vote.region),
            'share': vote.weight / total,
            'heading_rad': ACTION_HEADINGS_RAD[vote.action],
            'heading_deg': ACTIONS_DEG[vote.action],
        }
        for vote in sorted(cast, key=lambda vote: -vote.weight)
    ]
    note = _NOTES.get(state.mode, state.mode)
    if state.policy is None:
        note = 'no policy received'
    elif state.learning:
        note = 'learning: explores at random'
    view = {
        'vote-arrows': fragment('vote_arrows', rows),
        'votes': fragment('vote_list', rows),
        'needle': dict(HIDDEN),
        'blend': dict(HIDDEN),
        'commanded-text': {'text': '–'},
        'decision-note': {'text': note},
    }
    if state.poses.truth is not None:
        view['needle'] = VISIBLE | {'transform': rotate(state.poses.truth.heading_rad)}
    if heading_rad is not None:
        x, y = polar(_COMMAND_LENGTH, heading_rad)
        view['blend'] = VISIBLE | {'x2': f'{x:.1f}', 'y2': f'{y:.1f}'}
        view['commanded-text'] = {'text': degrees(heading_rad)}
    elif state.learning and state.paths.last is not None:
        view['commanded-text'] = {'text': 'exploring'}
    return view


def learning_view(state: PageState) -> Elements:
    """Return counters, last action and curve."""
    paths = state.paths
    view = {
        'bumps': {'text': str(paths.outcomes['bump'])},
        'timeouts': {'text': str(paths.outcomes['timeout'])},
        'learning-note': {'text': 'in progress' if state.learning else 'policy is fixed'},
        **_curve(paths),
    }
    last = paths.last
    if last is not None:
        view['trial'] = {'text': str(last.trial + 1)}
        temperature = f'{last.temperature:.3g}' if last.temperature > 0.0 else 'greedy'
        view['temperature'] = {'text': temperature}
        outcome = f', {last.outcome.value}' if last.outcome is not None else ''
        action = f'{ACTIONS_DEG[last.action]:.0f}° in {region_name(last.state)}{outcome}'
        view['last-action'] = {'text': action}
    return view


def _curve(paths: PathStatistics) -> Elements:
    first, last = (paths.curve[0][0], paths.curve[-1][0]) if paths.curve else (1, 1)
    span = max(1, last - first)
    points = [
        (_LEFT + (_RIGHT - _LEFT) * (number - first) / span, _BOTTOM - (_BOTTOM - _TOP) * share)
        for number, share in paths.curve
    ]
    dots = [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5"/>' for x, y in points[-1:]]
    return {
        'curve-axes': fragment('curve_axes', first, last, WINDOW),
        'curve-line': {'points': ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)},
        'curve-dots': {'html': ''.join(dots)},
    }
