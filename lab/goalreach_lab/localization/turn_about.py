"""Times and errors of several ways to a pose, taken turn about on the same images."""

from __future__ import annotations

from collections.abc import Callable
import math
import time
from typing import TypeVar

from goalreach_lab.localization.wanderer import Step
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.values import Pose2

_Value = TypeVar('_Value')


class TurnAbout:
    """Processor times (ms) and position errors (in) by name, one of each for every image."""

    def __init__(self) -> None:
        self.ms: dict[str, list[float]] = {}
        self.errors_in: dict[str, list[float]] = {}

    def timed(self, name: str, function: Callable[[], _Value]) -> _Value:
        """Call, and add the processor time to the last image's."""
        began_s = time.process_time()
        value = function()
        self.ms[name][-1] += 1e3 * (time.process_time() - began_s)
        return value

    def begin(self, *names: str) -> None:
        """Begin an image."""
        for name in names:
            self.ms.setdefault(name, []).append(0.0)

    def drop(self, *names: str) -> None:
        """Forget the last image."""
        for name in names:
            self.ms[name].pop()

    def judge(self, name: str, pose: Pose2, step: Step) -> None:
        """Note the error of a pose."""
        self.errors_in.setdefault(name, []).append(away_m(pose, step) / INCH_M)


def away_m(pose: Pose2, step: Step) -> float:
    """Return how far a pose is from the truth, metres."""
    truth = step.frame.truth.pose
    return math.hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m)
