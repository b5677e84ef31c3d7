"""What the localizer answers to one image."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.values import HeadAngles, LandmarkObservation, Pose2, PoseEstimate
from goalreach_perception.landmark_tracking import MatchedLeds


class LocalizerCounters(NamedTuple):
    """What happened since the start.

    Attributes:
        frames: Images used.
        refused: Inputs that could not be used.
        corrections: Images that corrected the filter.
        gated: Images whose LEDs did not fit the filter.
        acquired: Fixes from one image that started the filter.
        lost: Times the pose was given up.
        contradicted: Checks against one image alone that the filter failed.
    """

    frames: int = 0
    refused: int = 0
    corrections: int = 0
    gated: int = 0
    acquired: int = 0
    lost: int = 0
    contradicted: int = 0


class LocalizerOutput(NamedTuple):
    """What one image led to.

    Attributes:
        estimate: The pose in `map`; while there is none, the middle of the arena with the
            covariance of "anywhere in it, any heading".
        landmarks: One entry per LED; None where it was not seen.
        head_command: Joint targets.
        mode: 'searching', 'confirming' (a pose from one image, not yet believed), 'tracking',
            'doubtful' (nothing is where it should be) or 'refused' (the input is unusable).
        reason: Why the mode is not 'tracking', or an empty text.
        counters: What happened since the start.
    """

    estimate: PoseEstimate
    landmarks: tuple[LandmarkObservation | None, ...]
    head_command: HeadAngles
    mode: str
    reason: str
    counters: LocalizerCounters

    @property
    def diagnostics(self) -> dict[str, object]:
        """Mode, reason and counters by name, for people."""
        return {'mode': self.mode, 'reason': self.reason, **self.counters._asdict()}


def uniform_estimate(width_m: float, length_m: float) -> PoseEstimate:
    """Return the pose of a robot that may be anywhere in an arena, with any heading.

    Args:
        width_m: Arena size along x.
        length_m: Arena size along y.
    """
    variances = [width_m**2 / 12.0, length_m**2 / 12.0, math.pi**2 / 3.0]
    middle = Pose2(x_m=0.5 * width_m, y_m=0.5 * length_m, heading_rad=0.0)
    return PoseEstimate(pose=middle, covariance=np.diag(variances))


def observations(
    seen: MatchedLeds | None, led_count: int
) -> tuple[LandmarkObservation | None, ...]:
    """Return where each LED was seen, None where it was not.

    Args:
        seen: The LEDs found in an image, or None.
        led_count: How many there are.
    """
    landmarks: list[LandmarkObservation | None] = [None] * led_count
    if seen is not None:
        places, peaks = seen.spots.pixels_px.tolist(), seen.spots.peaks_dn
        for led, (u, v), peak in zip(seen.leds.tolist(), places, peaks, strict=True):
            landmarks[led] = LandmarkObservation(u_px=u, v_px=v, peak_dn=float(peak))
    return tuple(landmarks)
