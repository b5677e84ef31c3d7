"""Images in, poses with honest covariances and head targets out.

It tracks while the LEDs are where the filter expects them; it searches, from single images, when
they are not. A pose is published as good only while the last images bore it out.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import (
    FloatArray,
    HeadAngles,
    LandmarkObservation,
    Odometry,
    Pose2,
    PoseEstimate,
)
from goalreach_perception.association import Fix, identify
from goalreach_perception.detection import Image, SpotDetector
from goalreach_perception.head_tracker import HeadTracker
from goalreach_perception.input_check import image_fault, motion_fault, odometry_jump
from goalreach_perception.landmark_tracking import SeenLeds, find_predicted
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import PAN_BIAS, TILT_BIAS
from goalreach_perception.one_image_pose import ImageGeometry
from goalreach_perception.optics import Optics
from goalreach_perception.pose_filter import PoseFilter

__all__ = ['LandmarkLocalizer', 'LocalizerConfig', 'LocalizerCounters', 'LocalizerOutput']

SEARCHING, CONFIRMING, TRACKING = 'searching', 'confirming', 'tracking'
DOUBTFUL, REFUSED = 'doubtful', 'refused'

_START_SIGMA_M = 3.0
_START_SIGMA_RAD = 1.0
"""Spread given to a pose before the image it was solved from corrects it: next to nothing."""


@dataclass(frozen=True, kw_only=True)
class LocalizerCounters:
    """What happened since the start.

    Attributes:
        frames: Images used.
        refused: Inputs that could not be used.
        corrections: Images that corrected the filter.
        gated: Images whose LEDs did not fit the filter.
        acquired: Fixes from one image that started the filter.
        lost: Times the pose was given up.
    """

    frames: int = 0
    refused: int = 0
    corrections: int = 0
    gated: int = 0
    acquired: int = 0
    lost: int = 0


@dataclass(frozen=True, kw_only=True)
class LocalizerOutput:
    """What one image led to.

    Attributes:
        estimate: The pose in `map`; while there is none, the middle of the arena with the
            covariance of "anywhere in it, any heading".
        landmarks: One entry per LED; None where it was not seen.
        head_command: Joint targets.
        mode: 'searching', 'confirming' (a pose from two LEDs, not yet believed), 'tracking',
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
        return {'mode': self.mode, 'reason': self.reason, **asdict(self.counters)}


