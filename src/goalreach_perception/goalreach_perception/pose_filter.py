"""The extended Kalman filter over pose, biases and surveyed constants.

Odometry predicts; the pixels of all LEDs of an image correct in one update, since pan and tilt are
read once per image and their noise is common to its LEDs. The state vector is that of
`measurement_model`. With `calibrate` the surveyed constants (LEDs, camera height, focal length)
are estimated; without it they are considered (Schmidt, "Application of state-space methods to
navigation problems", 1966): never corrected, but with their uncertainty and its correlation with
the pose, so the covariance is consistent in both cases.

A rotation of robot and LEDs together, and a change of their common scale, are unobservable.
Derivatives taken at each new estimate let the filter gain information about them all the same
(Huang, Mourikis and Roumeliotis, "Analysis and improvement of the consistency of extended Kalman
filter based SLAM", ICRA 2008). As they propose, the derivatives by the heading are taken at the
first estimates: LEDs as surveyed, positions as predicted. The remainder that keeps the scale
unobservable goes to the column of the odometry scale, which changes with it. All other derivatives
are taken at the best estimates: near an LED, those at the survey would be wrong by more than the
size of a spot.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import deg, wrap_angle
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.measurement_model import FOCAL, HEIGHT, LEDS, Lens, prior_sigmas
from goalreach_perception.measurement_prediction import (
    Prediction,
    add_to_diagonal,
    compute_innovation,
    offsets_from,
    predict_leds,
    second_order_variances_px2,
)
from goalreach_perception.process_model import FadingMemory, OdometryModel


@dataclass(frozen=True, kw_only=True)
class FilterConfig(Configuration):
    """Process noise and gates of the filter."""

    slip_m_per_sqrt_m: float = parameter(
        0.0002,
        'Random part of the odometry, m per square root of a metre (1 sigma; chosen: small beside '
        'the errors of scale and drift, which are states; with five times as much the covariance '
        'was a tenth too large)',
        within=(0.0, 1.0),
    )
    heading_walk_rad_per_sqrt_m: float = parameter(
        deg(0.004),
        'Random part of the heading, rad per square root of a metre (1 sigma; chosen as above)',
        within=(0.0, 1.0),
    )
    memory_s: float = parameter(
        1e5,
        'Time constant with which biases and calibration return to their prior, s (chosen: about '
        'a day; small errors that repeat from image to image then do not cause false certainty)',
        within=(1.0, 1e9),
    )
    led_gate: float = parameter(
        16.0, 'Largest squared distance of one LED from its prediction, 2 dof', within=(1.0, None)
    )
    joint_gate: float = parameter(
        32.0,
        'Largest squared distance of all LEDs of an image together (p = 2e-5)',
        within=(1.0, None),
    )


_COARSE_INFLATION = 1.7
"""Factor on the covariance of a pose after a coarse start: 1.3 on its sigmas. Chosen."""
_FADING_STEP_S = 1.0
"""Interval of the fading of constants: 1e-5 of a memory of a day. Chosen."""


class PoseFilter:
    """An extended Kalman filter in Joseph form, with considered states.

    Args:
        config: Process noise.
        noise: Expected errors.
        leds_m: (n, 3) surveyed positions of the LEDs in `map`.
        camera_height_m: Nominal height of the optical centre.
        calibrate: Whether to estimate the surveyed constants too.

    Attributes:
        mean: The state vector.
        covariance: Its covariance.
        last_innovation: Normalized innovation squared of the last correction, and its degrees of
            freedom; for studies of consistency.
        coarse: Whether the pose was initialized from too little for a linear filter.
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
        self._motion = OdometryModel(size)
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
        self.last_innovation = (0.0, 0)
        self.coarse = False

    @property
    def joint_gate(self) -> float:
        """Largest normalized innovation squared at which an image corrects the state."""
        return self._config.joint_gate

    @property
    def pose(self) -> Pose2:
        """The mean pose."""
        x_m, y_m, heading_rad = self.mean[:3].tolist()
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def pose_covariance(self) -> FloatArray:
        """The covariance of x, y, heading, (3, 3), inflated after a coarse start."""
        return (_COARSE_INFLATION if self.coarse else 1.0) * self.covariance[:3, :3]

    @property
    def leds_m(self) -> FloatArray:
        """The estimated positions of the LEDs, (n, 3)."""
        return self.mean[LEDS:].reshape(-1, 3)

    @property
    def camera_height_m(self) -> float:
        """The estimated height of the optical centre."""
        return self._camera_height_m + float(self.mean[HEIGHT])

    @property
    def led_offsets_m(self) -> list[tuple[float, float, float]]:
        """The estimated LEDs minus the estimated optical centre, n times x, y, z."""
        state = self.mean.tolist()
        return offsets_from(
            state[LEDS:], state[0], state[1], self._camera_height_m + state[HEIGHT]
        )

    @property
    def focal_error(self) -> float:
        """The estimated relative error of the focal length."""
        return float(self.mean[FOCAL])

    def start(self, pose: Pose2, covariance: FloatArray, *, coarse: bool = False) -> None:
        """Initialize the pose; the estimates of all constants stay.

        Args:
            pose: The pose.
            covariance: (3, 3) of x, y, heading; independent of all other states.
            coarse: Whether the pose is too uncertain to linearize about: it comes from two LEDs or
                from several images.
        """
        self.coarse = coarse
        self._before = self.mean.copy(), self.covariance.copy()
        self.mean[:3] = pose.x_m, pose.y_m, wrap_angle(pose.heading_rad)
        self._motion.restart(pose.x_m, pose.y_m)
        self.covariance[:3, :] = 0.0
        self.covariance[:, :3] = 0.0
        self.covariance[:3, :3] = covariance

    def restore(self) -> None:
        """Restore the state from before the last start, to start again from a better pose."""
        self.mean, self.covariance = self._before

    def fade(self, dt_s: float) -> None:
        """Let the estimates of constants fade towards their prior; see `FadingMemory`.

        Args:
            dt_s: Time since the last image; infinite to restore the prior.
        """
        self._unfaded_s += dt_s
        if self._unfaded_s >= _FADING_STEP_S:
            self.mean, self.covariance = self._memory.fade(
                self.mean, self.covariance, self._unfaded_s
            )
            self._unfaded_s = 0.0

    def predict(self, before: Pose2, after: Pose2) -> None:
        """Predict the pose by the motion of the odometry.

        Args:
            before: Odometry pose at the last image.
            after: Odometry pose now, in the same frame.
        """
        distance = self._motion.propagate_mean(self.mean, before, after)
        covariance = self._motion.propagate_covariance(self.covariance)
        position_var = self._config.slip_m_per_sqrt_m**2 * distance
        covariance[0, 0] += position_var
        covariance[1, 1] += position_var
        covariance[2, 2] += self._config.heading_walk_rad_per_sqrt_m**2 * distance
        self.covariance = covariance

    def predict_leds(self, lens: Lens, joints: HeadAngles, *, solved: bool = False) -> Prediction:
        """Predict the pixels of the LEDs.

        Args:
            lens: The nominal lens.
            joints: Encoder readings of the head.
            solved: Whether the pose is a solution of this image, so that linearization about it
                is exact enough.
        """
        x_m, y_m, heading, pan_bias, tilt_bias, _, _, _, focal = self.mean[:LEDS].tolist()
        azimuth = heading + joints.turret_rad + joints.pan_rad + pan_bias
        fx, fy, cx, cy = lens.intrinsics
        intrinsics_px = fx * (1.0 + focal), fy * (1.0 + focal), cx, cy
        first_m = offsets_from(self._surveyed_m, x_m, y_m, self._camera_height_m)
        axis_rad = azimuth, joints.tilt_rad + tilt_bias
        predicted = predict_leds(self.led_offsets_m, first_m, axis_rad, intrinsics_px)
        jacobian, depth_m = predicted.by_state, predicted.depth_m
        cross = self.covariance.dot(jacobian.T)
        encoders = predicted.by_head * self._encoder_sigma_rad
        noise = encoders.dot(encoders.T)
        if not solved:
            variances = self.covariance.diagonal().tolist()
            spread_m2 = variances[0] + variances[1], variances[HEIGHT]
            neglected = second_order_variances_px2(
                depth_m, fx, spread_m2, encoder_sigma_rad=self._encoder_sigma_rad
            )
            add_to_diagonal(noise, neglected)
        covariance = jacobian.dot(cross) + noise
        return Prediction(predicted.pixels_px, depth_m, jacobian, cross, noise, covariance)

    def correct(
        self,
        prediction: Prediction,
        leds: NDArray[np.intp],
        pixels_px: FloatArray,
        sigmas_px: FloatArray,
    ) -> float:
        """Correct the state by the LEDs of one image, if they pass the joint gate.

        Args:
            prediction: Result of `predict_leds` for this image.
            leds: (k,) indices of the measured LEDs, at least one.
            pixels_px: (k, 2) their ideal pixels.
            sigmas_px: (k,) standard deviation per axis.

        Returns:
            The normalized innovation squared, 2 k degrees of freedom; the state is unchanged if
            it is above the joint gate.
        """
        part = prediction.select(leds)
        innovation, spots, inverse, distance2 = compute_innovation(part, pixels_px, sigmas_px)
        if not distance2 <= self._config.joint_gate:
            return distance2
        self.last_innovation = (distance2, len(spots))
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
