"""Rendering of camera images: LED spots and AprilTags on a dark, noisy background."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.tags import CORNERS, tag_pattern
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.camera_view import (
    CameraPose,
    CameraView,
    OpticsConfig,
    emission,
    emission_axes,
    emission_exponent,
)
from goalreach_sim.simulator_config import SimulatorConfig

_DARK_DN = 0.05
"""A spot is cut off where it is fainter than this, a tenth of rounding; chosen."""

_FULL_DN = 255.0
_NOTHING = (slice(0, 0), slice(0, 0))


def pixel_shares(centre_px: float, sigma_px: float, first: int, last: int) -> FloatArray:
    """Return the fraction of a one-dimensional Gaussian that falls on each of a range of pixels.

    Pixel i extends from i - 0.5 to i + 0.5; the sum is at most one.
    """
    scale, edge_px, erf = 1.0 / (sigma_px * math.sqrt(2.0)), centre_px + 0.5, math.erf
    edges = [0.5 * erf((i - edge_px) * scale) for i in range(first, last + 1)]
    values: FloatArray = np.array(edges)
    return values[1:] - values[:-1]


def spot_window(
    u_px: float, v_px: float, sigma_px: float, flux_dn: float, shape: tuple[int, int]
) -> tuple[slice, slice]:
    """Return the rows and columns of an image that a spot covers, which may be none."""
    peak_dn = flux_dn / (2.0 * math.pi * sigma_px * sigma_px)
    if peak_dn <= _DARK_DN:
        return _NOTHING
    reach_px = sigma_px * math.sqrt(2.0 * math.log(peak_dn / _DARK_DN)) + 1.0
    top, left = max(math.floor(v_px - reach_px), 0), max(math.floor(u_px - reach_px), 0)
    bottom = min(math.ceil(v_px + reach_px) + 1, shape[0])
    right = min(math.ceil(u_px + reach_px) + 1, shape[1])
    seen = top < bottom and left < right
    return (slice(top, bottom), slice(left, right)) if seen else _NOTHING


def _union(parts: Sequence[slice]) -> slice:
    return slice(min(part.start for part in parts), max(part.stop for part in parts))


_SPARE_NOISE = 1 << 17
"""Pixels of the noise bank beyond one image; chosen."""

_SPURIOUS_RANGE_M = (1.0, 6.0)
"""Range of an LED as bright as a spurious light; chosen."""

_SPURIOUS_DRAWS = 4

_TEXTURE_SIZES = (4, 16, 64, 256)
_MOST_IN_STREAK = 32
_CELL, _FINE, _INK = 16, 4, 0.1
"""Pixels of a cell of the page; samples along a pixel; light of black over white's. Chosen."""


