"""The localizer: from images to pose estimates and head targets, tracking or searching."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.alignment import Sample, Sampled, moved_on
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.tags import CORNERS
from goalreach_msgs_py.topics import HEAD_JOINTS
from goalreach_msgs_py.values import FloatArray, HeadAngles, Odometry, Pose2, PoseEstimate
from goalreach_perception.acquisition import Acquisition
from goalreach_perception.association import Fix
from goalreach_perception.head_tracker import HeadTracker
from goalreach_perception.image_delay import ImageDelay, turned
from goalreach_perception.input_check import FrozenImageDetector, input_fault, odometry_jump
from goalreach_perception.landmark_tracking import (
    MatchedLeds,
    correct_by,
    find_predicted,
    tags_near,
)
from goalreach_perception.local_spots import Image
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import (
    AT_REST,
    LocalizerCounters,
    LocalizerOutput,
    observations,
    uniform_estimate,
)
from goalreach_perception.measurement_model import PAN_BIAS, CameraMount, Optics
from goalreach_perception.misfit import FixWatch
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.pose_monitor import Mode, PoseMonitor
from goalreach_perception.tag_detection import TagDetector, outside

_START_COVARIANCE = np.diag([9.0, 9.0, 1.0])
"""Covariance of a pose solved from an image, before the same image corrects it: diffuse."""
_NO_LEDS = np.empty(0, dtype=np.intp)
_TRIPLE = 3
_EVER = 100000
_DOUBTED = 0.5
"""Doubt above which a new pose needs more confirmations. Chosen: half of it has faded."""
_LEAST_STEP_S = 0.005
"""Shorter times between two exposures tell no rates. Chosen."""


class LandmarkLocalizer:
    """Estimates the robot's pose from images of LEDs, joint angles and odometry.

    While tracking, LEDs are detected in windows around their predicted pixels and correct the
    filter. While searching, every image is solved from scratch for pose and labelling.

    A camera that no turret turns, by the names of the head's joints, may see no LED for long: the
    pose then follows the odometry, until its covariance is too large.
    """

    def __init__(self, config: LocalizerConfig, joints: Sequence[str] = HEAD_JOINTS) -> None:
        self._config = config
        self._detector = config.spot_detector()
        self._tags, self._led_count = config.tag_list, len(config.landmark_array_m)
        self._leds = np.arange(self._led_count)
        self._tag_detector = TagDetector(
            self._tags, config.tag_family, self._led_count, config.detection.centroid_sigma_px
        )
        self._mount = CameraMount(config.mount)
        self._head = HeadTracker(config.tracking, joints, len(self._tags))
        watch = config.watch
        self._base_turns = HEAD_JOINTS[0] not in joints
        if self._base_turns:
            watch = replace(watch, blind_after_frames=_EVER, unseen_after_frames=_EVER)
        self._monitor = PoseMonitor(watch)
        self._fixes = FixWatch()
        self._delay = ImageDelay(config.camera_delay_s)
        self._unsettled = False
        self._make_filter(None)
        self._counts = dict.fromkeys(LocalizerCounters._fields, 0)
        self._optics: Optics | None = None
        self._last: tuple[int, Sample] | None = None
        self._stamp_ns: int | None = None
        self._rates_rad_per_s = (0.0, 0.0)
        self._output: LocalizerOutput | None = None
        self._head_command = AT_REST
        self._aim_from: tuple[HeadAngles, HeadAngles, Optics] | None = None
        self._frozen = FrozenImageDetector()
        self._uniform = uniform_estimate(config.arena_width_m, config.arena_length_m)
        self._landmark_count = len(self._filter.leds_m)

    def _make_filter(self, delay_s: float | None) -> None:
        """Make the filter, with the delay of the images in its state or without."""
        config = self._config
        self._filter = PoseFilter(
            config.filter,
            config.noise,
            leds_m=config.landmark_array_m,
            camera_height_m=self._mount.height_m,
            calibrate=config.calibrate,
            mount_m=self._mount.offset_m,
            tags=self._tags,
            odometry=config.odometry,
            delay_s=delay_s,
            base_turns=self._base_turns,
        )
        highest = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=self._head.highest_search_rad)
        search_rad = self._mount.look(highest)[0].tilt_rad
        self._acquisition = Acquisition(config, self._filter, search_rad)

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
        sampled: Sampled | None = None,
    ) -> LocalizerOutput:
        """Process one image with the measurements of its stamp.

        Args:
            time_ns: Stamp; a repeated stamp returns the last output again.
            image: (height, width) mono8.
            camera: Intrinsics of the camera.
            joints: Encoder readings at that time.
            odometry: Encoder odometry at that time.
            sampled: Both at other times, where image, joints and odometry have stamps of their
                own; then the delay of the images is estimated. The pose is that at the stamp.

        Returns:
            The output; an invalid input gives mode 'refused', the reason, and no pose.
        """
        last_ns = self._stamp_ns
        if time_ns == last_ns and self._output is not None:
            return self._output
        fault = input_fault(image, camera, joints, odometry, time_ns=time_ns, last_ns=last_ns)
        if fault := fault or self._frozen.fault(image, joints, odometry.pose):
            return self._refuse(fault)
        self._stamp_ns, now = time_ns, (joints, odometry)
        exposed_ns, then = self._exposed(time_ns, sampled) if sampled else (time_ns, now)
        self._output = self._localize(exposed_ns, image, camera, then, odometry.pose)
        return self._output

    def _localize(
        self, time_ns: int, image: Image, camera: PinholeCamera, sample: Sample, stamped: Pose2
    ) -> LocalizerOutput:
        """Process an image with what was read when it was exposed; the pose is for its stamp."""
        joints, odometry = sample
        read, (joints, roll_rad) = joints, self._mount.look(joints)
        optics = self._optics = Optics.of(camera, roll_rad, self._optics)
        self._counts['frames'] += 1
        self._predict(time_ns, (joints, odometry), stamped)
        tracking = self._monitor.mode is not Mode.SEARCHING
        tags = self._tag_detector.find(image, optics)
        matched = self._track(image, tags, joints, optics) if tracking else None
        if self._monitor.may_reacquire:
            matched = self._acquire(image, tags, joints, odometry.pose, optics) or matched
        self._aim_from = (read, joints, optics)
        return self._make_output(matched, read, odometry.pose, stamped)

    def _exposed(self, time_ns: int, sampled: Sampled) -> tuple[int, Sample]:
        """Return when an image was exposed, by its estimated delay, and what was read then."""
        estimated = self._config.calibrate and self._config.filter.delay_sigma_s > 0.0
        if estimated and self._filter.delay is None:
            pose, covariance = self._filter.pose, self._filter.covariance[:3, :3]
            self._make_filter(self._delay.given_s)
            self._unsettled = True
            self._filter.start(pose, covariance)
        exposed_ns, sample, motion = self._delay.read(time_ns, sampled, self._filter.delay)
        self._filter.motion = motion
        return exposed_ns, sample

    @property
    def head_command(self) -> HeadAngles:
        """Joint targets that follow from the last valid image; zero before the first.

        Computed when first read, which may be after the pose has been published. Read it once
        for each image: the tracker compares one image with the one before.
        """
        if self._aim_from is not None:
            read, joints, optics = self._aim_from
            searching, held = self._monitor.mode is Mode.SEARCHING, self._monitor.unconfirmed_leds
            self._head_command = (
                self._head.search(read)
                if searching
                else self._head.follow(self._filter, read, joints, optics.lens, held)
            )
            self._aim_from = None
        return self._head_command

    def _refuse(self, fault: str) -> LocalizerOutput:
        """Return the output for an invalid input; the filter stays unchanged."""
        self._counts['refused'] += 1
        return LocalizerOutput(
            estimate=self._uniform,
            landmarks=observations(None, self._landmark_count),
            mode=Mode.REFUSED.value,
            reason=fault,
            counters=LocalizerCounters(*self._counts.values()),
        )

    def _predict(self, time_ns: int, sample: Sample, stamped: Pose2) -> None:
        """Predict by odometry; search again after a jump of the odometry, even a later one."""
        now, late_s = sample[1].pose, ((self._stamp_ns or time_ns) - time_ns) * 1e-9
        if self._last is not None:
            before_ns, last = self._last
            before, dt_s = last[1].pose, (time_ns - before_ns) * 1e-9
            speed, turn = self._config.robot_speed_m_per_s, self._config.robot_turn_rad_per_s
            jumps = partial(odometry_jump, speed_m_per_s=speed, turn_rad_per_s=turn)
            late = stamped is not now and jumps(now, stamped, abs(late_s))
            if late or jumps(before, now, abs(dt_s)):
                self._acquisition.clear()
                self._head.restart_search()
                self._counts['lost'] += self._monitor.mode is not Mode.SEARCHING
                self._monitor.lose('odometry jumped')
                self._filter.doubt = 0.0
            elif self._monitor.mode is not Mode.SEARCHING:
                self._filter.fade(abs(dt_s))
                self._filter.predict(before, now, dt_s)
            if abs(dt_s) > _LEAST_STEP_S:  # else a new estimate of the delay came between
                rate = math.hypot(*turned(last, sample)) / abs(dt_s)
                self._rates_rad_per_s = self._rates_rad_per_s[-1], rate
        self._last = (time_ns, sample)

    def _streak_px(self, optics: Optics) -> float:
        """Return the longest line that the head's motion may draw a spot out to.

        From rest to a uniform acceleration, the image moves twice as fast as on average.
        """
        rate = 2.0 * self._rates_rad_per_s[-1] + self._rates_rad_per_s[0]
        return rate * self._config.detection.longest_exposure_s * optics.lens.intrinsics[0]

    def _fix(self, found: MatchedLeds, joints: HeadAngles, optics: Optics) -> Fix | None:
        """Return the pose of one image by the tags in it; None where there is none."""
        rows = np.flatnonzero(found.leds >= self._led_count).tolist()
        if not rows:
            return None
        firsts = found.leds[rows[::CORNERS]] - self._led_count
        tags = [self._tags[first // CORNERS] for first in firsts.tolist()]
        return self._acquisition.from_tags(found.select(rows), tags, joints, optics)

    def _track(
        self, image: Image, tags: MatchedLeds, joints: HeadAngles, optics: Optics
    ) -> MatchedLeds:
        """Correct the filter by the LEDs found near their predicted pixels, and the tags."""
        prediction = self._filter.predict_leds(optics.lens, joints)
        found = find_predicted(
            image,
            prediction.select(self._leds) if self._tags else prediction,
            detector=self._detector,
            optics=optics,
            gate=self._config.filter.led_gate,
            window_half_px=self._config.detection.window_half_px,
            streak_px=self._streak_px(optics),
        )
        if len(tags.leds):
            found = found.concatenated(tags_near(tags, prediction, self._config.filter.led_gate))
        used = correct_by(self._filter, prediction, found, self._led_count)
        self._counts['corrections'] += used is not None
        self._counts['gated'] += used is None and len(found.leds) > 0
        confirmed = self._monitor.mode is not Mode.CONFIRMING
        spare = CORNERS - 1 if self._tags and used is not None else 0  # a tag, as an LED, may miss
        self._monitor.update(0 if used is None else len(used.leds), max(0, found.expected - spare))
        doubt = None if self._filter.fits else self._filter.pose_covariance
        useless = self._last is not None and self._monitor.is_useless(self._last[1][1].pose, doubt)
        if useless or self._filter.is_refuted:
            self._monitor.lose('images contradict the pose')
        if self._monitor.mode is Mode.SEARCHING:
            self._counts['lost'] += 1
            if useless:
                self._filter.doubt = 1.0
            if useless or self._filter.is_refuted:
                self._filter.reset()
            self._filter.fade(math.inf)
            if confirmed:
                self._acquisition.clear()
        elif used is not None and len(used.leds) >= _TRIPLE:
            self._check(used, joints, optics)
        return found if used is None else used

    def _check(self, matched: MatchedLeds, joints: HeadAngles, optics: Optics) -> None:
        """Compare the filter with the pose of this image alone; restart from it if they disagree.

        A pose from a panorama is too coarse to linearize about, and the filter would
        stay overconfident: the first image of three LEDs restarts it.
        """
        renew = self._unsettled and not self._filter.is_unsettled
        due = renew or self._filter.coarse or self._monitor.check_due()
        if not due:
            return
        fix = self._fix(matched, joints, optics)
        if fix is None:
            leds = matched.select(np.flatnonzero(matched.leds < self._led_count).tolist())
            fix = self._acquisition.from_image(leds, joints, optics)
        if fix is None:
            return
        self._fixes.add_solved()
        self._unsettled = self._filter.is_unsettled
        if renew or self._filter.coarse:
            self._filter.forget_all_but_delay() if renew else self._filter.restore()
            self._restart(fix, matched, joints, optics)
            return
        distance2 = self._acquisition.distance2(fix, joints)
        self._counts['contradicted'] += distance2 > self._config.watch.check_gate
        if self._monitor.add_check(distance2):
            self._counts['lost'] += 1
            self._restart(fix, matched, joints, optics)

    def _acquire(
        self, image: Image, tags: MatchedLeds, joints: HeadAngles, odometry: Pose2, optics: Optics
    ) -> MatchedLeds | None:
        """Restart the filter if this image alone, or a panorama, determines the pose."""
        if fix := self._fix(tags, joints, optics):
            self._fixes.add_fix(fix, odometry, joints, self._filter.late_rad)
            self._restart(fix, tags, joints, optics)
            return tags
        return self._acquire_leds(image, tags, joints, odometry, optics)

    def _acquire_leds(
        self, image: Image, tags: MatchedLeds, joints: HeadAngles, odometry: Pose2, optics: Optics
    ) -> MatchedLeds | None:
        if not self._led_count:
            return None
        spots = outside(self._detector.in_frame(image, streak_px=self._streak_px(optics)), tags)
        unmatched = MatchedLeds(_NO_LEDS, spots, optics.undistort(spots.pixels_px), 0)
        fix = self._acquisition.from_image(unmatched, joints, optics)
        if fix is None:
            self._fixes.add_unsolved(len(spots.peaks_dn))
            if self._fixes.reason:
                self._filter.reset()
            if self._monitor.mode is not Mode.DOUBTFUL and (
                start := self._acquisition.from_panorama(unmatched, joints, odometry, optics)
            ):
                self._start(*start, leds=None)
            return None
        self._fixes.add_fix(fix, odometry, joints, self._filter.late_rad)
        rows = fix.spots.tolist()
        matched = MatchedLeds(fix.leds, spots.select(rows), unmatched.pixels_px[rows], len(rows))
        self._restart(fix, matched, joints, optics)
        return matched

    def _start(self, pose: Pose2, covariance: FloatArray, *, leds: list[int] | None) -> None:
        """Start filter and monitor at a pose."""
        self._filter.start(pose, covariance, coarse=leds is None)
        self._counts['acquired'] += 1
        self._monitor.start(leds, again=self._filter.doubt > _DOUBTED)

    def _restart(self, fix: Fix, matched: MatchedLeds, joints: HeadAngles, optics: Optics) -> None:
        """Start the filter at a fix and correct it by the image of the fix."""
        turned = joints.turret_rad + joints.pan_rad + float(self._filter.mean[PAN_BIAS])
        pose = Pose2(x_m=fix.x_m, y_m=fix.y_m, heading_rad=fix.azimuth_rad - turned)
        self._start(pose, _START_COVARIANCE, leds=matched.leds.tolist())
        for _ in range(2):
            prediction = self._filter.predict_leds(optics.lens, joints, solved=True)
            self._filter.correct(prediction, *matched.measured)
            if self._filter.covariance[0, 0] < _START_COVARIANCE[0, 0]:
                break
            self._filter.fade(math.inf)  # the constants learned so far do not fit this image

    def _make_output(
        self, matched: MatchedLeds | None, read: HeadAngles, exposed: Pose2, stamped: Pose2
    ) -> LocalizerOutput:
        """Compose the output, given the odometry when the image was exposed and at its stamp."""
        state, mode, reason = self._filter, self._monitor.mode, self._fixes.reason
        estimate, why = self._uniform, self._monitor.reason
        advice = self._fixes.advice if mode is Mode.SEARCHING else ''
        if mode is Mode.TRACKING and reason:
            mode, why = Mode.DOUBTFUL, reason
        elif mode is Mode.TRACKING:
            pose = state.pose if stamped is exposed else moved_on(state.pose, exposed, stamped)
            estimate = PoseEstimate(pose=pose, covariance=state.pose_covariance)
        return LocalizerOutput(
            estimate=estimate,
            landmarks=observations(matched, self._landmark_count),
            mode=mode.value,
            reason=why,
            counters=LocalizerCounters(*self._counts.values()),
            misfit=reason or advice or state.misfit,
            seen_from=(state.pose, read),
            delay=state.delay,
        )
