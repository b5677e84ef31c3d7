"""What the robot decides: the votes and the heading they add up to."""

from __future__ import annotations

import math

from goalreach_bringup.dashboard.page_state import PageState
from goalreach_bringup.dashboard.patch import View
from goalreach_bringup.dashboard.svg import HIDDEN, VISIBLE, arrow, degrees, rotate
from goalreach_learning.actions import ACTION_HEADINGS_RAD, ACTIONS_DEG
from goalreach_learning.blending import Vote, blend, votes
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.values import Confidence

__all__ = ['decide', 'decision_view']

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
