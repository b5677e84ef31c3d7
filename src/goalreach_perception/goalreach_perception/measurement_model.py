"""The measurement model: the pixel of an LED as a function of the uncertain quantities.

State vector of the package, for n LEDs (14 + 3 n numbers, 23 for three; one more with a delay):

| index | state | unit |
| --- | --- | --- |
| 0, 1, 2 | x, y, heading in `map` | m, m, rad |
| 3, 4 | pan bias, tilt bias: true joint angle minus encoder reading | rad |
| 5 | odometry scale: true distance / measured distance - 1 | 1 |
| 6 | odometry drift: turn of the base not measured by the encoders | rad/m |
| 7 | camera height minus its nominal value | m |
| 8 | true focal length / nominal focal length - 1 | 1 |
| 9 + 3 i ... 11 + 3 i | x, y, z of LED i in `map`; corners of tags follow the LEDs | m |
| -6 | delay of the images, only where they and the odometry have stamps of their own | s |
| -5, -4 | place of the optical centre minus the nominal one: forward and left in the head | m |
| -3 | sideways slip: speed across the wheels / (speed x turning rate) | s |
| -2, -1 | level: how far the base is turned about the axes x and y of `map` | rad |

The projection is the pinhole of `goalreach_msgs_py.camera`, its derivatives are analytic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import functools
import math
from typing import Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import EQUIDISTANT, PinholeCamera, camera_azimuth, optical_rotation
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.tags import CORNERS, Tag
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2

HEADING: Final = 2
PAN_BIAS: Final = 3
TILT_BIAS: Final = 4
SCALE: Final = 5
DRIFT: Final = 6
HEIGHT: Final = 7
FOCAL: Final = 8
LEDS: Final = 9
DELAY: Final = -6
MOUNT: Final = -5
SLIP: Final = -3
LEVEL: Final = -2

_NAMES: Final = (
    *('x', 'y', 'heading', 'pan_joint and the yaw of camera_mount'),
    *('tilt_joint and the pitch of camera_mount', 'the distances of odom', 'the headings of odom'),
    *('camera_height_m', 'the focal length in camera_info'),
)
_NAMES_AFTER: Final = (
    *('camera_delay_s', 'x of camera_mount', 'y of camera_mount', 'wheel slip'),
    *('level of the base',) * 2,
)

MINIMUM_DEPTH_M: Final = 0.05
"""A point nearer than this, or behind the camera, has no pixel. Chosen, not from the paper."""
_INVERSION: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-9)
"""Iterations and accuracy of the inverse of a distortion. Chosen: far below a spot's noise."""
BEHIND_M: Final = 0.06
"""An LED at most this deep is not in front of the camera: just above that minimum."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """Focal lengths and principal point along u and v as (2,) arrays, made once per camera."""

    focal_px: FloatArray
    centre_px: FloatArray

    @classmethod
    def of_camera(cls, camera: PinholeCamera) -> Lens:
        """Return the pinhole part of a camera, without its distortion."""
        return cls(
            focal_px=np.array([camera.fx_px, camera.fy_px]),
            centre_px=np.array([camera.cx_px, camera.cy_px]),
        )

    @functools.cached_property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """Focal lengths and principal point: fx, fy, cx, cy."""
        (fx, fy), (cx, cy) = self.focal_px.tolist(), self.centre_px.tolist()
        return fx, fy, cx, cy

    def scaled(self, relative_error: float) -> Lens:
        """Return the lens with its focal lengths scaled by 1 + relative_error."""
        return Lens(focal_px=self.focal_px * (1.0 + relative_error), centre_px=self.centre_px)


class Projection(NamedTuple):
    """Pixels of k LEDs and their derivatives; every array may have leading batch axes.

    Attributes:
        pixels_px: (..., k, 2) pixels (u, v).
        depth_m: (..., k) distance along the optical axis; 0.05 for points behind the camera.
        by_offset: (..., k, 2, 3) derivative by the position of the LED relative to the camera.
        by_tilt: (..., k, 2) derivative by the tilt.
        by_focal: (..., k, 2) derivative by the relative error of the focal length.
    """

    pixels_px: FloatArray
    depth_m: FloatArray
    by_offset: FloatArray
    by_tilt: FloatArray
    by_focal: FloatArray


def project(offsets_m: FloatArray, rotation: FloatArray, lens: Lens) -> Projection:
    """Project LEDs into a camera and differentiate.

    With P = R d the LED in the optical frame and s = (P_x, P_y) / P_z, the pixel is c + f s;
    its derivative by d is f / P_z (R_xy - s R_z). A tilt by dT moves P by (0, P_z, -P_y) dT.

    Args:
        offsets_m: (..., k, 3) LED minus optical centre in `map`, metres.
        rotation: (..., 3, 3) from `map` to the optical frame.
        lens: The lens.

    Returns:
        The projection; points behind the camera are projected from a depth of 0.05 m.
    """
    in_camera_m = offsets_m @ rotation.swapaxes(-1, -2)
    depth_m = np.maximum(in_camera_m[..., 2:], MINIMUM_DEPTH_M)
    slopes = in_camera_m[..., :2] / depth_m
    rays_px = slopes * lens.focal_px
    turned = rotation[..., None, :2, :] - slopes[..., None] * rotation[..., None, 2:, :]
    by_offset = (lens.focal_px / depth_m)[..., None] * turned
    by_tilt = rays_px * slopes[..., 1:]
    by_tilt[..., 1] += lens.focal_px[1]
    return Projection(lens.centre_px + rays_px, depth_m[..., 0], by_offset, by_tilt, rays_px)


def prior_covariance(
    noise: NoiseModel, led_count: int, tags: Sequence[Tag], after: Sequence[float]
) -> FloatArray:
    """Return the covariance of the states before the first image; zero for the pose.

    The errors of the corners of each tag are correlated. `after` are the standard deviations of
    the states after the landmarks.
    """
    end = LEDS + 3 * (led_count + CORNERS * len(tags))
    sigmas = np.zeros(end + len(after))
    sigmas[[PAN_BIAS, TILT_BIAS]] = noise.pan_tilt_bias_rad
    sigmas[SCALE] = noise.odometry_scale_error
    sigmas[DRIFT] = noise.odometry_drift_rad_per_m
    sigmas[HEIGHT] = noise.camera_height_error_m
    sigmas[FOCAL] = noise.focal_error
    sigmas[LEDS:end], sigmas[end:] = noise.survey_error_m, after
    covariance = np.diag(sigmas**2)
    for index, tag in enumerate(tags):
        first = LEDS + 3 * (led_count + CORNERS * index)
        rows = slice(first, first + 3 * CORNERS)
        covariance[rows, rows] = tag.corner_covariance_m2(noise.survey_error_m)
    return covariance


def state_name(state: int, size: int, landmarks: int, tags: Sequence[Tag] = ()) -> str:
    """Return what a user can check if a state is far from its prior."""
    if state < LEDS:
        return _NAMES[state]
    if state >= LEDS + 3 * landmarks:
        return _NAMES_AFTER[state - size]
    led, axis = divmod(state - LEDS, 3)
    if (corner := led + CORNERS * len(tags) - landmarks) >= 0:
        return f'place and facing of tag {tags[corner // CORNERS].id}'
    return f'{"xyz"[axis]} of LED {led} in landmarks_m'


def offset_derivatives(led_count: int) -> FloatArray:
    """Return the derivatives of each LED relative to the camera by the state, without rotation.

    Returns:
        (n, 3, 14 + 3 n): minus one for the camera's x, y and height, one for the LED itself.
    """
    derivatives = np.zeros((led_count, 3, LEDS + 3 * led_count - MOUNT))
    derivatives[:, [0, 1, 2], [0, 1, HEIGHT]] = -1.0
    for led in range(led_count):
        derivatives[led, [0, 1, 2], [LEDS + 3 * led + axis for axis in range(3)]] = 1.0
    return derivatives


def state_jacobian(
    projection: Projection, offsets_m: FloatArray, derivatives: FloatArray
) -> FloatArray:
    """Return the derivative of the pixels by the whole state vector: the chain rule.

    A rotation of the optical axis by dA moves an LED at d by (d_y, -d_x, 0) dA as seen from it; a
    rotation by w about horizontal axes, by d x w.

    Args:
        projection: k LEDs, with or without leading batch axes.
        offsets_m: (..., k, 3) the projected offsets.
        derivatives: (..., k, 3, states) rows of `offset_derivatives`, one for each LED.

    Returns:
        (..., 2 k, states), rows u_0, v_0, u_1, v_1, ...
    """
    by_state = derivatives.copy()
    by_state[..., 0, HEADING : PAN_BIAS + 1] = offsets_m[..., 1:2]
    by_state[..., 1, HEADING : PAN_BIAS + 1] = -offsets_m[..., :1]
    by_state[..., 1, LEVEL], by_state[..., 2, LEVEL] = offsets_m[..., 2], -offsets_m[..., 1]
    by_state[..., 0, LEVEL + 1], by_state[..., 2, LEVEL + 1] = (
        -offsets_m[..., 2],
        offsets_m[..., 0],
    )
    jacobian: FloatArray = projection.by_offset @ by_state
    jacobian[..., TILT_BIAS] = projection.by_tilt
    jacobian[..., FOCAL] = projection.by_focal
    shape = jacobian.shape
    return jacobian.reshape(*shape[:-3], shape[-3] * 2, shape[-1])


class Optics:
    """A lens with its distortion, of a camera that may be turned about its axis, left side up."""

    def __init__(self, camera: PinholeCamera, roll_rad: float = 0.0) -> None:
        self.camera = camera
        self.roll_rad = roll_rad
        self.lens = Lens.of_camera(camera)
        self._maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
        self._is_ideal = roll_rad == 0.0 and not camera.is_distorted
        cosine, sine = math.cos(roll_rad), math.sin(roll_rad)
        self._level = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    @classmethod
    def of(cls, camera: PinholeCamera, roll_rad: float, last: Optics | None) -> Optics:
        """Return the optics of a camera: the last ones if they are the same."""
        same = last is not None and (last.camera, last.roll_rad) == (camera, roll_rad)
        return last if last is not None and same else cls(camera, roll_rad)

    def undistort(self, pixels_px: FloatArray) -> FloatArray:
        """Return the (n, 2) pixels without the distortion of the lens and without roll."""
        if self._is_ideal or len(pixels_px) == 0:
            return pixels_px
        fx, fy, cx, cy = self.lens.intrinsics
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        points, terms = pixels_px.reshape(-1, 1, 2), np.array(self.camera.distortion)
        model = cv2.fisheye if self.camera.distortion_model == EQUIDISTANT else cv2
        ideal = model.undistortPoints(
            points, matrix, terms, R=self._level, P=matrix, criteria=_INVERSION
        )
        return np.asarray(ideal, np.float64).reshape(-1, 2)

    def rectify(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an image, (height, width), as it were without distortion and roll."""
        if self._is_ideal:
            return image
        if self._maps is None:
            pixels = np.indices(image.shape[::-1]).reshape(2, -1).T.astype(np.float64)
            maps = self.distort(pixels).T.reshape(2, *image.shape[::-1])
            outside = np.nan_to_num(maps, nan=-2.0)
            u, v = (np.ascontiguousarray(each.T, np.float32) for each in outside)
            self._maps = u, v
        ideal = cv2.remap(image, *self._maps, cv2.INTER_LINEAR)
        return np.asarray(ideal, np.uint8)

    def distort(self, pixels_px: FloatArray) -> FloatArray:
        """Return the (n, 2) pixels with the distortion of the lens and with roll."""
        if self._is_ideal:
            return pixels_px
        rays = np.ones((len(pixels_px), 3))
        rays[:, :2] = (pixels_px - self.lens.centre_px) / self.lens.focal_px
        return self.camera.project(rays @ self._level)


def attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> FloatArray:
    """Return the rotation from camera (x forward, y left, z up) to link, as REP-103 has it."""
    (cr, cp, cy), (sr, sp, sy) = (
        [turn(angle) for angle in (roll_rad, pitch_rad, yaw_rad)] for turn in (math.cos, math.sin)
    )
    yaw = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    rotation: FloatArray = yaw @ pitch @ roll
    return rotation


class CameraMount:
    """Expresses a camera anywhere on the last link of the head by one on the axis.

    That has another pan, tilt and roll. The offset is exact where the camera looks along its link
    or the link has no tilt.

    Args:
        mount: x, y, z of the optical centre in the link at tilt 0, z from the floor, metres; roll,
            pitch, yaw of the camera, radians.

    Attributes:
        offset_m: Optical centre forward and left of the axis, as the camera looks.
        height_m: Its height where the camera looks level.
    """

    def __init__(self, mount: tuple[float, float, float, float, float, float]) -> None:
        x, y, z, roll, pitch, yaw = mount
        forward = math.cos(yaw) * x + math.sin(yaw) * y
        self.offset_m = forward / math.cos(pitch), math.cos(yaw) * y - math.sin(yaw) * x
        self.height_m = z + forward * math.tan(pitch)
        self._attitude = attitude(roll, pitch, yaw) if roll or pitch or yaw else None

    def look(self, joints: HeadAngles) -> tuple[HeadAngles, float]:
        """Return the joints of a head that looks as the camera does, and the camera's roll."""
        if self._attitude is None:
            return joints, 0.0
        ct, st = math.cos(joints.tilt_rad), math.sin(joints.tilt_rad)
        turned = np.array([[ct, 0.0, -st], [0.0, 1.0, 0.0], [st, 0.0, ct]]) @ self._attitude
        (fx, fy, fz), left_z, up_z = turned[:, 0].tolist(), turned[2, 1], turned[2, 2]
        pan, tilt = joints.pan_rad + math.atan2(fy, fx), math.atan2(fz, math.hypot(fx, fy))
        return replace(joints, pan_rad=pan, tilt_rad=tilt), math.atan2(left_z, up_z)

    def points_in_camera(
        self, points_m: FloatArray, pose: Pose2, joints: HeadAngles
    ) -> FloatArray:
        """Return (n, 3) points of `map` in the optical frame, metres: right, down, forward."""
        joints, roll_rad = self.look(joints)
        azimuth_rad = camera_azimuth(pose.heading_rad, joints)
        offsets_m = points_m - (pose.x_m, pose.y_m, self.height_m)
        level_m = offsets_m @ optical_rotation(azimuth_rad, joints.tilt_rad).T
        level_m -= (-self.offset_m[1], 0.0, self.offset_m[0])
        return level_m @ attitude(0.0, 0.0, -roll_rad).T
