"""Rendering of camera images: LED spots on a dark, noisy background."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.camera_view import (
    CameraPose,
    CameraView,
    OpticsConfig,
    Post,
    emission,
    emission_axes,
    emission_exponent,
)

_DARK_DN = 0.05
"""A spot is cut off where it is fainter than this, a tenth of rounding; chosen."""

_FULL_DN = 255.0
_SQRT2 = math.sqrt(2.0)


def pixel_shares(centre_px: float, sigma_px: float, first: int, last: int) -> FloatArray:
    """Return the fraction of a one-dimensional Gaussian that falls on each pixel.

    Args:
        centre_px: Its centre; pixel i extends from i - 0.5 to i + 0.5.
        sigma_px: Its standard deviation.
        first: First pixel.
        last: Pixel after the last.

    Returns:
        (last - first,) fractions with a sum of at most one.
    """
    scale = 1.0 / (sigma_px * _SQRT2)
    edge_px, erf = centre_px + 0.5, math.erf
    values = np.array([0.5 * erf((i - edge_px) * scale) for i in range(first, last + 1)])
    return np.diff(values)


def spot_window(
    u_px: float, v_px: float, sigma_px: float, flux_dn: float, shape: tuple[int, int]
) -> tuple[slice, slice]:
    """Return the rows and columns of an image that a spot covers, which may be none.

    Args:
        u_px: Centre, column.
        v_px: Centre, row.
        sigma_px: Standard deviation.
        flux_dn: Sum of its grey values.
        shape: Rows and columns of the image.
    """
    peak_dn = flux_dn / (2.0 * math.pi * sigma_px * sigma_px)
    if peak_dn <= _DARK_DN:
        return slice(0, 0), slice(0, 0)
    reach_px = sigma_px * math.sqrt(2.0 * math.log(peak_dn / _DARK_DN)) + 1.0
    rows, columns = (
        slice(max(math.floor(at_px - reach_px), 0), min(math.ceil(at_px + reach_px) + 1, size))
        for at_px, size in zip((v_px, u_px), shape, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return slice(0, 0), slice(0, 0)
    return rows, columns


def add_light(window: NDArray[np.uint8], light_dn: FloatArray) -> None:
    """Add light to a window of an image in place, with rounding and saturation at 255."""
    light_dn += window
    np.rint(light_dn, out=light_dn)
    np.maximum(light_dn, 0.0, out=light_dn)  # np.clip costs several times as much as these two
    np.minimum(light_dn, _FULL_DN, out=light_dn)
    window[...] = light_dn


_SPARE_NOISE = 1 << 17
"""Pixels of the noise bank beyond one image; chosen."""

_SPURIOUS_RANGE_M = (1.0, 6.0)
"""Range of an LED as bright as a spurious light; chosen."""

_SPURIOUS_DRAWS = 4


class CameraRenderer:
    """Renders mono8 images of the LEDs.

    An LED is a Gaussian spot, integrated over each pixel and saturated at 255. Its sum of grey
    values falls with the square of the range and with the angle off the LED's axis; its width
    combines the lens and the LED's disc. Read and shot noise come from a bank that is drawn once
    and read at a random offset for each image and each spot.

    Args:
        camera: The true lens, not the calibrated one.
        landmarks_m: (n, 3) true positions of the LEDs in `map`.
        arena_size_m: Arena size along x and y.
        optics: Light, grey values, exposure.
        posts: Posts that may hide LEDs.
        noise: Read noise, spot width, dropouts, spurious lights.
        rng: Generator of the pixel noise.
        event_rng: Generator of dropouts and spurious lights.

    Attributes:
        dark: Numbers of the LEDs that are dark.
    """

    def __init__(
        self,
        camera: PinholeCamera,
        landmarks_m: FloatArray,
        arena_size_m: tuple[float, float],
        *,
        optics: OpticsConfig,
        noise: NoiseModel,
        posts: tuple[Post, ...] = (),
        rng: np.random.Generator,
        event_rng: np.random.Generator,
    ) -> None:
        self._camera = camera
        self._landmarks_m = landmarks_m
        self._view = CameraView(
            camera, landmarks_m, posts=posts, rolling_exposure_s=optics.rolling_exposure_s
        )
        self._axes = emission_axes(landmarks_m, *arena_size_m).tolist()
        self._exponent = emission_exponent(optics.led_half_angle_rad)
        self._optics = optics
        self._noise = noise
        self.dark: frozenset[int] = frozenset()
        self._false_light: tuple[CameraView, FloatArray] | None = None
        self._rng = rng
        self._event_rng = event_rng
        self._shape = (camera.height_px, camera.width_px)
        self._size = camera.height_px * camera.width_px
        self._normal = rng.standard_normal(self._size + _SPARE_NOISE, dtype=np.float32)
        dark_dn = self._normal * np.float32(noise.read_noise_dn)
        dark_dn += np.float32(optics.dark_offset_dn)
        self._dark_bank = np.clip(np.rint(dark_dn), 0.0, 255.0).astype(np.uint8)

    def render(self, pose: CameraPose) -> NDArray[np.uint8]:
        """Return a new image (height, width) taken from a pose."""
        offset = int(self._rng.random() * _SPARE_NOISE)
        image: NDArray[np.uint8] = self._dark_bank[offset : offset + self._size].copy()
        image = image.reshape(self._shape)
        pixels = self._view.pixels(pose)
        to_camera = (pose.centre_m - self._landmarks_m).tolist()
        events = self._event_rng.random(len(pixels) + _SPURIOUS_DRAWS).tolist()
        for led, ((u_px, v_px), (x_m, y_m, z_m), (ax, ay, az), chance) in enumerate(
            zip(pixels, to_camera, self._axes, events, strict=False)
        ):
            dropped = chance < self._noise.dropout_probability
            if dropped or led in self.dark or math.isnan(u_px):
                continue
            range_m = math.sqrt(x_m * x_m + y_m * y_m + z_m * z_m)
            along_m = x_m * ax + y_m * ay + z_m * az
            strength = emission(along_m / range_m, self._exponent)
            self._add_spot(image, u_px, v_px, range_m, strength)
        self._add_spurious(image, *events[len(pixels) :])
        self._add_false_light(image, pose)
        return image

    def set_false_light(self, place_m: tuple[float, ...]) -> None:
        """Set a false light that shines in all directions: x, y, z in `map`, metres, or empty."""
        point_m = np.array([place_m], dtype=np.float64)
        self._false_light = (CameraView(self._camera, point_m), point_m) if place_m else None

    def _add_false_light(self, image: NDArray[np.uint8], pose: CameraPose) -> None:
        if self._false_light is None:
            return
        view, point_m = self._false_light
        ((u_px, v_px),) = view.pixels(pose)
        range_m = float(np.linalg.norm(pose.centre_m - point_m))
        if range_m > 0.0 and not math.isnan(u_px):
            self._add_spot(image, u_px, v_px, range_m, 1.0)

    def _add_spot(
        self, image: NDArray[np.uint8], u_px: float, v_px: float, range_m: float, strength: float
    ) -> None:
        flux_dn = self._optics.led_flux_dn * strength / (range_m * range_m)
        disc_px = self._camera.fx_px * self._optics.led_radius_m / range_m
        # A uniform disc has a quarter of its squared radius as the variance along each axis.
        sigma_px = math.sqrt(self._noise.spot_sigma_px**2 + 0.25 * disc_px * disc_px)
        rows, columns = spot_window(u_px, v_px, sigma_px, flux_dn, self._shape)
        if rows.start >= rows.stop:
            return
        across = pixel_shares(u_px, sigma_px, columns.start, columns.stop)
        down = pixel_shares(v_px, sigma_px, rows.start, rows.stop)
        down *= flux_dn
        light_dn: FloatArray = down[:, None] * across
        if self._optics.shot_noise > 0.0:
            offset = int(self._rng.random() * (len(self._normal) - light_dn.size))
            noise = np.sqrt(light_dn)
            noise *= self._optics.shot_noise
            noise *= self._normal[offset : offset + light_dn.size].reshape(light_dn.shape)
            light_dn += noise
        add_light(image[rows, columns], light_dn)

    def _add_spurious(
        self, image: NDArray[np.uint8], chance: float, across: float, down: float, near: float
    ) -> None:
        if chance >= self._noise.spurious_probability:
            return
        low_m, high_m = _SPURIOUS_RANGE_M
        u_px = across * self._camera.width_px - 0.5
        v_px = down * self._camera.height_px - 0.5
        self._add_spot(image, u_px, v_px, low_m + near * (high_m - low_m), 1.0)


def true_lens(calibrated: PinholeCamera, focal_scale: float) -> PinholeCamera:
    """Return the true lens, whose focal length is the calibrated one times a factor."""
    return dataclasses.replace(
        calibrated, fx_px=calibrated.fx_px * focal_scale, fy_px=calibrated.fy_px * focal_scale
    )
