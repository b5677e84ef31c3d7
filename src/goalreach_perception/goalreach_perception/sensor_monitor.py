"""Reports of sensor faults that the localizer tolerates."""

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import FloatArray, LandmarkObservation, Pose2
from goalreach_perception.input_check import odometry_jump
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerCounters, LocalizerOutput
from goalreach_perception.measurement_model import CameraMount
from goalreach_perception.tag_detection import circles

_SCAN_FRAMES = 10
"""Frames between scans of the whole image. Chosen: a scan costs as much as ten windows."""

_MATCH_PX = 12.0
"""A spot this near to a predicted LED is that LED. Chosen: four times the width of a spot."""

_INSIDE_PX = 20.0
"""An LED this far inside the image should be detected. Chosen."""

_DARK_FRAMES = 12
"""Consecutive images without a predicted LED until it is reported. Chosen."""

_STOOD_M, _STOOD_RAD = 0.001, 0.002
_MOVED_M = 0.08
_WINDOW = 12
_LOSSES = 3
"""Consecutive losses at the same odometry that mean frozen encoders. Chosen."""

_QUIET_NS = 1_000_000_000
"""Time from one report of a kind to the next. The checks behind them come after so many images:
with a camera of 15 Hz, one of a lasting fault in 0.8 s."""
_KIND_LENGTH = 14
"""Lines with the same beginning are of one kind."""


