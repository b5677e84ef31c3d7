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
filter based SLAM", ICRA 2008). As they propose, the derivatives by heading and level are taken at
the first estimates: LEDs as surveyed, positions as predicted. The remainder that keeps the scale
unobservable goes to the column of the odometry scale, which changes with it. All other derivatives
are taken at the best estimates: near an LED, those at the survey would be wrong by more than the
size of a spot.
"""

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.tags import Tag
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.image_delay import DelayEstimate, ImageMotion, delayed
from goalreach_perception.measurement_model import (
    DELAY,
    FOCAL,
    HEIGHT,
    LEDS,
    LEVEL,
    MOUNT,
    SLIP,
    Lens,
    prior_covariance,
    state_name,
)
from goalreach_perception.measurement_prediction import (
    Prediction,
    add_to_diagonal,
    compute_innovation,
    equivalent_gate,
    offsets_from,
    predict_leds,
    second_order_variances_px2,
)
from goalreach_perception.misfit import ConstantsWatch, InnovationWatch
from goalreach_perception.process_model import (
    FadingMemory,
    FilterConfig,
    OdometryConfig,
    OdometryModel,
)

_STARTED = [0, 1, 2, LEVEL, LEVEL + 1]
_GATED = 6
"""Degrees of freedom of `joint_gate`: three LEDs."""
_SURVEY_M, _SUSPECT_M = 0.1, 0.03
"""Added uncertainty of a position by a survey, or another constant, that does not fit. Chosen."""
_LARGEST_GROWTH = 1000.0
"""Largest growth of variances where the model does not fit. Chosen: 2 mm become 63 mm."""
_LARGEST_COARSE_GROWTH = 9.0
"""Largest growth of variances at which a coarse pose may be right: sigmas three times as large as
those of the parameters. Chosen."""
_COARSE_INFLATION = np.outer([1.0, 1.0, 1.3], [1.0, 1.0, 1.3])
"""Factors on the covariance after a coarse start: 1.3 on the sigma of the heading. Chosen."""
_COARSE_SURVEY_M = 0.045
"""Added uncertainty of a coarse position until an image of three LEDs confirms it: a panorama fits
a survey that is wrong by 4 in as well. Chosen: a tenth below what a state accepts."""
_DELAY_WALK_S = 0.0005
"""Random walk of the delay, s in the square root of a second: clocks drift. Chosen."""
_FADING_STEP_S = 1.0
"""Interval of the fading of constants, small beside their memory. Chosen."""


class PoseFilter:
    """An extended Kalman filter in Joseph form, with considered states.

    Args:
        config: Process noise.
        noise: Expected errors.
        leds_m: (n, 3) surveyed positions of the LEDs in `map`; the corners of the tags follow.
        camera_height_m: Nominal height of the optical centre.
        calibrate: Whether to estimate the surveyed constants too.
        mount_m: Nominal place of the optical centre from the vertical axis: forward, left.
        tags: The tags.
        odometry: Known errors of the odometry; None for none.
        delay_s: The delay of the images that was given, where it is to be estimated; else None.
        base_turns: Whether the base turns with the heading, as that of a synchro drive does not.

    Attributes:
        last_innovation: Normalized innovation squared of the last correction, and its degrees of
            freedom; for studies of consistency.
        coarse: Whether the pose was initialized from too little for a linear filter.
        doubt: 1 once a pose was contradicted; it fades, and a jump of the odometry clears it.
        motion: How the camera moves, kept up to date by the user where the delay is estimated.
    """

    def __init__(
        self,
        config: FilterConfig,
        noise: NoiseModel,
        *,
        leds_m: FloatArray,
        camera_height_m: float,
        calibrate: bool,
        mount_m: tuple[float, float] = (0.0, 0.0),
        tags: Sequence[Tag] = (),
        odometry: OdometryConfig | None = None,
        delay_s: float | None = None,
        base_turns: bool = False,
    ) -> None:
        self._config, self._calibrate, self._tags = config, calibrate, tags
        self.motion = None if delay_s is None else ImageMotion(delay_s)
        self._camera_height_m, self._mount_m = camera_height_m, mount_m
        self._encoder_sigma_rad = noise.pan_tilt_noise_rad
        after = config.sigmas_after_landmarks(delay=delay_s is not None)
        self.covariance = prior_covariance(noise, len(leds_m), tags, after)
        sigmas = np.sqrt(self.covariance.diagonal())
        leds_m = np.concatenate([leds_m, *(tag.corners_m for tag in tags)])
        self._motion = OdometryModel(len(sigmas), odometry, base_turns=base_turns)
        row, column = np.indices(self.covariance.shape)
        self._upper = np.minimum(row, column) * len(sigmas) + np.maximum(row, column)
        self.mean: FloatArray = np.zeros(len(sigmas))
        self._places = slice(LEDS, len(sigmas) - len(after))
        self.mean[self._places] = leds_m.reshape(-1)
        if delay_s is not None:
            self.mean[DELAY] = self._given_delay_s = delay_s
        self._motion.set_known_errors(self.mean)
        fading = sigmas > 0.0
        fading[HEIGHT:SLIP] &= calibrate
        self._memory = FadingMemory(self.mean, self.covariance, fading, config.memory_s)
        self._surveyed_m: list[float] = leds_m.reshape(-1).tolist()
        self._before: tuple[FloatArray, FloatArray] = self.mean, self.covariance
        self.last_innovation, self.coarse, self.doubt = (0.0, 0), False, 0.0
        self._watch, self._unfaded_s = InnovationWatch(), 0.0
        self._growth_before = 1.0
        self._suspects = ConstantsWatch(self.mean, sigmas, self._places)

    def joint_gate(self, landmarks: int) -> float:
        """Return the largest normalized innovation squared of an image that corrects the state."""
        return equivalent_gate(self._config.joint_gate, _GATED, 2 * landmarks)

    @property
    def fits(self) -> bool:
        """Whether no innovation has contradicted the covariance, and no constant is suspect."""
        return self._memory.growth == 1.0 and not self._suspects.suspect

    @property
    def misfit(self) -> str:
        """What does not fit, and what to check; empty where all fits."""
        if self.fits:
            return ''
        suspect, landmarks = self._suspects.suspect, len(self._surveyed_m) // 3
        name = state_name(suspect, len(self.mean), landmarks, self._tags)
        first, grew = f'{name} first, ' if suspect else '', self._memory.growth**0.5
        return (
            f'the model does not fit the images, sigmas grew {grew:.1f} times: check '
            f'{first}camera_mount, landmarks_m, camera_info, wheel slip, signs of joints'
        )

    def _grows(self, distance2: float, freedom: int) -> bool:
        """Let the covariance grow where innovations contradict it; return whether it did."""
        if self.is_unsettled:
            return False
        limit = _LARGEST_GROWTH / self._memory.growth
        growth = min(self._watch.add(distance2, freedom), limit)
        if growth > 1.0:
            self._memory.growth *= growth
            self.covariance *= growth
        return growth > 1.0

    @property
    def pose(self) -> Pose2:
        """The mean pose."""
        x_m, y_m, heading_rad = self.mean[:3].tolist()
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def pose_covariance(self) -> FloatArray:
        """The covariance of x, y, heading, (3, 3), larger after a coarse start.

        Once the survey has not fitted, the frame `map` itself is uncertain; another constant that
        does not fit adds less.
        """
        covariance = self.covariance[:3, :3].copy()
        if self.coarse:
            covariance *= _COARSE_INFLATION
        added_m = _COARSE_SURVEY_M * (1.0 if self.coarse else self.doubt)
        if self._suspects.suspect:
            added_m = max(added_m, _SURVEY_M if self._suspects.is_place else _SUSPECT_M)
        covariance[[0, 1], [0, 1]] += added_m**2
        return covariance

    @property
    def is_unsettled(self) -> bool:
        """Whether images may be late by so uncertain a time that they prove nothing else."""
        return (delay := self.delay) is not None and not delay.is_settled

    @property
    def late_rad(self) -> float:
        """How far the optical axis turns, signed, in a standard deviation of the delay."""
        if self.motion is None or (delay := self.delay) is None:
            return 0.0
        return self.motion.turn_rad_per_s[0] * delay.sigma_s

    @property
    def surveyed_covariance(self) -> FloatArray:
        """The covariance without the delay of the images."""
        if self.motion is None:
            return self.covariance
        return np.delete(np.delete(self.covariance, DELAY, axis=0), DELAY, axis=1)

    @property
    def leds_m(self) -> FloatArray:
        """The estimated positions of the LEDs, (n, 3)."""
        return self.mean[self._places].reshape(-1, 3)

    @property
    def mount_m(self) -> tuple[float, float]:
        """The estimated place of the optical centre from the axis: forward and left, at tilt 0."""
        forward, left = self.mean[MOUNT:SLIP].tolist()
        return self._mount_m[0] + forward, self._mount_m[1] + left

    @property
    def delay(self) -> DelayEstimate | None:
        """The estimated delay of the images; None where it is not estimated."""
        if self.motion is None:
            return None
        sigma_s = math.sqrt(self.covariance[DELAY, DELAY])
        return DelayEstimate(self._given_delay_s, float(self.mean[DELAY]), sigma_s)

    @property
    def camera_height_m(self) -> float:
        """The estimated height of the optical centre."""
        return self._camera_height_m + float(self.mean[HEIGHT])

    @property
    def led_offsets_m(self) -> list[tuple[float, float, float]]:
        """The estimated LEDs minus the robot's axis at the height of the lens, n times x, y, z."""
        state = self.mean.tolist()
        places_m, (x_m, y_m) = state[self._places], state[:2]
        return offsets_from(places_m, x_m, y_m, self.camera_height_m, state[LEVEL:])

    @property
    def focal_error(self) -> float:
        """The estimated relative error of the focal length."""
        return float(self.mean[FOCAL])

    def start(self, pose: Pose2, covariance: FloatArray, *, coarse: bool = False) -> None:
        """Initialize the pose and the level; the estimates of all constants stay.

        Its covariance (3, 3) of x, y, heading is independent of all other states. A coarse pose is
        too uncertain to linearize about: it comes from several images. Elsewhere the floor is not
        the same, and a robot that was carried there may have been turned.
        """
        self.coarse = coarse
        self._before = self.mean.copy(), self.covariance.copy()
        self._growth_before = self._memory.growth
        self.mean[:3] = pose.x_m, pose.y_m, wrap_angle(pose.heading_rad)
        self._motion.restart(pose.x_m, pose.y_m)
        self.covariance[_STARTED, :] = self.covariance[:, _STARTED] = self.mean[LEVEL:] = 0.0
        self.covariance[:3, :3] = covariance
        level_var = self._memory.growth * self._config.level_sigma_rad**2
        np.fill_diagonal(self.covariance[LEVEL:, LEVEL:], level_var)

    def restore(self) -> None:
        """Restore the state from before the last start, to start again from a better pose.

        That innovations of a coarse pose contradicted it tells nothing of the model.
        """
        self.mean, self.covariance = self._before
        self._memory.growth, self._watch = self._growth_before, InnovationWatch()

    @property
    def is_refuted(self) -> bool:
        """Whether images contradict a coarse pose: it is another one that fits the lights."""
        return self.coarse and self._memory.growth > _LARGEST_COARSE_GROWTH * self._growth_before

    def reset(self) -> None:
        """Forget what images told of constants, growth included: a wrong pose explained them.

        What they told before a pose that is refuted still counts.
        """
        growth = self._growth_before if self.is_refuted else 1.0
        self.covariance *= growth / self._memory.growth  # of considered constants, too
        self._memory.growth = growth
        self.fade(math.inf)
        self._suspects.suspect = 0

    def forget_all_but_delay(self) -> None:
        """Forget what images told of constants while the delay was taken for other errors."""
        known = self.mean[DELAY], self.covariance[DELAY, DELAY]
        self.reset()
        self.mean[DELAY], self.covariance[DELAY, DELAY] = known

    def fade(self, dt_s: float) -> None:
        """Let constants and doubts fade; an infinite time restores the prior of the constants."""
        self._unfaded_s += dt_s
        if self._unfaded_s >= _FADING_STEP_S:
            if not self.is_unsettled:
                self._suspects.update(self.mean, self.covariance)
            self.mean, self.covariance = self._memory.fade(
                self.mean, self.covariance, self._unfaded_s
            )
            if self._unfaded_s < math.inf:
                self.doubt *= math.exp(-self._unfaded_s / self._config.memory_s)
                if self.motion is not None:
                    self.covariance[DELAY, DELAY] += _DELAY_WALK_S**2 * self._unfaded_s
            self._unfaded_s = 0.0

    def predict(self, before: Pose2, after: Pose2, dt_s: float = np.inf) -> None:
        """Predict the pose by the odometry at the last image and now, in the same frame.

        The time between them tells the slip; it is infinite for none.
        """
        distance, turn = self._motion.propagate_mean(self.mean, before, after, dt_s)
        self.covariance = covariance = self._motion.propagate_covariance(self.covariance)
        position_var = self._config.slip_m_per_sqrt_m**2 * distance
        heading_var = self._config.heading_walk_rad_per_sqrt_m**2 * distance
        heading_var += self._config.heading_walk_rad_per_sqrt_rad**2 * abs(turn)
        covariance[0, 0] += position_var
        covariance[1, 1] += position_var
        covariance[2, 2] += heading_var

    def predict_leds(self, lens: Lens, joints: HeadAngles, *, solved: bool = False) -> Prediction:
        """Predict the pixels of the LEDs by the nominal lens and the encoder readings.

        Linearization is exact enough about a pose that is a solution of this image: `solved`.
        """
        state = self.mean.tolist()
        x_m, y_m, heading, pan_bias, tilt_bias, _, _, height_m, focal = state[:LEDS]
        azimuth = heading + joints.turret_rad + joints.pan_rad + pan_bias
        fx, fy, cx, cy = lens.intrinsics
        intrinsics_px = fx * (1.0 + focal), fy * (1.0 + focal), cx, cy
        first_m = offsets_from(self._surveyed_m, x_m, y_m, self._camera_height_m)
        height_m += self._camera_height_m
        best_m = offsets_from(state[self._places], x_m, y_m, height_m, state[LEVEL:])
        axis_rad = azimuth, joints.tilt_rad + tilt_bias
        mount_m = self._mount_m[0] + state[MOUNT], self._mount_m[1] + state[MOUNT + 1]
        predicted = predict_leds(best_m, first_m, axis_rad, intrinsics_px, mount_m)
        head_sigmas_rad: FloatArray | float = (encoder := self._encoder_sigma_rad)
        if (motion := self.motion) and (delay := self.delay):
            predicted = delayed(predicted, motion, delay, heading, encoder)
            head_sigmas_rad = motion.head_sigmas_rad(encoder)
        jacobian, depth_m = predicted.by_state, predicted.depth_m
        cross = self.covariance.dot(jacobian.T)
        encoders = predicted.by_head * head_sigmas_rad
        noise = encoders.dot(encoders.T)
        if not solved:
            variance = self.covariance.item
            spread_m2 = variance(0, 0) + variance(1, 1), variance(HEIGHT, HEIGHT)
            neglected = second_order_variances_px2(
                depth_m, fx, spread_m2, encoder_sigma_rad=encoder
            )
            add_to_diagonal(noise, neglected)
        noise += jacobian.dot(cross)
        return Prediction(predicted.pixels_px, depth_m, cross, noise)

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
            The normalized innovation squared, 2 k degrees of freedom; the mean is unchanged if
            it is above the joint gate. Where innovations contradict the covariance, that
            grows instead.
        """
        part = prediction.select(leds)
        innovation, covariance, inverse, distance2 = compute_innovation(part, pixels_px, sigmas_px)
        if self._grows(distance2, len(innovation)) or distance2 > self.joint_gate(len(leds)):
            return distance2
        self.last_innovation = (distance2, len(innovation))
        gain = part.cross.dot(inverse)
        if not self._calibrate:
            gain[HEIGHT:SLIP] = 0.0
        self.mean += gain.dot(innovation)
        self.mean[2] = wrap_angle(float(self.mean[2]))
        # Joseph's (I - K J) P (I - K J)' + K R K' for any gain, by C = P J' and S = J C + R:
        # P - K C' - (C - K S) K'.
        unbalanced = part.cross - gain.dot(covariance)
        self.covariance -= gain.dot(part.cross.T) + unbalanced.dot(gain.T)
        self.covariance = self.covariance.take(self._upper)
        return distance2
