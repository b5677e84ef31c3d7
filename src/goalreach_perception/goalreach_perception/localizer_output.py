"""The output of the localizer for one image."""

import math
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.values import HeadAngles, LandmarkObservation, Pose2, PoseEstimate
from goalreach_perception.image_delay import DelayEstimate
from goalreach_perception.landmark_tracking import MatchedLeds


class LocalizerCounters(NamedTuple):
    """Counts of events since the start.

    Attributes:
        frames: Images used.
        refused: Invalid inputs.
        corrections: Images that corrected the filter.
        gated: Images whose LEDs failed the gate of the filter.
        acquired: Starts of the filter from a fix.
        lost: Losses of the pose.
        contradicted: Failed checks of the filter against one image alone.
    """

    frames: int = 0
    refused: int = 0
    corrections: int = 0
    gated: int = 0
    acquired: int = 0
    lost: int = 0
    contradicted: int = 0


AT_REST = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)


class LocalizerOutput(NamedTuple):
    """Pose and landmarks of one image.

    Attributes:
        estimate: The pose in `map`; without one, the uniform distribution over the arena.
        landmarks: One entry per LED, then per corner of each tag; None if it was not detected.
        mode: 'searching', 'confirming' (a pose from one image, to be confirmed by more),
            'tracking', 'doubtful' (predicted LEDs are not detected, or what was seen in the search
            tells against the model) or 'refused' (invalid input).
        reason: Why the mode is not 'tracking'; empty while it is.
        misfit: What in the model does not fit and what to check; empty while it fits.
        seen_from: Pose and joints when the image was exposed.
        delay: Delay of the images, where it is estimated.
    """

    estimate: PoseEstimate
    landmarks: tuple[LandmarkObservation | None, ...]
    mode: str
    reason: str
    counters: LocalizerCounters
    misfit: str = ''
    seen_from: tuple[Pose2, HeadAngles] = (Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0), AT_REST)
    delay: DelayEstimate | None = None

    @property
    def diagnostics(self) -> dict[str, object]:
        """Mode, reason and counters by name; misfit and delay where there is one."""
        values = {'mode': self.mode, 'reason': self.reason, **self.counters._asdict()}
        if self.misfit:
            values['misfit'] = self.misfit
        if self.delay:
            values['camera_delay_s'] = f'{self.delay.estimate_s:.4f}'
            values['camera_delay_sigma_s'] = f'{self.delay.sigma_s:.4f}'
        return values


def uniform_estimate(width_m: float, length_m: float) -> PoseEstimate:
    """Return the pose estimate uniform over an arena and all headings."""
    variances = [width_m**2 / 12.0, length_m**2 / 12.0, math.pi**2 / 3.0]
    middle = Pose2(x_m=0.5 * width_m, y_m=0.5 * length_m, heading_rad=0.0)
    return PoseEstimate(pose=middle, covariance=np.diag(variances))


def observations(
    matched: MatchedLeds | None, led_count: int
) -> tuple[LandmarkObservation | None, ...]:
    """Return the observation of each LED, None if it was not detected."""
    landmarks: list[LandmarkObservation | None] = [None] * led_count
    if matched is not None:
        places, peaks = matched.spots.pixels_px.tolist(), matched.spots.peaks_dn
        for led, (u, v), peak in zip(matched.leds.tolist(), places, peaks, strict=True):
            landmarks[led] = LandmarkObservation(u_px=u, v_px=v, peak_dn=float(peak))
    return tuple(landmarks)
