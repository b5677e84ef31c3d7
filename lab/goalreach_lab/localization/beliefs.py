"""Moments at which a wrong pose was believed: how long until that ended, until it was mended."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from goalreach_lab.localization.frame_log import Frames


@dataclass(frozen=True, kw_only=True)
class WrongBelief:
    """One episode.

    Attributes:
        began_s: When the wrong pose was first believed, on the robot's clock.
        detected_s: How long it was believed.
        recovered_s: How long until a right pose was believed; infinite where the drive ended
            before.
        worst_in: Largest error meanwhile, inches.
    """

    began_s: float
    detected_s: float
    recovered_s: float
    worst_in: float


def wrong_beliefs(frames: Frames) -> list[WrongBelief]:
    """Return every episode of a drive in which a wrong pose was believed."""
    times, wrong = frames.time_s, frames.wrong
    right = frames.trusted & ~wrong
    episodes: list[WrongBelief] = []
    at = 0
    while at < len(times):
        starts = np.flatnonzero(wrong[at:])
        if len(starts) == 0:
            break
        first = at + int(starts[0])
        ends = np.flatnonzero(~wrong[first:])
        after = np.flatnonzero(right[first:])
        end = first + int(ends[0]) if len(ends) else len(times)
        mended = first + int(after[0]) if len(after) else len(times)
        began = float(times[first])
        episodes.append(
            WrongBelief(
                began_s=began,
                detected_s=float(times[min(end, len(times) - 1)]) - began,
                recovered_s=float(times[mended]) - began if mended < len(times) else math.inf,
                worst_in=float(np.nanmax(frames.error_in[first:end])),
            )
        )
        at = mended
    return episodes


def longest_gap_s(frames: Frames) -> float:
    """Return the longest time without a good pose after the first one, seconds."""
    good = frames.time_s[frames.trusted]
    if len(good) == 0:
        return math.inf
    ends = np.append(good, frames.time_s[-1])
    period = float(np.median(np.diff(frames.time_s))) if len(frames) > 1 else 0.0
    return max(0.0, float(np.diff(ends).max()) - period)
