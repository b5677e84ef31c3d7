"""The localizer: from images to pose estimates and head targets, tracking or searching."""

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import FloatArray, HeadAngles, Odometry, Pose2, PoseEstimate
from goalreach_perception.acquisition import Acquisition
from goalreach_perception.association import Fix
from goalreach_perception.detection import Image
from goalreach_perception.head_tracker import HeadTracker
from goalreach_perception.input_check import FrozenImageDetector, input_fault, odometry_jump
from goalreach_perception.landmark_tracking import MatchedLeds, correct_by, find_predicted
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import (
    LocalizerCounters,
    LocalizerOutput,
    observations,
    uniform_estimate,
)
from goalreach_perception.measurement_model import HEADING, PAN_BIAS, TILT_BIAS, Optics
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.pose_monitor import Mode, PoseMonitor

_START_COVARIANCE = np.diag([9.0, 9.0, 1.0])
"""Covariance of a pose solved from an image, before the same image corrects it: diffuse."""
_NO_LEDS = np.empty(0, dtype=np.intp)
_TRIPLE = 3
_REST = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)


class LandmarkLocalizer:
    """Estimates the robot's pose from images of LEDs, joint angles and odometry.

    While tracking, LEDs are detected in windows around their predicted pixels and correct the
    filter. While searching, every image is solved from scratch for pose and labelling.

    Args:
        config: Landmarks, expected errors and all parameters.
    """

    def __init__(self, config: LocalizerConfig) -> None:
        self._config = config
        noise = config.noise
        self._detector = config.spot_detector()
        self._filter = PoseFilter(
            config.filter,
            noise,
            leds_m=config.landmark_array_m,
            camera_height_m=config.camera_height_m,
            calibrate=config.calibrate,
        )
        self._head = HeadTracker(config.head)
        self._monitor = PoseMonitor(config.watch)
        self._acquisition = Acquisition(config, self._filter)
        self._counts = dict.fromkeys(LocalizerCounters._fields, 0)
        self._optics: Optics | None = None
        self._last: tuple[int, Pose2] | None = None
        self._output: LocalizerOutput | None = None
        self._head_command = _REST
        self._aim_from: tuple[HeadAngles, Optics] | None = None
        self._frozen = FrozenImageDetector()
        self._uniform = uniform_estimate(config.arena_width_m, config.arena_length_m)

    @property
    def filter(self) -> PoseFilter:
        """The filter, read-only, for studies."""
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
        """Process one image with the measurements of its stamp.

        Args:
            time_ns: Stamp; a repeated stamp returns the last output again.
            image: (height, width) mono8.
            camera: Intrinsics of the camera.
            joints: Encoder readings at that time.
            odometry: Encoder odometry at that time.

        Returns:
            The output; an invalid input gives mode 'refused', the reason, and no pose.
        """
        last_ns = self._last[0] if self._last else None
        if time_ns == last_ns and self._output is not None:
            return self._output
        fault = input_fault(image, camera, joints, odometry, time_ns=time_ns, last_ns=last_ns)
        if fault := fault or self._frozen.fault(image, joints, odometry.pose):
            return self._refuse(fault)
        if self._optics is None or self._optics.camera != camera:
            self._optics = Optics(camera)
        self._counts['frames'] += 1
        self._predict(time_ns, odometry)
        tracking = self._monitor.mode is not Mode.SEARCHING
        matched = self._track(image, joints, self._optics) if tracking else None
        if self._monitor.may_reacquire:
            matched = self._acquire(image, joints, odometry.pose, self._optics) or matched
        self._aim_from = (joints, self._optics)
        self._output = self._make_output(matched)
        return self._output

    @property
    def head_command(self) -> HeadAngles:
        """Joint targets that follow from the last valid image; zero before the first.

        Computed when first read, which may be after the pose has been published. Read it once
        for each image: the tracker compares one image with the one before.
        """
        if self._aim_from is not None:
            self._head_command = self._aim(*self._aim_from)
            self._aim_from = None
        return self._head_command

    def _refuse(self, fault: str) -> LocalizerOutput:
        """Return the output for an invalid input; the filter stays unchanged."""
        self._counts['refused'] += 1
        return LocalizerOutput(
            estimate=self._uniform,
            landmarks=observations(None, len(self._filter.leds_m)),
            mode=Mode.REFUSED.value,
            reason=fault,
            counters=LocalizerCounters(**self._counts),
        )

    def _predict(self, time_ns: int, odometry: Odometry) -> None:
        """Predict by odometry; search again after a jump of the odometry."""
        now = odometry.pose
        if self._last is not None:
            before_ns, before = self._last
            dt_s = (time_ns - before_ns) * 1e-9
            speed, turn = self._config.robot_speed_m_per_s, self._config.robot_turn_rad_per_s
            if odometry_jump(before, now, dt_s, speed_m_per_s=speed, turn_rad_per_s=turn):
                self._acquisition.clear()
                self._head.restart_search()
                self._counts['lost'] += self._monitor.mode is not Mode.SEARCHING
                self._monitor.lose('odometry jumped')
            elif self._monitor.mode is not Mode.SEARCHING:
                self._filter.fade(dt_s)
                self._filter.predict(before, now)
        self._last = (time_ns, now)

    def _track(self, image: Image, joints: HeadAngles, optics: Optics) -> MatchedLeds:
        """Correct the filter by the LEDs found near their predicted pixels."""
        prediction = self._filter.predict_leds(optics.lens, joints)
        found = find_predicted(
            image,
            prediction,
            detector=self._detector,
            optics=optics,
            gate=self._config.filter.led_gate,
            window_half_px=self._config.detection.window_half_px,
        )
        used = correct_by(self._filter, prediction, found)
        self._counts['corrections'] += used is not None
        self._counts['gated'] += used is None and len(found.leds) > 0
        confirmed = self._monitor.mode is not Mode.CONFIRMING
        self._monitor.update(0 if used is None else len(used.leds), found.expected)
        if self._monitor.mode is Mode.SEARCHING:
            self._counts['lost'] += 1
            self._filter.fade(math.inf)
            if confirmed:
                self._acquisition.clear()
        elif used is not None and len(used.leds) >= _TRIPLE:
            self._check(used, joints, optics)
        return found if used is None else used

    def _check(self, matched: MatchedLeds, joints: HeadAngles, optics: Optics) -> None:
        """Compare the filter with the pose of this image alone; restart from it if they disagree.

        A pose from two LEDs or a panorama is too coarse to linearize about, and the filter would
        stay overconfident: the first image of three LEDs restarts it.
        """
        due = self._filter.coarse or self._monitor.check_due()
        if not due or (fix := self._acquisition.from_image(matched, joints, optics)) is None:
            return
        if self._filter.coarse:
            self._filter.restore()
            self._restart(fix, matched, joints, optics)
            return
        distance2 = self._acquisition.distance2(fix, joints)
        self._counts['contradicted'] += distance2 > self._config.watch.check_gate
        if self._monitor.add_check(distance2):
            self._counts['lost'] += 1
            self._restart(fix, matched, joints, optics)

    def _acquire(
        self, image: Image, joints: HeadAngles, odometry: Pose2, optics: Optics
    ) -> MatchedLeds | None:
        """Restart the filter if this image alone, or a panorama, determines the pose."""
        spots = self._detector.in_frame(image)
        unmatched = MatchedLeds(_NO_LEDS, spots, optics.undistort(spots.pixels_px), 0)
        fix = self._acquisition.from_image(unmatched, joints, optics)
        if self._monitor.mode is Mode.DOUBTFUL:
            if fix is None or len(fix.leds) < _TRIPLE:
                return None
        elif fix is None:
            if start := self._acquisition.from_panorama(unmatched, joints, odometry, optics):
                self._start(*start, leds=None)
            return None
        rows = fix.spots.tolist()
        matched = MatchedLeds(fix.leds, spots.select(rows), unmatched.pixels_px[rows], len(rows))
        self._restart(fix, matched, joints, optics)
        return matched

    def _start(self, pose: Pose2, covariance: FloatArray, *, leds: list[int] | None) -> None:
        """Start filter and monitor at a pose."""
        coarse = leds is None or len(leds) < _TRIPLE
        self._filter.start(pose, covariance, coarse=coarse)
        self._counts['acquired'] += 1
        self._monitor.start(leds)

    def _restart(self, fix: Fix, matched: MatchedLeds, joints: HeadAngles, optics: Optics) -> None:
        """Start the filter at a fix and correct it by the image of the fix."""
        turned = joints.turret_rad + joints.pan_rad + float(self._filter.mean[PAN_BIAS])
        pose = Pose2(x_m=fix.x_m, y_m=fix.y_m, heading_rad=fix.azimuth_rad - turned)
        self._start(pose, _START_COVARIANCE, leds=matched.leds.tolist())
        prediction = self._filter.predict_leds(optics.lens, joints, solved=True)
        self._filter.correct(prediction, *matched.measured)

    def _aim(self, joints: HeadAngles, optics: Optics) -> HeadAngles:
        """Return joint targets by the estimate of the last image."""
        state = self._filter
        if self._monitor.mode is Mode.SEARCHING:
            return self._head.search(joints)
        return self._head.track(
            joints,
            heading_rad=float(state.mean[HEADING]),
            offsets_m=state.led_offsets_m,
            biases_rad=(float(state.mean[PAN_BIAS]), float(state.mean[TILT_BIAS])),
            lens=optics.lens,
            hold=self._monitor.unconfirmed_leds,
        )

    def _make_output(self, matched: MatchedLeds | None) -> LocalizerOutput:
        """Compose the output."""
        state, mode = self._filter, self._monitor.mode
        estimate = self._uniform
        if mode is Mode.TRACKING:
            estimate = PoseEstimate(pose=state.pose, covariance=state.pose_covariance)
        return LocalizerOutput(
            estimate=estimate,
            landmarks=observations(matched, len(state.leds_m)),
            mode=mode.value,
            reason=self._monitor.reason,
            counters=LocalizerCounters(**self._counts),
        )
