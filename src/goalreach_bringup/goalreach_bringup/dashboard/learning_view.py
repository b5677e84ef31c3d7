"""What the robot has learned: counters and the curve of success."""

from __future__ import annotations

from goalreach_bringup.dashboard.learning_book import WINDOW, LearningBook
from goalreach_bringup.dashboard.page_state import PageState
from goalreach_bringup.dashboard.patch import View
from goalreach_bringup.dashboard.svg import lines
from goalreach_learning.actions import ACTIONS_DEG
from goalreach_msgs_py.regions import region_name

__all__ = ['learning_view']

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