class SensorMonitor:
    """Compares spots and odometry with the tracked pose; it does not affect the localizer."""

    def __init__(self, config: LocalizerConfig) -> None:
        leds_m, corners_m = config.landmark_array_m, [tag.corners_m for tag in config.tag_list]
        self._led_count, self._landmarks_m = len(leds_m), np.concatenate([leds_m, *corners_m])
        self._mount = CameraMount(config.mount)
        self._detector = config.spot_detector()
        self._missing = [0] * self._led_count
        self._spurious_scans = 0
        self._frames = 0
        self._counters, self._has_pose = LocalizerCounters(), False
        self._lost_at: list[Pose2] = []
        self._speed = config.robot_speed_m_per_s, config.robot_turn_rad_per_s
        self._last: tuple[int, Pose2] | None = None
        self._reported_ns: dict[str, int] = {}
        self._poses: list[tuple[Pose2, Pose2]] = []
        self._told_delay = False

    def check(
        self,
        *,
        time_ns: int,
        image: NDArray[np.uint8],
        camera: PinholeCamera,
        odometry: Pose2,
        output: LocalizerOutput,
    ) -> list[str]:
        """Return one line per fault, of each kind at most one a second."""
        lines = self._jumped(time_ns, odometry) + self._lost(output, odometry)
        lines += [output.misfit] if output.misfit else []
        lines += self._late(output)
        if output.mode != 'tracking':
            self._poses.clear()
            self._missing = [0] * self._led_count
            return self._due(lines, time_ns)
        self._frames += 1
        scan = self._frames % _SCAN_FRAMES == 0
        leds = output.landmarks[: self._led_count]
        if leds and (scan or any(seen is None for seen in leds)):
            seen_m = self._mount.points_in_camera(self._landmarks_m, *output.seen_from)
            leds_px, corners_px = np.split(camera.project(seen_m), [self._led_count])
            lines += self._dark(image, leds_px, camera, leds)
            if scan:
                lines += self._spurious(image, leds_px, corners_px)
        else:
            self._missing = [0] * self._led_count
        return self._due(lines + self._standing(output.estimate.pose, odometry), time_ns)

    def _due(self, lines: list[str], time_ns: int) -> list[str]:
        """Return the lines of the kinds not reported for a second."""
        due = []
        for line in lines:
            kind = line[:_KIND_LENGTH]
            if time_ns - self._reported_ns.get(kind, -_QUIET_NS) >= _QUIET_NS:
                self._reported_ns[kind] = time_ns
                due.append(line)
        return due

    def _jumped(self, time_ns: int, now: Pose2) -> list[str]:
        last_ns, before = self._last or (time_ns, now)
        self._last, (speed, turn), dt_s = (time_ns, now), self._speed, (time_ns - last_ns) * 1e-9
        if not odometry_jump(before, now, dt_s, speed_m_per_s=speed, turn_rad_per_s=turn):
            return []
        turned = abs(angle_difference(now.heading_rad, before.heading_rad))
        moved = f'{_distance_m(now, before):.2f} m, {math.degrees(turned):.0f} degrees'
        return [f'odometry jumped by {moved}']

    def _lost(self, output: LocalizerOutput, odometry: Pose2) -> list[str]:
        counters, before = output.counters, self._counters
        self._counters, had = counters, self._has_pose
        acquired, lost = counters.acquired > before.acquired, counters.lost > before.lost
        self._has_pose = acquired or (had and not lost)
        if acquired and had:
            return ['the pose was replaced by another that fits the image']
        if not lost:
            return []
        self._lost_at = [*self._lost_at[1 - _LOSSES :], odometry]
        if len(self._lost_at) == _LOSSES and self._lost_at.count(odometry) == _LOSSES:
            return ['odometry stands still while the LEDs show motion']
        return [f'the pose was lost: {output.reason}']

    def _late(self, output: LocalizerOutput) -> list[str]:
        """Return once which delay of the images to write."""
        if self._told_delay or output.delay is None or not output.delay.advice:
            return []
        self._told_delay = True
        return [output.delay.advice]

    def _dark(
        self,
        image: NDArray[np.uint8],
        pixels: FloatArray,
        camera: PinholeCamera,
        leds: tuple[LandmarkObservation | None, ...],
    ) -> list[str]:
        low, width, height = _INSIDE_PX, camera.width_px, camera.height_px
        lines = []
        for led, ((u, v), seen) in enumerate(zip(pixels.tolist(), leds, strict=True)):
            inside = low < u < width - low and low < v < height - low
            if seen is not None:
                self._missing[led] = 0
            elif inside:  # the count stays while it is out of view
                self._missing[led] += 1
                if (count := self._missing[led]) % _DARK_FRAMES == 0:
                    lines.append(f'LED {led} {self._absence(image, (u, v), leds, count)}')
        return lines

    def _absence(
        self,
        image: NDArray[np.uint8],
        place: tuple[float, float],
        leds: tuple[LandmarkObservation | None, ...],
        count: int,
    ) -> str:
        """Return what is at the place of an LED that is missing: a light beside it, or none."""
        spots = self._detector.in_frame(image).pixels_px
        for seen in filter(None, leds):
            spots = spots[np.hypot(*(spots - (seen.u_px, seen.v_px)).T) > 1.0]
        off_px = np.hypot(*(spots - place).T).min(initial=math.inf)
        if off_px > _MATCH_PX:
            return f'is dark or hidden: not seen in {count} images'
        return f'is seen {off_px:.0f} px off: check landmarks_m, camera_mount, camera_info'

    def _spurious(
        self, image: NDArray[np.uint8], leds_px: FloatArray, corners_px: FloatArray
    ) -> list[str]:
        tags_px, radii_px = circles(corners_px)
        reach_px = np.append(np.full(len(leds_px), _MATCH_PX), radii_px)
        spots, known_px = self._detector.in_frame(image).pixels_px, np.append(leds_px, tags_px, 0)
        near = np.hypot(*(spots[:, None] - known_px).T) < reach_px[:, None]
        spurious = spots[~near.any(axis=0)].tolist()  # nothing is near an LED behind the camera
        self._spurious_scans = self._spurious_scans + 1 if spurious else 0
        if self._spurious_scans < 2:  # noqa: PLR2004 - a spot in one image alone is image noise
            return []
        u_px, v_px = spurious[0]
        return [f'spurious light, no LED, at pixel {u_px:.0f}, {v_px:.0f}']

    def _standing(self, pose: Pose2, odometry: Pose2) -> list[str]:
        """Compare half a second of odometry with the same interval of poses."""
        self._poses.append((pose, odometry))
        if len(self._poses) <= _WINDOW:
            return []
        before, odometry_before = self._poses.pop(0)
        moved_m = _distance_m(pose, before)
        turned = angle_difference(odometry.heading_rad, odometry_before.heading_rad)
        stood = _distance_m(odometry, odometry_before) < _STOOD_M and abs(turned) < _STOOD_RAD
        line = f'odometry stands still while the LEDs show {moved_m:.2f} m of motion'
        return [line] if stood and moved_m >= _MOVED_M else []


def _distance_m(one: Pose2, other: Pose2) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
