"""What the localizer notices of its sensors while it copes with them: told by name."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import PinholeCamera, camera_azimuth, points_in_camera
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.detection import SpotDetector
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerCounters, LocalizerOutput

_LOOK_FRAMES = 10
"""The whole image is looked at once in so many; chosen: it costs as much as ten windows."""

_SEEN_PX = 12.0
"""A light this near to where an LED should be is that LED; chosen: four times a spot's width."""

_INSIDE_PX = 20.0
"""An LED this far inside the image should be seen; chosen."""

_DARK_FRAMES = 12
"""Images that should show an LED, and do not, after which it is told; chosen."""

_STOOD_M, _STOOD_RAD = 0.001, 0.002
_MOVED_M = 0.08
_JUMP_M = 0.1
"""More than the robot drives between two images, unless many were lost; chosen."""
_WINDOW = 12
_LOSSES = 3
"""A pose lost so often in a row at one and the same odometry tells of frozen encoders; chosen."""

_QUIET_NS = 1_000_000_000
_AGAIN_NS = 200_000_000
"""After so long without it, what is seen anew is another event and not the same one going on."""
_KIND_LENGTH = 12
"""Lines that begin alike are of one kind."""


class SensorMonitor:
    """Compares lights and odometry with a pose that is tracked. It changes nothing.

    Args:
        config: Of the localizer.
    """

    def __init__(self, config: LocalizerConfig) -> None:
        self._leds_m = config.landmark_array_m
        self._height_m = config.camera_height_m
        self._detector = SpotDetector(
            config.detection,
            spot_sigma_px=config.noise.spot_sigma_px,
            read_noise_dn=config.noise.read_noise_dn,
        )
        self._unseen = [0] * len(self._leds_m)
        self._strange = 0
        self._frames = 0
        self._counters = LocalizerCounters()
        self._lost_at: list[Pose2] = []
        self._odometry: Pose2 | None = None
        self._told_ns: dict[str, int] = {}
        self._seen_ns: dict[str, int] = {}
        self._poses: list[tuple[Pose2, Pose2]] = []

    def check(
        self,
        *,
        time_ns: int,
        image: NDArray[np.uint8],
        camera: PinholeCamera,
        joints: HeadAngles,
        odometry: Pose2,
        output: LocalizerOutput,
    ) -> list[str]:
        """Return what is worth a word, one line each; what goes on once in a second.

        Args:
            time_ns: Stamp of the image.
            image: (height, width) mono8.
            camera: The camera that took it.
            joints: Encoder readings.
            odometry: Pose in `odom`.
            output: What the localizer made of it.
        """
        lines = self._lines(image, camera, joints, odometry, output)
        fresh = []
        for line in lines:
            kind = line[:_KIND_LENGTH]
            goes_on = time_ns - self._seen_ns.get(kind, -_AGAIN_NS) < _AGAIN_NS
            self._seen_ns[kind] = time_ns
            if not goes_on or time_ns - self._told_ns[kind] >= _QUIET_NS:
                self._told_ns[kind] = time_ns
                fresh.append(line)
        return fresh

    def _lines(
        self,
        image: NDArray[np.uint8],
        camera: PinholeCamera,
        joints: HeadAngles,
        odometry: Pose2,
        output: LocalizerOutput,
    ) -> list[str]:
        lines = self._jumped(odometry) + self._given_up(output, odometry)
        if output.mode != 'tracking':
            self._poses.clear()
            self._unseen = [0] * len(self._leds_m)
            return lines
        pose = output.estimate.pose
        self._frames += 1
        looks = self._frames % _LOOK_FRAMES == 0
        if looks or any(seen is None for seen in output.landmarks):
            pixels = self._expected(pose, joints, camera)
            lines += self._dark(pixels, camera, output)
            if looks:
                lines += self._strangers(image, pixels)
        else:
            self._unseen = [0] * len(self._leds_m)
        return lines + self._standing(pose, odometry)

    def _jumped(self, odometry: Pose2) -> list[str]:
        last, self._odometry = self._odometry, odometry
        if last is None:
            return []
        moved_m = math.hypot(odometry.x_m - last.x_m, odometry.y_m - last.y_m)
        return [f'odometry jumped by {moved_m:.2f} m'] if moved_m > _JUMP_M else []

    def _given_up(self, output: LocalizerOutput, odometry: Pose2) -> list[str]:
        counters, before = output.counters, self._counters
        self._counters = counters
        if counters.lost <= before.lost:
            anew = counters.acquired > before.acquired > before.lost
            return ['the pose was given up for another that fits the image'] if anew else []
        self._lost_at = [*self._lost_at[1 - _LOSSES :], odometry]
        if len(self._lost_at) == _LOSSES and self._lost_at.count(odometry) == _LOSSES:
            return ['odometry stands still while the LEDs tell of motion']
        return [f'the pose was given up: {output.reason}']

    def _expected(self, pose: Pose2, joints: HeadAngles, camera: PinholeCamera) -> FloatArray:
        centre_m = np.array([pose.x_m, pose.y_m, self._height_m])
        azimuth_rad = camera_azimuth(pose.heading_rad, joints)
        return camera.project(
            points_in_camera(self._leds_m, centre_m, azimuth_rad, joints.tilt_rad)
        )

    def _dark(
        self, pixels: FloatArray, camera: PinholeCamera, output: LocalizerOutput
    ) -> list[str]:
        low, width, height = _INSIDE_PX, camera.width_px, camera.height_px
        lines = []
        for led, ((u, v), seen) in enumerate(zip(pixels.tolist(), output.landmarks, strict=True)):
            inside = low < u < width - low and low < v < height - low
            if seen is not None:
                self._unseen[led] = 0
            if not inside or seen is not None:  # one that leaves the view is as dark as before
                continue
            self._unseen[led] += 1
            if self._unseen[led] % _DARK_FRAMES == 0:
                lines.append(
                    f'LED {led} is dark or hidden: not seen in {self._unseen[led]} images'
                )
        return lines

    def _strangers(self, image: NDArray[np.uint8], pixels: FloatArray) -> list[str]:
        spots = self._detector.in_frame(image).pixels_px
        strange = [(u, v) for u, v in spots.tolist() if not _is_near(u, v, pixels)]
        self._strange = self._strange + 1 if strange else 0
        if self._strange < 2:  # noqa: PLR2004 - one may be a spurious light of one image
            return []
        u_px, v_px = strange[0]
        return [f'a light that is no LED, at pixel {u_px:.0f}, {v_px:.0f}']

    def _standing(self, pose: Pose2, odometry: Pose2) -> list[str]:
        """Hold half a second of odometry against the same of poses."""
        self._poses.append((pose, odometry))
        if len(self._poses) <= _WINDOW:
            return []
        before, odometry_before = self._poses.pop(0)
        moved_m = math.hypot(pose.x_m - before.x_m, pose.y_m - before.y_m)
        counted_m = math.hypot(
            odometry.x_m - odometry_before.x_m, odometry.y_m - odometry_before.y_m
        )
        turned = angle_difference(odometry.heading_rad, odometry_before.heading_rad)
        stood = counted_m < _STOOD_M and abs(turned) < _STOOD_RAD
        if not stood or moved_m < _MOVED_M:
            return []
        return [f'odometry stands still while the LEDs tell of {moved_m:.2f} m of motion']


def _is_near(u_px: float, v_px: float, pixels: FloatArray) -> bool:
    distances = np.hypot(pixels[:, 0] - u_px, pixels[:, 1] - v_px)
    return bool((distances < _SEEN_PX).any())
