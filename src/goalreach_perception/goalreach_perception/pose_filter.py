"""The extended Kalman filter over pose, biases and everything surveyed or measured beforehand.

Odometry predicts, the pixels of all LEDs of an image correct at once: pan and tilt are read once
per image, so their noise is common to its LEDs. The state vector is that of
`measurement_model`. With `calibrate` the surveyed constants (LEDs, camera height, focal length)
are estimated; without it they are considered (Schmidt, "Application of state-space methods to
navigation problems", 1966): never corrected, but their uncertainty and its correlation with the
pose are kept, so the covariance is honest in both cases.

Robot and LEDs turned together, or all of it a little larger, look the same, so no image may make
the filter surer of that. Derivatives taken at ever new estimates do (Huang, Mourikis and
Roumeliotis, "Analysis and improvement of the consistency of extended Kalman filter based SLAM",
ICRA 2008). Here, as they propose, those by the heading keep to the first estimates: LEDs as
surveyed, positions as predicted; and what those lack for a change of size to move no pixel is
laid to the scale of the odometry, which grows with the rest. The others are taken at the best
estimates: near an LED, those of the survey would be wrong by more than a spot is.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import deg, wrap_angle
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.measurement_model import FOCAL, HEIGHT, LEDS, Lens, prior_sigmas
from goalreach_perception.prediction import (
    OdometryMotion,
    Prediction,
    add_to_diagonal,
    innovate,
    left_out_px2,
)
from goalreach_perception.tracking_model import View, expect_leds, offsets_from


class FadingMemory:
    """Takes constants as Ornstein-Uhlenbeck processes around their prior, with a long memory.

    With a = exp(-dt / memory), the mean m becomes m0 + a (m - m0) and the covariance P becomes
    a^2 P + (1 - a^2) P0. So small errors that repeat from image to image do not add up to false
    certainty, and nothing drifts away for ever.

    Args:
        mean: (n,) prior mean.
        sigmas: (n,) prior standard deviations.
        fading: (n,) which states fade.
        memory_s: Time constant.
    """

    def __init__(
        self, mean: FloatArray, sigmas: FloatArray, fading: NDArray[np.bool_], memory_s: float
    ) -> None:
        self._mean = mean.copy()
        self._variance = sigmas**2
        self._fading = fading
        self._memory_s = memory_s
        self._factors: tuple[float, FloatArray, FloatArray, FloatArray] | None = None

    def fade(
        self, mean: FloatArray, covariance: FloatArray, dt_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance after some time; infinite to forget all."""
        if self._factors is None or self._factors[0] != dt_s:
            keep = np.where(self._fading, math.exp(-dt_s / self._memory_s), 1.0)
            back = np.diag((1.0 - keep * keep) * self._variance)
            self._factors = (dt_s, keep, np.outer(keep, keep), back)
        _, keep, keep_both, back = self._factors
        return self._mean + keep * (mean - self._mean), keep_both * covariance + back


@dataclass(frozen=True, kw_only=True)
class FilterConfig:
    """Process noise and gates of the filter."""

    slip_m_per_sqrt_m: float = parameter(
        0.0002,
        'Random part of the odometry, m per square root of a metre (1 sigma; chosen: small beside '
        'the errors of scale and drift, which are states; with five times as much the covariance '
        'was a tenth too large)',
        minimum=0.0,
        maximum=1.0,
    )
    heading_walk_rad_per_sqrt_m: float = parameter(
        deg(0.004),
        'Random part of the heading, rad per square root of a metre (1 sigma; chosen as above)',
        minimum=0.0,
        maximum=1.0,
    )
    memory_s: float = parameter(
        1e5,
        'How long biases and calibration are remembered, s (time constant; chosen: about a day; '
        'then small errors that repeat from image to image do not add up to false certainty)',
        minimum=1.0,
        maximum=1e9,
    )
    led_gate: float = parameter(
        16.0, 'Largest squared distance of one LED from its prediction, 2 dof', minimum=1.0
    )
    joint_gate: float = parameter(
        32.0, 'Largest squared distance of all LEDs of an image together (p = 2e-5)', minimum=1.0
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)


