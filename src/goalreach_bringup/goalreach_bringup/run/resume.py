"""What a restarted node is told, so that the run goes on where it was."""

from __future__ import annotations

from typing import Any

from goalreach_bringup.run.plan import CONTROLLER, ROBOT
from goalreach_bringup.run.referee import Progress

__all__ = ['resume_parameters']

_AHEAD_NS = 6_000_000_000
"""In lockstep the nodes may have heard ticks that the launcher has not, a little over a hundred:
4 s of the robot's clock, which must not go back for them."""


def resume_parameters(progress: Progress, *, lockstep: bool) -> dict[str, dict[str, Any]]:
    """Return the parameters that differ from those of the start, by node.

    The controller goes on with the running path from wherever the robot stands, and with what it
    had learned by the end of the last path; the robot stands where it truly was, and its clock
    goes on.

    Args:
        progress: How far the run is.
        lockstep: Whether the graph may have been ahead of what was heard of it.
    """
    controller: dict[str, Any] = {
        'first_path': progress.path,
        'resume': progress.on_the_way,
    }
    changes: dict[str, dict[str, Any]] = {CONTROLLER: controller}
    if progress.truth is not None:
        truth = progress.truth
        changes[ROBOT] = {
            'start_pose': (truth.x_m, truth.y_m, truth.heading_rad),
            'start_time_ns': progress.last_ns + (_AHEAD_NS if lockstep else 0),
        }
    return changes