class LandmarkLocalizer:
    """Estimates the robot's pose from images of LEDs, joint angles and odometry.

    Args:
        config: Everything tunable.
    """

    def __init__(self, config: LocalizerConfig) -> None:
        self._config = config
        noise = config.noise
        self._leds_m = config.landmark_array_m
        self._detector = SpotDetector(
            config.detection,
            spot_sigma_px=noise.spot_sigma_px,
            read_noise_dn=noise.read_noise_dn,
        )
        self._filter = PoseFilter(
            config.filter,
            noise,
            leds_m=self._leds_m,
            camera_height_m=config.camera_height_m,
            calibrate=config.calibrate,
        )
        self._head = HeadTracker(config.head)
        self._mode = SEARCHING
        self._reason = 'no fix yet'
        self._misses = 0
        self._confirmations = 0
        self._unseen = 0
        self._disagreements = 0
        self._counts = LocalizerCounters()
        self._optics: Optics | None = None
        self._last: tuple[int, Pose2] | None = None
        self._output: LocalizerOutput | None = None
        self._anywhere = _anywhere(config.arena_width_m, config.arena_length_m)

    @property
    def filter(self) -> PoseFilter:
        """The filter, for studies of its consistency; not to be changed."""
        return self._filter

    def process(
        self,
        *,
        time_ns: int,
        image: NDArray[np.uint8],
        camera: PinholeCamera,
        joints: HeadAngles,
        odometry: Odometry,
    ) -> LocalizerOutput:
        """Take in one image with what belongs to its stamp.

        Args:
            time_ns: Stamp; an image with the stamp of the last one gets the last answer again.
            image: (height, width) mono8.
            camera: The camera that took it.
            joints: Encoder readings at that time.
            odometry: Encoder odometry at that time.

        Returns:
            The output; an unusable input gives 'refused', its reason, and no pose.
        """
        if self._last is not None and time_ns == self._last[0] and self._output is not None:
            return self._output
        fault = image_fault(image, camera) or motion_fault(joints, odometry)
        if not fault and self._last is not None and time_ns < self._last[0]:
            fault = f'time: {time_ns} ns is before the last image, {self._last[0]} ns'
        if fault:
            return self._refuse(fault)
        if self._optics is None or self._optics.camera != camera:
            self._optics = Optics(camera)
        self._count('frames')
        self._move(time_ns, odometry)
        seen: SeenLeds | None = None
        if self._mode != SEARCHING:
            seen = self._follow(image, joints, self._optics)
        if self._mode in (SEARCHING, DOUBTFUL):
            seen = self._acquire(image, joints, self._optics) or seen
        self._output = self._answer(seen, joints, self._optics)
        return self._output

    def _count(self, name: str) -> None:
        self._counts = replace(self._counts, **{name: getattr(self._counts, name) + 1})

    def _refuse(self, fault: str) -> LocalizerOutput:
        """Return the answer to an unusable input; the filter is left as it is."""
        self._count('refused')
        rest = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
        return LocalizerOutput(
            estimate=self._anywhere,
            landmarks=(None,) * len(self._leds_m),
            head_command=rest if self._output is None else self._output.head_command,
            mode=REFUSED,
            reason=fault,
            counters=self._counts,
        )

    def _move(self, time_ns: int, odometry: Odometry) -> None:
        """Predict by odometry; give the pose up where odometry jumped."""
        now = odometry.pose
        if self._last is not None and self._mode != SEARCHING:
            before_ns, before = self._last
            jumped = odometry_jump(
                math.hypot(now.x_m - before.x_m, now.y_m - before.y_m),
                angle_difference(now.heading_rad, before.heading_rad),
                (time_ns - before_ns) * 1e-9,
                speed_m_per_s=self._config.robot_speed_m_per_s,
                turn_rad_per_s=self._config.robot_turn_rad_per_s,
            )
            if jumped:
                self._lose('odometry jumped')
            else:
                self._filter.predict(before, now)
        self._last = (time_ns, now)

    def _lose(self, reason: str) -> None:
        self._count('lost')
        self._mode, self._reason = SEARCHING, reason
        self._misses = self._unseen = self._confirmations = self._disagreements = 0

    def _follow(self, image: Image, joints: HeadAngles, optics: Optics) -> SeenLeds:
        """Correct the filter by the LEDs that are where they should be."""
        prediction = self._filter.expect(optics.lens, joints)
        seen = find_predicted(
            image,
            prediction,
            detector=self._detector,
            optics=optics,
            gate=self._config.filter.led_gate,
            window_half_px=self._config.detection.window_half_px,
        )
        gate = self._config.filter.joint_gate
        distance = self._filter.correct(prediction, seen.leds, seen.pixels_px, seen.sigmas_px)
        used = len(seen.leds) if distance is not None and distance <= gate else 0
        if used:
            self._count('corrections')
        elif distance is not None:
            self._count('gated')
        self._judge(used, sum(seen.expected))
        return seen

    def _judge(self, used: int, expected: int) -> None:
        """Decide from the LEDs used and expected whether the pose can still be believed."""
        config = self._config
        bad = expected > 0 and used < max(1, expected - 1)
        self._misses = self._misses + 1 if bad else 0
        self._unseen = 0 if used else self._unseen + 1
        if self._mode == CONFIRMING:
            if bad or not used:
                self._lose('two LEDs were not confirmed')
                return
            self._confirmations += used >= 2  # noqa: PLR2004 - a pair
            if self._confirmations < config.pair_confirmations:
                return
        if self._misses >= config.lost_after_frames:
            self._lose('LEDs are not where they should be')
        elif self._unseen >= config.unseen_after_frames:
            self._lose('no LED seen for too long')
        elif used == 0 and expected >= 2:  # noqa: PLR2004 - two dropouts at once are rare
            self._mode, self._reason = DOUBTFUL, 'none of the expected LEDs is seen'
        elif self._mode != DOUBTFUL or used:
            self._mode, self._reason = TRACKING, ''

    def _acquire(self, image: Image, joints: HeadAngles, optics: Optics) -> SeenLeds | None:
        """Start the filter anew where one image tells the pose."""
        spots = self._detector.in_frame(image)
        pixels = optics.to_ideal(spots.pixels_px)
        sigmas = self._detector.sigma_px(spots.peaks_dn)
        fix = self._identify(pixels, sigmas, joints, optics)
        if fix is None or (self._mode == DOUBTFUL and len(fix.leds) < 3):  # noqa: PLR2004
            return None
        seen = SeenLeds(
            fix.leds,
            spots.pixels_px[fix.spots],
            pixels[fix.spots],
            sigmas[fix.spots],
            spots.peaks_dn[fix.spots],
            [],
        )
        return seen if self._restart(fix, seen, joints, optics) else None

    def _identify(
        self, pixels_px: FloatArray, sigmas_px: FloatArray, joints: HeadAngles, optics: Optics
    ) -> Fix | None:
        state = self._filter
        geometry = ImageGeometry(
            leds_m=state.leds_m,
            camera_height_m=state.camera_height_m,
            tilt_rad=joints.tilt_rad + float(state.mean[TILT_BIAS]),
            lens=optics.lens,
            nuisance_covariance=state.covariance,
            tilt_noise_rad=self._config.noise.pan_tilt_noise_rad,
        )
        size_m = (self._config.arena_width_m, self._config.arena_length_m)
        return identify(
            geometry, pixels_px, sigmas_px, arena_size_m=size_m, config=self._config.association
        )

    def _restart(self, fix: Fix, seen: SeenLeds, joints: HeadAngles, optics: Optics) -> bool:
        """Start the filter at a fix and correct it by the image the fix came from."""
        turned = joints.turret_rad + joints.pan_rad + float(self._filter.mean[PAN_BIAS])
        heading = wrap_angle(fix.azimuth_rad - turned)
        pose = Pose2(x_m=fix.x_m, y_m=fix.y_m, heading_rad=heading)
        self._filter.start(pose, _START_SIGMA_M, _START_SIGMA_RAD)
        prediction = self._filter.expect(optics.lens, joints)
        self._filter.correct(prediction, seen.leds, seen.pixels_px, seen.sigmas_px)
        self._count('acquired')
        self._misses = self._unseen = self._confirmations = self._disagreements = 0
        sure = len(seen.leds) > 2  # noqa: PLR2004 - a pair is confirmed first
        self._mode = TRACKING if sure else CONFIRMING
        self._reason = '' if sure else 'a pose from two LEDs waits for confirmation'
        return True

    def _answer(
        self, seen: SeenLeds | None, joints: HeadAngles, optics: Optics
    ) -> LocalizerOutput:
        """Compose the output."""
        state = self._filter
        landmarks: list[LandmarkObservation | None] = [None] * len(self._leds_m)
        if seen is not None:
            for led, (u, v), peak in zip(
                seen.leds.tolist(), seen.raw_px.tolist(), seen.peaks_dn.tolist(), strict=True
            ):
                landmarks[led] = LandmarkObservation(u_px=u, v_px=v, peak_dn=peak)
        estimate = self._anywhere
        if self._mode == TRACKING:
            estimate = PoseEstimate(pose=state.pose, covariance=state.covariance[:3, :3].copy())
        if self._mode == SEARCHING:
            command = self._head.search(joints)
        else:
            centre = np.array([*state.mean[:2].tolist(), state.camera_height_m])
            command = self._head.track(
                joints,
                heading_rad=float(state.mean[2]),
                offsets_m=state.leds_m - centre,
                biases_rad=(float(state.mean[PAN_BIAS]), float(state.mean[TILT_BIAS])),
                lens=optics.lens,
            )
        return LocalizerOutput(
            estimate=estimate,
            landmarks=tuple(landmarks),
            head_command=command,
            mode=self._mode,
            reason=self._reason,
            counters=self._counts,
        )


def _anywhere(width_m: float, length_m: float) -> PoseEstimate:
    """Return the pose of a robot that may be anywhere in the arena: uniform, every heading."""
    variances = [width_m**2 / 12.0, length_m**2 / 12.0, math.pi**2 / 3.0]
    middle = Pose2(x_m=0.5 * width_m, y_m=0.5 * length_m, heading_rad=0.0)
    return PoseEstimate(pose=middle, covariance=np.diag(variances))