_ROUGHNESS = 1.7
"""Factor on the covariance of a pose after a rough start. Chosen: 1.3 on its sigmas."""
_FADING_STEP_S = 1.0
"""Memory of a day or more fades in steps this long: a 1e-5 of it. Chosen."""


class PoseFilter:
    """An extended Kalman filter in Joseph form, with considered states.

    Args:
        config: Process noise.
        noise: The errors to expect.
        leds_m: (n, 3) surveyed places of the LEDs in `map`.
        camera_height_m: Nominal height of the optical centre.
        calibrate: Whether the surveyed constants are estimated too.

    Attributes:
        mean: The state vector.
        covariance: Its covariance.
        accepted: Squared distance and degrees of freedom of the last pixels that corrected it:
            its normalized innovation squared, for studies of consistency.
        rough: Whether the last pose it started from was.
    """

    def __init__(
        self,
        config: FilterConfig,
        noise: NoiseModel,
        *,
        leds_m: FloatArray,
        camera_height_m: float,
        calibrate: bool,
    ) -> None:
        self._config = config
        self._camera_height_m = camera_height_m
        self._calibrate = calibrate
        self._encoder_sigma_rad = noise.pan_tilt_noise_rad
        size = LEDS + leds_m.size
        self._motion = OdometryMotion(size)
        self.mean: FloatArray = np.zeros(size)
        self.mean[LEDS:] = leds_m.reshape(-1)
        sigmas = prior_sigmas(noise, len(leds_m))
        self.covariance = np.diag(sigmas**2)
        fading = sigmas > 0.0
        if not calibrate:
            fading[HEIGHT:] = False
        self._memory = FadingMemory(self.mean, sigmas, fading, config.memory_s)
        self._unfaded_s = 0.0
        self._surveyed_m: list[float] = leds_m.reshape(-1).tolist()
        self._before: tuple[FloatArray, FloatArray] = self.mean, self.covariance
        self.accepted = (0.0, 0)
        self.rough = False

    @property
    def joint_gate(self) -> float:
        """Largest squared distance at which an image corrects the state."""
        return self._config.joint_gate

    @property
    def pose(self) -> Pose2:
        """The mean pose."""
        x_m, y_m, heading_rad = self.mean[:3].tolist()
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def pose_covariance(self) -> FloatArray:
        """The covariance of x, y, heading, (3, 3); wider than it would be after a rough start."""
        return (_ROUGHNESS if self.rough else 1.0) * self.covariance[:3, :3]

    @property
    def leds_m(self) -> FloatArray:
        """The believed places of the LEDs, (n, 3)."""
        return self.mean[LEDS:].reshape(-1, 3)

    @property
    def camera_height_m(self) -> float:
        """The believed height of the optical centre."""
        return self._camera_height_m + float(self.mean[HEIGHT])

    @property
    def led_offsets_m(self) -> list[tuple[float, float, float]]:
        """The believed LEDs minus the believed optical centre, n times x, y, z."""
        state = self.mean.tolist()
        return offsets_from(
            state[LEDS:], state[0], state[1], self._camera_height_m + state[HEIGHT]
        )

    @property
    def focal_error(self) -> float:
        """The believed relative error of the focal length."""
        return float(self.mean[FOCAL])

    def start(self, pose: Pose2, covariance: FloatArray, *, rough: bool = False) -> None:
        """Take a new pose; what is known of everything else stays.

        Args:
            pose: The pose.
            covariance: (3, 3) of x, y, heading; taken as independent of everything else.
            rough: Whether a linear filter leaves much out of it: from two LEDs, several images.
        """
        self.rough = rough
        self._before = self.mean.copy(), self.covariance.copy()
        self.mean[:3] = pose.x_m, pose.y_m, wrap_angle(pose.heading_rad)
        self._motion.begin_at(pose.x_m, pose.y_m)
        self.covariance[:3, :] = 0.0
        self.covariance[:, :3] = 0.0
        self.covariance[:3, :3] = covariance

    def recall(self) -> None:
        """Go back to what was known before the last start, which is to be made anew."""
        self.mean, self.covariance = self._before

    def forget(self, dt_s: float) -> None:
        """Let what was learnt about constants fade; see `FadingMemory`.

        Args:
            dt_s: Time since the last image; infinite to forget all.
        """
        self._unfaded_s += dt_s
        if self._unfaded_s >= _FADING_STEP_S:
            self.mean, self.covariance = self._memory.fade(
                self.mean, self.covariance, self._unfaded_s
            )
            self._unfaded_s = 0.0

    def predict(self, before: Pose2, after: Pose2) -> None:
        """Move by what the odometry moved.

        Args:
            before: Odometry pose at the last image.
            after: Odometry pose now, in the same frame.
        """
        distance = self._motion.move(self.mean, before, after)
        covariance = self._motion.carry(self.covariance)
        position_var = self._config.slip_m_per_sqrt_m**2 * distance
        covariance[0, 0] += position_var
        covariance[1, 1] += position_var
        covariance[2, 2] += self._config.heading_walk_rad_per_sqrt_m**2 * distance
        self.covariance = covariance

    def expect(self, lens: Lens, joints: HeadAngles, *, solved: bool = False) -> Prediction:
        """Return where the LEDs should be.

        Args:
            lens: The nominal lens.
            joints: Encoder readings of the head.
            solved: Whether the pose was just solved for this very image.
        """
        x_m, y_m, heading, pan_bias, tilt_bias, _, _, _, focal = self.mean[:LEDS].tolist()
        azimuth = heading + joints.turret_rad + joints.pan_rad + pan_bias
        view = View(azimuth, joints.tilt_rad + tilt_bias, lens, focal)
        first_m = offsets_from(self._surveyed_m, x_m, y_m, self._camera_height_m)
        expected = expect_leds(self.led_offsets_m, view, first_m)
        jacobian, depth_m = expected.by_state, expected.depth_m
        cross = self.covariance.dot(jacobian.T)
        encoders = expected.by_head * self._encoder_sigma_rad
        noise = encoders.dot(encoders.T)
        if not solved:
            variances = self.covariance.diagonal().tolist()
            spread_m2 = variances[0] + variances[1], variances[HEIGHT]
            left_out = left_out_px2(
                depth_m, lens.numbers[0], spread_m2, encoder_sigma_rad=self._encoder_sigma_rad
            )
            add_to_diagonal(noise, left_out)
        covariance = jacobian.dot(cross) + noise
        return Prediction(expected.pixels_px, depth_m, jacobian, cross, noise, covariance)

    def correct(
        self,
        prediction: Prediction,
        leds: NDArray[np.intp],
        pixels_px: FloatArray,
        sigmas_px: FloatArray,
    ) -> float:
        """Correct the state by the LEDs of one image, if they fit together.

        Args:
            prediction: What `expect` returned for this image.
            leds: (k,) which LEDs are seen, at least one.
            pixels_px: (k, 2) where.
            sigmas_px: (k,) how sure, per axis.

        Returns:
            The squared distance of the pixels from their prediction, 2 k degrees of freedom; the
            state is unchanged where it is above the joint gate.
        """
        part = prediction.of_leds(leds)
        innovation, spots, inverse, distance2 = innovate(part, pixels_px, sigmas_px)
        if not distance2 <= self._config.joint_gate:
            return distance2
        self.accepted = (distance2, len(spots))
        gain = part.cross.dot(inverse)
        if not self._calibrate:
            gain[HEIGHT:] = 0.0
        self.mean += gain.dot(innovation)
        self.mean[2] = wrap_angle(float(self.mean[2]))
        noise = part.encoder_noise.copy()
        add_to_diagonal(noise, spots)
        # Joseph form, L P L' + K R K' with L = I - K J, where P J' is the cross-covariance.
        left = self.covariance - gain.dot(part.cross.T)
        unbalanced = left.dot(part.jacobian.T) - gain.dot(noise)
        self.covariance = left - unbalanced.dot(gain.T)
        cv2.completeSymm(self.covariance)
        return distance2