def wall_panorama(
    ambient_dn: float, texture: float, shape: tuple[int, int], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return lit, textured walls all around, as seen by a camera that turns without moving."""
    walls_dn = np.full(shape, ambient_dn)
    for size in _TEXTURE_SIZES:
        cells = rng.uniform(1.0 - texture, 1.0 + texture, (size, size))
        walls_dn *= cv2.resize(cells, shape[::-1])
    grey: NDArray[np.uint8] = np.clip(np.rint(walls_dn), 0.0, _FULL_DN).astype(np.uint8)
    return grey


class TagPainter:
    """Draws tags by the projection of their corners; lens distortion inside a tag is left out.

    The camera is the true lens. The generator draws the errors with which the tags hang.

    Attributes:
        view: Projects the corners of the tags, four after four.
    """

    def __init__(
        self, camera: PinholeCamera, config: SimulatorConfig, rng: np.random.Generator
    ) -> None:
        sigma_m, self._blur_px = config.noise.survey_error_m, config.noise.spot_sigma_px
        self._pages, places_m, cells = [], [], np.ones((_CELL, _CELL))
        for tag in config.tag_list:
            white = _INK + (1.0 - _INK) / 255.0 * tag_pattern(config.tag_family, tag.id)
            ink = np.kron(config.optics.tag_white_dn * white, cells)
            self._pages.append(np.dstack([ink, np.ones_like(ink)]))
            errors_m2 = bool(sigma_m) * tag.corner_covariance_m2(sigma_m)
            places_m.append(rng.multivariate_normal(tag.corners_m.reshape(-1), errors_m2))
        self.view = CameraView(camera, np.array(places_m).reshape(-1, 3))

    def paint(self, light: NDArray[np.uint8], corners_px: FloatArray) -> None:
        """Cover the light of an image, (height, width), by the tags in view.

        The corners of their black squares are (n, exposures, 2) pixels, NaN where one is hidden.
        """
        quads = corners_px.reshape(-1, CORNERS, *corners_px.shape[1:]).swapaxes(1, 2)
        for page, quads_px in zip(self._pages, quads.astype(np.float32, order='C'), strict=True):
            if not (np.isfinite(quads_px).all() and cv2.contourArea(quads_px[0], True) > 0.0):
                continue
            margin_px = 0.25 * np.ptp(quads_px, axis=(0, 1)).max() + 4.0 * self._blur_px
            low = np.maximum(quads_px.min(axis=(0, 1)) - margin_px, 0).astype(int)
            high = np.minimum(quads_px.max(axis=(0, 1)) + margin_px, light.shape[::-1]).astype(int)
            if (low < high).all():
                self._cover(light[low[1] : high[1], low[0] : high[0]], page, quads_px - low)

    def _cover(self, light: NDArray[np.uint8], page: FloatArray, quads_px: FloatArray) -> None:
        """Cover a part of an image by a page: the mean of its exposures, blurred by the lens."""
        (height, width), low, high = light.shape, _CELL - 0.5, len(page) - _CELL - 0.5
        square = np.array([[low, low], [high, low], [high, high], [low, high]], np.float32)
        fine = np.zeros((height * _FINE, width * _FINE, 2))
        for corners in ((quads_px + 0.5) * _FINE - 0.5).astype(np.float32):
            turn = cv2.getPerspectiveTransform(square, corners)
            fine += cv2.warpPerspective(page, turn, fine.shape[1::-1]) / len(quads_px)
        seen = fine.reshape(height, _FINE, width, _FINE, 2).mean(axis=(1, 3))
        paper, share = np.moveaxis(cv2.GaussianBlur(seen, (0, 0), self._blur_px), 2, 0)
        light[:] = np.rint(light * (1.0 - share) + paper)


@dataclass(eq=False)
class CameraRenderer:
    """Renders mono8 images of the LEDs.

    An LED is a Gaussian spot, integrated over each pixel and saturated at 255. Its sum of grey
    values falls with the square of the range and with the angle off the LED's axis; its width
    combines the lens and the LED's disc. Read noise comes from a bank that is drawn once and read
    at a random offset for each image.

    Attributes:
        camera: The true lens, not the calibrated one.
        landmarks_m: (n, 3) true positions of the LEDs in `map`.
        noise: Read noise, spot width, exposure, dropouts, spurious lights.
        rng: Generator of the pixel noise.
        event_rng: Generator of dropouts and spurious lights.
        tags: Draws the tags, where there are some.
        dark: Numbers of the LEDs that are dark.
        view: Projects the LEDs; holds the obstacles that may hide LEDs and tags.
    """

    camera: PinholeCamera
    landmarks_m: FloatArray
    arena_size_m: tuple[float, float]
    _: KW_ONLY
    optics: OpticsConfig
    noise: NoiseModel
    rng: np.random.Generator
    event_rng: np.random.Generator
    tags: TagPainter | None = None
    dark: frozenset[int] = frozenset()
    _false_light: CameraView | None = None

    def __post_init__(self) -> None:
        camera, noise, rng = self.camera, self.noise, self.rng
        self.view = CameraView(camera, self.landmarks_m)
        self._axes = emission_axes(self.landmarks_m, *self.arena_size_m).tolist()
        self._exponent = emission_exponent(self.optics.led_half_angle_rad)
        self._shape = (camera.height_px, camera.width_px)
        self._size = camera.height_px * camera.width_px
        dark_dn = rng.standard_normal(self._size + _SPARE_NOISE, dtype=np.float32)
        dark_dn *= np.float32(noise.read_noise_dn)
        dark_dn += np.float32(self.optics.dark_offset_dn)
        self._dark_bank = np.clip(np.rint(dark_dn), 0.0, 255.0).astype(np.uint8)
        self._walls: NDArray[np.uint8] | None = None
        if noise.ambient_dn > 0.0:
            shape = (3 * camera.height_px, math.ceil(2.0 * math.pi * camera.fx_px))
            walls = wall_panorama(noise.ambient_dn, noise.texture, shape, rng)
            self._walls = np.hstack([walls, np.tile(walls, 2)[:, : camera.width_px]])

    def render(self, pose: CameraPose) -> NDArray[np.uint8]:
        """Return a new image (height, width) taken from a pose."""
        offset = int(self.rng.random() * _SPARE_NOISE)
        image: NDArray[np.uint8] = self._dark_bank[offset : offset + self._size].copy()
        image = image.reshape(self._shape)
        light = None if self._walls is None else self._in_view(self._walls, pose).copy()
        if self.tags is not None:
            light = np.zeros_like(image) if light is None else light
            self.tags.view.obstacles = self.view.obstacles
            self.tags.paint(light, np.array(self._exposures(self.tags.view, pose)))
        if light is not None:
            image = np.asarray(cv2.add(image, light), np.uint8)
        exposures = self._exposures(self.view, pose)
        to_camera = (pose.centre_m - self.landmarks_m).tolist()
        events = self.event_rng.random(len(to_camera) + _SPURIOUS_DRAWS).tolist()
        for led, (centres_px, (x_m, y_m, z_m), (ax, ay, az), chance) in enumerate(
            zip(exposures, to_camera, self._axes, events, strict=False)
        ):
            dropped = chance < self.noise.dropout_probability
            if dropped or led in self.dark or math.isnan(sum([u_px for u_px, _ in centres_px])):
                continue
            range_m = math.sqrt(x_m * x_m + y_m * y_m + z_m * z_m)
            along_m = x_m * ax + y_m * ay + z_m * az
            strength = emission(along_m / range_m, self._exponent)
            self._add_spot(image, centres_px, range_m, strength)
        self._add_spurious(image, *events[len(to_camera) :])
        self._add_false_light(image, pose)
        return image

    def _in_view(self, walls: NDArray[np.uint8], pose: CameraPose) -> NDArray[np.uint8]:
        """Return the part of a panorama that the image shows, as if a pixel were an angle."""
        (height, width), focal_px = self._shape, self.camera.fx_px
        around = walls.shape[1] - width
        left = round(-pose.azimuth_rad * focal_px - self.camera.cx_px) % around
        top = min(max(round(height - pose.tilt_rad * focal_px), 0), 2 * height)
        return walls[top : top + height, left : left + width]

    def _exposures(
        self, view: CameraView, pose: CameraPose
    ) -> list[tuple[tuple[float, float], ...]]:
        """Return the pixels of each point during the exposure, about one pixel apart."""
        rate = math.hypot(pose.azimuth_rad_per_s, pose.tilt_rad_per_s)
        streak_px = self.camera.fx_px * rate * self.noise.exposure_s
        count = min(1 + round(streak_px), _MOST_IN_STREAK)
        times_s = [self.noise.exposure_s * ((k + 0.5) / count - 0.5) for k in range(count)]
        return list(zip(*(view.pixels(pose, time_s) for time_s in times_s), strict=True))

    def set_false_light(self, place_m: tuple[float, ...]) -> None:
        """Set a false light that shines in all directions: x, y, z in `map`, metres, or empty."""
        point_m = np.array([place_m], dtype=np.float64)
        self._false_light = CameraView(self.camera, point_m) if place_m else None

    def _add_false_light(self, image: NDArray[np.uint8], pose: CameraPose) -> None:
        if self._false_light is None:
            return
        ((u_px, v_px),) = self._false_light.pixels(pose)
        range_m = float(np.linalg.norm(pose.centre_m - self._false_light.points_m))
        if range_m > 0.0 and not math.isnan(u_px):
            self._add_spot(image, [(u_px, v_px)], range_m, 1.0)

    def _add_spot(
        self,
        image: NDArray[np.uint8],
        centres_px: Sequence[tuple[float, float]],
        range_m: float,
        strength: float,
    ) -> None:
        flux_dn = self.optics.led_flux_dn * strength / (range_m * range_m)
        disc_px = self.camera.fx_px * self.optics.led_radius_m / range_m
        # A uniform disc has a quarter of its squared radius as the variance along each axis.
        sigma_px = math.sqrt(self.noise.spot_sigma_px**2 + 0.25 * disc_px * disc_px)
        windows = [spot_window(u, v, sigma_px, flux_dn, self._shape) for u, v in centres_px]
        windows = [window for window in windows if window[0].start < window[0].stop]
        if not windows:
            return
        rows, columns = map(_union, zip(*windows, strict=True))
        spots_dn = []
        for u_px, v_px in centres_px:
            across = pixel_shares(u_px, sigma_px, columns.start, columns.stop)
            down = pixel_shares(v_px, sigma_px, rows.start, rows.stop)
            down *= flux_dn / len(centres_px)
            spots_dn.append(down[:, None] * across)
        light_dn, window = sum(spots_dn[1:], spots_dn[0]), image[rows, columns]
        light_dn += window
        np.rint(light_dn, out=light_dn)
        np.minimum(light_dn, _FULL_DN, out=light_dn)
        window[...] = light_dn

    def _add_spurious(
        self, image: NDArray[np.uint8], chance: float, across: float, down: float, near: float
    ) -> None:
        if chance >= self.noise.spurious_probability:
            return
        low_m, high_m = _SPURIOUS_RANGE_M
        u_px = across * self.camera.width_px - 0.5
        v_px = down * self.camera.height_px - 0.5
        self._add_spot(image, [(u_px, v_px)], low_m + near * (high_m - low_m), 1.0)


def true_lens(calibrated: PinholeCamera, focal_scale: float) -> PinholeCamera:
    """Return the true lens, whose focal length is the calibrated one times a factor."""
    return replace(
        calibrated, fx_px=calibrated.fx_px * focal_scale, fy_px=calibrated.fy_px * focal_scale
    )
