"""Peers that compute a pose from an image of three LEDs, each with every possible advantage."""

import math
from typing import Any

import cv2
from filterpy.kalman import ExtendedKalmanFilter
import numpy as np
from scipy.optimize import least_squares

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.detection import SpotDetector
from goalreach_perception.local_spots import Image
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import Lens, project

_NEAR_PX = 6.0
_DETECTOR_NOISE_PX = 0.05
_WINDOW_PX = 24


class BlobsAndP3P:
    """cv2.SimpleBlobDetector and cv2.solveP3P.

    The caller selects the blob of each LED and the right one of the solutions.

    Args:
        config: Configuration of our localizer.
        camera: The camera.
    """

    def __init__(self, config: LocalizerConfig, camera: PinholeCamera) -> None:
        settings = cv2.SimpleBlobDetector.Params()
        settings.blobColor = 255
        settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 40.0, 200.0, 20.0
        settings.minArea, settings.maxArea = 2.0, 500.0
        settings.filterByCircularity = settings.filterByInertia = False
        settings.filterByConvexity = False
        self._detector: Any = cv2.SimpleBlobDetector.create(settings)
        self._leds_m = config.landmark_array_m
        self._matrix = np.array(
            [[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]]
        )

    def detect(self, image: Image) -> FloatArray:
        """Return the centres of the blobs, (n, 2)."""
        found = self._detector.detect(image)
        return np.array([blob.pt for blob in found], dtype=np.float64).reshape(-1, 2)

    def solve(self, pixels_px: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return rotation vectors and translations of all solutions.

        Args:
            pixels_px: (3, 2) of LED 0, 1, 2.
        """
        _, turns, shifts = cv2.solveP3P(
            self._leds_m, pixels_px, self._matrix, np.zeros(5), flags=cv2.SOLVEPNP_P3P
        )
        return [
            (np.asarray(turn, np.float64), np.asarray(shift, np.float64))
            for turn, shift in zip(turns, shifts, strict=True)
        ]

    @staticmethod
    def assign(blobs_px: FloatArray, leds_px: FloatArray) -> FloatArray | None:
        """Return the blob next to each true LED pixel, (3, 2), or None where one has none."""
        if len(blobs_px) == 0:
            return None
        away_px = np.linalg.norm(blobs_px[None, :, :] - leds_px[:, None, :], axis=2)
        if (away_px.min(axis=1) > _NEAR_PX).any():
            return None
        assigned: FloatArray = blobs_px[away_px.argmin(axis=1)]
        return assigned

    @staticmethod
    def pose(turn: FloatArray, shift: FloatArray, joints: HeadAngles) -> Pose2:
        """Return the robot's pose of a solution."""
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        x_m, y_m, _ = (-rotation.T @ shift.reshape(3)).tolist()
        azimuth = math.atan2(rotation[2, 1], rotation[2, 0])
        heading = wrap_angle(azimuth - joints.turret_rad - joints.pan_rad)
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading)


class SpotsAndLeastSquares:
    """Our spots and scipy.optimize.least_squares (Levenberg-Marquardt) from a nearby pose.

    Args:
        config: Configuration of our localizer.
        camera: The camera.
        noise: Noise of the sensors.
    """

    def __init__(self, config: LocalizerConfig, camera: PinholeCamera, noise: NoiseModel) -> None:
        self._lens = Lens.of_camera(camera)
        self._places_m = config.landmark_array_m
        self._height_m = config.camera_height_m
        self.detector = SpotDetector(
            config.detection, spot_sigma_px=noise.spot_sigma_px, read_noise_dn=noise.read_noise_dn
        )

    def solve(self, pixels_px: FloatArray, joints: HeadAngles, near: Pose2) -> Pose2:
        """Return the pose.

        Args:
            pixels_px: (3, 2) of LED 0, 1, 2.
            joints: Encoder readings.
            near: Initial pose.
        """
        head = joints.turret_rad + joints.pan_rad

        def residuals(state: FloatArray) -> FloatArray:
            offsets_m = self._places_m - np.array([state[0], state[1], self._height_m])
            rotation = optical_rotation(state[2] + head, joints.tilt_rad)
            seen: FloatArray = project(offsets_m, rotation, self._lens).pixels_px - pixels_px
            return seen.reshape(-1)

        begin = np.array([near.x_m, near.y_m, near.heading_rad])
        x_m, y_m, heading = least_squares(residuals, begin, method='lm').x.tolist()
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(heading))


