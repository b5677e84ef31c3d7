"""What the robot decides: the votes and the heading they add up to."""

from __future__ import annotations

import math

from goalreach_dashboard.state import WINDOW, LearningBook, PageState
from goalreach_dashboard.views.svg import HIDDEN, VISIBLE, View, arrow, degrees, lines, rotate
from goalreach_learning.blending import Vote, blend, votes
from goalreach_learning.task import ACTION_HEADINGS_RAD, ACTIONS_DEG
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.values import Confidence

_REACH = 82.0
_LEAST = 14.0


def decide(state: PageState) -> tuple[tuple[Vote, ...], float | None]:
    """Return the votes in the present state and the heading they add up to.

    A learner's headings are drawn by chance and told only when its action has ended: then the
    votes are those of what it knows, and there is no heading.
    """
    now, policy = state.state, state.policy
    if now is None or policy is None or now.confidence is not Confidence.OK:
        return (), None
    if state.learning:
        return votes('crisp', now.mu_x, now.mu_y, policy), None
    cast = votes(state.mode, now.mu_x, now.mu_y, policy)
    return cast, blend(state.mode, cast)


def decision_view(state: PageState, cast: tuple[Vote, ...], heading_rad: float | None) -> View:
    """Return the compass and the list of votes.

    Args:
        state: What is known.
        cast: The votes.
        heading_rad: The heading they add up to, or None.
    """
    total = sum(vote.weight for vote in cast)
    arrows, rows = [], []
    for vote in sorted(cast, key=lambda vote: -vote.weight):
        share = vote.weight / total
        angle_rad = ACTION_HEADINGS_RAD[vote.action]
        arrows.append(arrow('vote', angle_rad, _LEAST + (_REACH - _LEAST) * share))
        rows.append(
            f'<li><span class="bar" style="--share:{share:.3f}"></span>'
            f'<b>{share:.0%}</b> {region_name(vote.region)} <i>{ACTIONS_DEG[vote.action]:.0f}°</i>'
            '</li>'
        )
    view = {
        'vote-arrows': {'html': ''.join(arrows)},
        'votes': {'html': ''.join(rows)},
        'needle': dict(HIDDEN),
        'blend': dict(HIDDEN),
        'commanded-text': {'text': '–'},
        'decision-note': {'text': _note(state)},
    }
    if state.robot.truth is not None:
        turned = rotate(state.robot.truth.heading_rad)
        view['needle'] = VISIBLE | {'transform': turned}
    if heading_rad is not None:
        x, y = _REACH * math.cos(heading_rad), -_REACH * math.sin(heading_rad)
        view['blend'] = VISIBLE | {'x2': f'{x:.1f}', 'y2': f'{y:.1f}'}
        view['commanded-text'] = {'text': degrees(heading_rad)}
    elif state.learning and state.book.last is not None:
        view['commanded-text'] = {'text': 'exploring'}
    return view


def _note(state: PageState) -> str:
    if state.policy is None:
        return 'no policy heard yet'
    if state.learning:
        return 'learning: drawn by chance'
    return {
        'crisp': 'crisp: one region decides',
        'fuzzy': 'fuzzy: up to four regions vote',
        'fuzzy-eq3': 'equation (3), unit vectors',
        'fuzzy-as-printed': 'equation (3) as printed',
    }.get(state.mode, state.mode)


_LEFT, _RIGHT, _TOP, _FLOOR = 34.0, 392.0, 10.0, 88.0


def learning_view(state: PageState) -> View:
    """Return counters, last action and curve."""
    book = state.book
    view = {
        'bumps': {'text': str(book.bumps)},
        'timeouts': {'text': str(book.timeouts)},
        'learning-note': {'text': 'while learning' if state.learning else 'driving what it knows'},
        **_curve(book),
    }
    last = book.last
    if last is not None:
        view['trial'] = {'text': str(last.trial + 1)}
        temperature = f'{last.temperature:.3g}' if last.temperature > 0.0 else 'greedy'
        view['temperature'] = {'text': temperature}
        outcome = f', {last.outcome.value}' if last.outcome is not None else ''
        view['last-action'] = {
            'text': f'{ACTIONS_DEG[last.action]:.0f}° in {region_name(last.state)}{outcome}'
        }
    return view


def _curve(book: LearningBook) -> dict[str, dict[str, str]]:
    first, last = (book.curve[0][0], book.curve[-1][0]) if book.curve else (1, 1)
    span = max(1, last - first)
    points = [
        (_LEFT + (_RIGHT - _LEFT) * (number - first) / span, _FLOOR - (_FLOOR - _TOP) * share)
        for number, share in book.curve
    ]
    middle = (_LEFT + _RIGHT) / 2
    axes = (
        f'<path class="axis" d="M{_LEFT} {_TOP}V{_FLOOR}H{_RIGHT}"/>'
        f'<path class="grid" d="M{_LEFT} {_TOP}H{_RIGHT}"/>'
        f'<text class="knot end" x="{_LEFT - 4}" y="{_TOP + 4}">100%</text>'
        f'<text class="knot end" x="{_LEFT - 4}" y="{_FLOOR}">0</text>'
        f'<text class="knot start" x="{_LEFT}" y="104">path {first}</text>'
        f'<text class="knot end" x="{_RIGHT}" y="104">{last}</text>'
        f'<text class="label" x="{middle}" y="104">goals among the last {WINDOW} paths</text>'
    )
    dots = [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5"/>' for x, y in points[-1:]]
    return {
        'curve-axes': {'html': axes},
        'curve-line': {'points': lines(points)},
        'curve-dots': {'html': ''.join(dots)},
    }
