"""The delay of the images behind odometry and joints, as a state of the filter.

An image whose stamp is late by d shows what the camera saw when the joints stood where they were
d earlier. Odometry and joints are therefore read at the stamp minus the estimated delay, and the
derivative of a pixel by the error of that estimate is minus its rate, by the motion of robot and
head. While the delay is uncertain, that rate is the slope of the chord over the times at which the
image may have been exposed, and the distance of the path from its chord counts as noise of pan and
tilt (a statistical linearization: Gelb, "Applied Optimal Estimation", 1974, section 6.2).

Where head and base rest, nothing tells the delay: rates below the noise of the encoders count as
none, or that noise, which the innovation shares, would be taken for a delay.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from goalreach_msgs_py.alignment import Sample, Sampled
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import MOUNT
from goalreach_perception.measurement_prediction import PredictedLeds

_SETTLED_S: Final = 0.005
"""A delay of this standard deviation is known. Chosen: a head that turns at 90 deg/s turns by half
a degree in it."""
_SPAN_S: Final = 0.04, 0.15
"""Shortest and longest time over which rates are measured. Chosen: the period of a camera, and how
late webcams are; of settled delays a quarter, from one image to the next."""
_RESTS_RAD_PER_S, _RESTS_SIGMAS = 0.2, 2.0
"""A slower rate counts as none, if what the uncertain delay makes of it is less than so many
standard deviations of an encoder. Chosen: 7 sigmas of a rate from two readings."""
_TOLD_S, _TOLD_SIGMAS = 0.002, 3.0
_REACH_S: Final = -0.05, 0.25
"""How much less or more than given a delay may be. Chosen."""


class DelayEstimate(NamedTuple):
    """The delay of the images: as given, as estimated, standard deviation of the estimate."""

    given_s: float
    estimate_s: float
    sigma_s: float

    @property
    def is_settled(self) -> bool:
        """Whether it is known well enough for images to prove other errors."""
        return self.sigma_s <= _SETTLED_S

    @property
    def advice(self) -> str:
        """Which parameter to write, where a settled estimate differs from what was given."""
        off_s = abs(self.estimate_s - self.given_s)
        if self.sigma_s > _TOLD_S or off_s <= _TOLD_SIGMAS * self.sigma_s:
            return ''
        late, sigma, given = (f'{1e3 * s:.1f}' for s in (*self[1:], self.given_s))
        return (
            f'images are {late} +- {sigma} ms late, {given} ms were given; poses allow for it: '
            f'write camera_delay_s: {self.estimate_s:.4f}'
        )


class ImageMotion(NamedTuple):
    """How robot and camera moved when an image was exposed.

    Attributes:
        delay_s: How long before its stamp that was, as far as odometry and joints were read.
        velocity_m_per_s: Velocity of the robot, forward and to the left.
        turn_rad_per_s: Rates of the azimuth and the tilt of the optical axis.
        bend_rad: How far azimuth and tilt are from those of constant rates.
    """

    delay_s: float
    velocity_m_per_s: tuple[float, float] = (0.0, 0.0)
    turn_rad_per_s: tuple[float, float] = (0.0, 0.0)
    bend_rad: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def between(
        cls, delay_s: float, span_s: float, old: Sample, new: Sample, middle: Sample | None = None
    ) -> ImageMotion:
        """Return the motion over a time, by joints and odometry at its beginning and its end.

        Those in its middle, if known, tell how the rates change.
        """
        then, now = old[1], new[1]
        turn, rise = turned(old, new)
        half, half_rise = (0.5 * turn, 0.5 * rise) if middle is None else turned(old, middle)
        dx, dy = now.pose.x_m - then.pose.x_m, now.pose.y_m - then.pose.y_m
        ahead, aside = math.cos(now.pose.heading_rad), math.sin(now.pose.heading_rad)
        velocity = (ahead * dx + aside * dy) / span_s, (ahead * dy - aside * dx) / span_s
        bend = abs(half - 0.5 * turn), abs(half_rise - 0.5 * rise)
        return cls(delay_s, velocity, (turn / span_s, rise / span_s), bend)

    def pose_rates(self, heading_rad: float) -> tuple[float, float, float]:
        """Return the rates of x, y in `map`, and of the azimuth of the optical axis."""
        (ahead, aside), turn = self.velocity_m_per_s, self.turn_rad_per_s[0]
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        return cosine * ahead - sine * aside, sine * ahead + cosine * aside, turn

    def head_sigmas_rad(self, encoder_sigma_rad: float) -> FloatArray:
        """Return the noise (2,) of pan and tilt: of their encoders, and of changing rates."""
        return np.array([math.hypot(encoder_sigma_rad, bend) for bend in self.bend_rad])


class ImageDelay:
    """Reads joints and odometry when images were exposed, by the delay that is given at first."""

    def __init__(self, given_s: float) -> None:
        self.given_s = given_s
        self._last: tuple[int, Sample] | None = None

    def read(
        self, time_ns: int, sampled: Sampled, delay: DelayEstimate | None
    ) -> tuple[int, Sample, ImageMotion | None]:
        """Return when an image was exposed, what was read then, and how the camera moved.

        Without an estimate of the delay it is taken as given, and no motion is returned.
        """
        low_s, high_s = self.given_s + _REACH_S[0], self.given_s + _REACH_S[1]
        delay_s = self.given_s if delay is None else min(max(delay.estimate_s, low_s), high_s)
        exposed_ns = time_ns - round(delay_s * 1e9)
        now, last = sampled(exposed_ns), self._last
        self._last = exposed_ns, now
        if delay is None:
            return exposed_ns, now, None
        if last and delay.is_settled and _SPAN_S[0] < 4e-9 * (exposed_ns - last[0]) < _SPAN_S[1]:
            motion = ImageMotion.between(delay_s, 1e-9 * (exposed_ns - last[0]), last[1], now)
            return exposed_ns, now, motion
        span_s = min(max(2.0 * delay.sigma_s, _SPAN_S[0]), _SPAN_S[1])
        then, middle = (sampled(exposed_ns - round(part * span_s)) for part in (1e9, 5e8))
        return exposed_ns, now, ImageMotion.between(delay_s, span_s, then, now, middle)


def turned(one: Sample, other: Sample) -> tuple[float, float]:
    """Return how far azimuth and tilt of the camera turn from one sample to another."""
    (a, start), (b, end) = one, other
    turn = b.turret_rad + b.pan_rad + end.pose.heading_rad
    turn -= a.turret_rad + a.pan_rad + start.pose.heading_rad
    return math.remainder(turn, math.tau), b.tilt_rad - a.tilt_rad


def delayed(
    predicted: PredictedLeds,
    motion: ImageMotion,
    delay: DelayEstimate,
    heading_rad: float,
    encoder_sigma_rad: float,
) -> PredictedLeds:
    """Return a prediction for images of an estimated delay, with the derivative by it."""
    unseen = _RESTS_SIGMAS * encoder_sigma_rad
    turns = [
        0.0 if abs(rate) < _RESTS_RAD_PER_S and abs(rate) * delay.sigma_s < unseen else rate
        for rate in motion.turn_rad_per_s
    ]
    by_state = predicted.by_state
    rates = by_state[:, :2].dot(motion.pose_rates(heading_rad)[:2]) + predicted.by_head.dot(turns)
    pixels_px = predicted.pixels_px - rates.reshape(-1, 2) * (delay.estimate_s - motion.delay_s)
    columns = by_state[:, :MOUNT], -rates[:, None], by_state[:, MOUNT:]
    return predicted._replace(pixels_px=pixels_px, by_state=np.concatenate(columns, axis=1))