class FilterpyEkf:
    """Our windows and the extended Kalman filter of filterpy over x, y, heading.

    Args:
        config: Configuration of our localizer.
        camera: The camera.
        noise: Noise of the sensors.
        start: True initial pose.
    """

    def __init__(
        self, config: LocalizerConfig, camera: PinholeCamera, noise: NoiseModel, start: Pose2
    ) -> None:
        self._ekf = ExtendedKalmanFilter(dim_x=3, dim_z=6)
        self._ekf.x = np.array([start.x_m, start.y_m, start.heading_rad])
        self._ekf.P = np.diag([0.05**2, 0.05**2, 0.01**2])
        self._lens = Lens.of_camera(camera)
        self._places_m = config.landmark_array_m
        self._height_m = config.camera_height_m
        encoders_px = noise.pan_tilt_noise_rad * camera.fx_px
        survey_px = noise.survey_error_m / 3.0 * camera.fx_px
        self._ekf.R = np.eye(6) * (_DETECTOR_NOISE_PX**2 + encoders_px**2 + survey_px**2)
        self._detector = SpotDetector(
            config.detection, spot_sigma_px=noise.spot_sigma_px, read_noise_dn=noise.read_noise_dn
        )
        self._joints = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
        self._odometry: Pose2 | None = None

    def see(self, image: Image, joints: HeadAngles, odometry: Pose2) -> Pose2:
        """Update by one image; return the pose.

        Args:
            image: (height, width) grey values.
            joints: Encoder readings.
            odometry: Odometry pose.
        """
        self._predict(odometry)
        self._joints = joints
        centres = self._measure(self._ekf.x).reshape(-1, 2).tolist()
        spots = self._detector.in_windows(image, centres, [_WINDOW_PX] * len(centres))
        if all(spots.led_like):
            self._ekf.update(spots.pixels_px.reshape(-1), self._jacobian, self._measure)
        x_m, y_m, heading = self._ekf.x.tolist()
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(heading))

    def _predict(self, odometry: Pose2) -> None:
        """Predict by the odometry since the last call."""
        before, self._odometry = self._odometry, odometry
        if before is None:
            return
        dx, dy = odometry.x_m - before.x_m, odometry.y_m - before.y_m
        x = self._ekf.x
        turn = x[2] - before.heading_rad
        east = math.cos(turn) * dx - math.sin(turn) * dy
        north = math.sin(turn) * dx + math.cos(turn) * dy
        self._ekf.F = np.array([[1.0, 0.0, -north], [0.0, 1.0, east], [0.0, 0.0, 1.0]])
        self._ekf.Q = np.diag([1e-4, 1e-4, 1e-4]) * math.hypot(dx, dy)
        self._ekf.P = self._ekf.F @ self._ekf.P @ self._ekf.F.T + self._ekf.Q
        moved = odometry.heading_rad - before.heading_rad
        self._ekf.x = np.array([x[0] + east, x[1] + north, wrap_angle(x[2] + moved)])

    def _projected(self, state: FloatArray) -> tuple[Any, FloatArray]:
        offsets_m = self._places_m - np.array([state[0], state[1], self._height_m])
        azimuth = state[2] + self._joints.turret_rad + self._joints.pan_rad
        return project(
            offsets_m, optical_rotation(azimuth, self._joints.tilt_rad), self._lens
        ), offsets_m

    def _measure(self, state: FloatArray) -> FloatArray:
        pixels: FloatArray = self._projected(state)[0].pixels_px.reshape(-1)
        return pixels

    def _jacobian(self, state: FloatArray) -> FloatArray:
        projection, offsets_m = self._projected(state)
        jacobian = -projection.by_offset
        jacobian[..., 2] = (
            projection.by_offset[..., 0] * offsets_m[:, 1:2]
            - projection.by_offset[..., 1] * offsets_m[:, :1]
        )
        rows: FloatArray = jacobian.reshape(-1, 3)
        return rows
