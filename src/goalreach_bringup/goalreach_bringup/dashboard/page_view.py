"""The whole page as one view."""

from __future__ import annotations

from goalreach_bringup.dashboard.arena_view import arena_view
from goalreach_bringup.dashboard.decision_view import decide, decision_view
from goalreach_bringup.dashboard.learning_view import learning_view
from goalreach_bringup.dashboard.page_state import PageState
from goalreach_bringup.dashboard.patch import View
from goalreach_bringup.dashboard.sense_view import camera_view, membership_view, pose_view
from goalreach_bringup.dashboard.summary_view import health_view, is_state_lost, summary_view

__all__ = ['page_view']


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
