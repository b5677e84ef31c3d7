"""Data association without a prior: every labelling is solved, an ambiguous best is rejected.

Bearings alone often fit a wrong labelling; pixels (u, v) with the known heights of the LEDs and
the tilt do not, so all labellings are solved on pixels and compared by chi-square.
"""

from dataclasses import dataclass
import functools
from itertools import combinations, permutations, product

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_prediction import equivalent_gate
from goalreach_perception.one_image_pose import (
    ImageGeometry,
    Solutions,
    align,
    level_points,
    solve_poses,
    triangulate,
)

_PAIR, _TRIPLE = 2, 3
_SAME_M = 0.05
_SAME_RAD = 0.02
"""Solutions closer than this are the same. Chosen: far above the error of a converged one."""
_LARGE_M = 0.6
"""An LED that is nearer may be too large to be found. Chosen: of 20 mm radius."""
_SEED_MARGIN_M = 0.6
_MOST_SOLVED = 24
_MOST_ITERATIONS = 12
_LARGEST_MISFIT_PX = 100.0
"""Largest residual of an initial guess that may converge to a valid pose. Chosen: the largest that
did was 71 px."""


@dataclass(frozen=True, kw_only=True)
class AssociationConfig(Configuration):
    """When a labelling is accepted."""

    triple_gate: float = parameter(
        30.0, 'Largest chi-square of three LEDs in one image, 3 dof (p = 1e-6)', within=(1.0, None)
    )
    pair_gate: float = parameter(
        8.0, 'Largest chi-square of two LEDs of a panorama, 1 dof (p = 5e-3)', within=(1.0, None)
    )
    margin: float = parameter(
        25.0,
        'Least difference of the chi-square of the second best (likelihood ratio e^-12)',
        within=(1.0, None),
    )
    wall_clearance_m: float = parameter(
        0.1,
        'Least distance of a pose from the walls, m (chosen: the body has a radius of 0.225 m)',
        within=(-5.0, 5.0),
    )


@dataclass(frozen=True)
class Fix:
    """A pose from one image alone.

    Attributes:
        x_m: Position in `map`.
        y_m: Position in `map`.
        azimuth_rad: Azimuth of the optical axis in `map`, not wrapped.
        chi2: Chi-square of the pixels, 2 k - 3 degrees of freedom.
        information: (3, 3) inverse covariance of x, y, azimuth.
        spots: (k,) indices of the spots used.
        leds: (k,) LED of each of them.
    """

    x_m: float
    y_m: float
    azimuth_rad: float
    chi2: float
    information: FloatArray
    spots: NDArray[np.intp]
    leds: NDArray[np.intp]


@functools.lru_cache(maxsize=64)
def labellings(
    spot_count: int, led_count: int, size: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all assignments of `size` of the spots to different LEDs.

    Returns:
        Two (m, size) arrays: indices of the spots (ascending) and of their LEDs.
    """
    spots, leds = combinations(range(spot_count), size), permutations(range(led_count), size)
    pairs = np.array([*product(spots, leds)], dtype=np.intp).reshape(-1, 2, size)
    return pairs[:, 0], pairs[:, 1]


def identify(
    geometry: ImageGeometry,
    pixels_px: FloatArray,
    sigmas_px: FloatArray,
    *,
    arena_size_m: tuple[float, float],
    config: AssociationConfig,
    reach_rad: float | None = None,
) -> Fix | None:
    """Return the one pose and labelling that explain an image or a panorama, or None.

    Three spots are needed, since a lamp and an LED often fit some pose; or exactly two whose pose
    has all other LEDs so high or so near that a search may not find them. None if no labelling
    fits, or different ones do.

    Args:
        geometry: Everything known.
        pixels_px: (n, 2) ideal pixels of the spots.
        sigmas_px: (n,) standard deviation of each per axis.
        arena_size_m: Width and length of the arena.
        config: When a labelling is accepted.
        reach_rad: How far above the horizon a search sees; None for no search.
    """
    size = min(len(pixels_px), _TRIPLE)
    if size < _PAIR or (size < _TRIPLE and reach_rad is None):
        return None
    fits = _solve(geometry, pixels_px, sigmas_px, size, arena_size_m=arena_size_m)
    fix = None if fits is None else _choose(*fits, arena_size_m, config)
    if fix is None or reach_rad is None or size == _TRIPLE:
        return fix
    offsets_m = np.delete(geometry.leds_m[: geometry.led_count], fix.leds, axis=0)
    offsets_m -= fix.x_m, fix.y_m, geometry.camera_height_m
    rises_rad = np.arctan2(offsets_m[:, 2], np.hypot(offsets_m[:, 0], offsets_m[:, 1]))
    unseen = (rises_rad > reach_rad) | (np.linalg.norm(offsets_m, axis=1) < _LARGE_M)
    return fix if fix.chi2 <= config.pair_gate and unseen.all() else None


def _choose(
    solutions: Solutions,
    spots: NDArray[np.intp],
    leds: NDArray[np.intp],
    arena_size_m: tuple[float, float],
    config: AssociationConfig,
) -> Fix | None:
    """Return the best solution in the arena if it fits and no other one fits nearly as well."""
    inside = _inside(solutions.poses, arena_size_m, -config.wall_clearance_m)
    chi2 = np.where(inside, solutions.chi2, np.inf)
    best = int(chi2.argmin())
    others = chi2[_differ(solutions.poses, spots, leds, best)]
    ambiguous = others.size and others.min() < chi2[best] + config.margin
    gate = equivalent_gate(config.triple_gate, _TRIPLE, 2 * leds.shape[1] - _TRIPLE)
    if ambiguous or chi2[best] > gate:
        return None
    (x_m, y_m, azimuth), least = solutions.poses[best].tolist(), float(chi2[best])
    return Fix(x_m, y_m, azimuth, least, solutions.information[best], spots[best], leds[best])


def identify_labelled(
    geometry: ImageGeometry,
    pixels_px: FloatArray,
    sigmas_px: FloatArray,
    leds: NDArray[np.intp],
    *,
    seeds: FloatArray,
    arena_size_m: tuple[float, float],
    config: AssociationConfig,
) -> Fix | None:
    """Return the one pose that explains landmarks of known identity, or None.

    A small or distant tag looks nearly the same from two sides; both poses are compared. Arguments
    are those of `identify`, the landmark (k,) of each pixel, and initial guesses (m, 3) of x, y,
    azimuth.
    """
    spots, many = np.arange(len(leds)), (len(seeds), 1)
    rows = {'spots': np.tile(spots, many), 'leds': np.tile(leds, many)}
    solutions = solve_poses(
        geometry, pixels_px, sigmas_px, **rows, seeds=seeds, iterations=_MOST_ITERATIONS
    )
    return _choose(solutions, **rows, arena_size_m=arena_size_m, config=config)


def _solve(
    geometry: ImageGeometry,
    pixels_px: FloatArray,
    sigmas_px: FloatArray,
    size: int,
    *,
    arena_size_m: tuple[float, float],
) -> tuple[Solutions, NDArray[np.intp], NDArray[np.intp]] | None:
    """Solve all labellings of `size` spots with a valid initial guess."""
    spots, leds = labellings(len(pixels_px), geometry.led_count, size)
    seeds = _seeds(geometry, pixels_px, spots, leds)
    repeats = len(seeds) // len(spots)
    spots, leds = np.tile(spots, (repeats, 1)), np.tile(leds, (repeats, 1))
    with np.errstate(invalid='ignore'):
        possible = np.flatnonzero(_inside(seeds, arena_size_m, _SEED_MARGIN_M))
    if len(possible) == 0:
        return None
    _, first = geometry.project(seeds[possible], leds[possible], spots[possible])
    misfit_px = np.abs(first.pixels_px - pixels_px[spots[possible]]).max(axis=(1, 2))
    kept = np.argsort(misfit_px)[: min(_MOST_SOLVED, int((misfit_px < _LARGEST_MISFIT_PX).sum()))]
    if len(kept) == 0:
        return None
    possible = possible[kept]
    spots, leds, seeds = spots[possible], leds[possible], seeds[possible]
    solutions = solve_poses(geometry, pixels_px, sigmas_px, spots=spots, leds=leds, seeds=seeds)
    return solutions, spots, leds


def _seeds(
    geometry: ImageGeometry, pixels_px: FloatArray, spots: NDArray[np.intp], leds: NDArray[np.intp]
) -> FloatArray:
    """Return initial guesses (r m, 3): by range and bearing, and by three bearings alone."""
    slopes = ((pixels_px - geometry.lens.centre_px) / geometry.lens.focal_px)[spots]
    tilts = geometry.tilts_rad[spots]
    turns = np.exp(1j * geometry.turns_rad)[spots]
    places = geometry.leds_m[leds]
    flat: NDArray[np.complex128] = places[..., 0] + 1j * places[..., 1]
    rises_m = places[..., 2] - geometry.camera_height_m
    seeds = align(flat, turns * level_points(slopes, rises_m, tilts))
    if leds.shape[1] != _TRIPLE:
        return seeds
    rays = turns * (np.cos(tilts) + np.sin(tilts) * slopes[..., 1] - 1j * slopes[..., 0])
    return np.concatenate([seeds, triangulate(flat, rays / np.abs(rays))])


def _inside(
    poses: FloatArray, arena_size_m: tuple[float, float], margin_m: float
) -> NDArray[np.bool_]:
    """Return which poses lie in the arena enlarged by a margin; False for NaN."""
    width_m, length_m = arena_size_m
    x, y = poses[:, 0], poses[:, 1]
    inside_x = (x > -margin_m) & (x < width_m + margin_m)
    return inside_x & (y > -margin_m) & (y < length_m + margin_m)


def _differ(
    poses: FloatArray, spots: NDArray[np.intp], leds: NDArray[np.intp], best: int
) -> NDArray[np.bool_]:
    """Return which solutions differ from the best one; other LEDs of the same pose do not."""
    away = np.abs(poses - poses[best])
    turned = np.abs(np.remainder(away[:, 2] + np.pi, 2.0 * np.pi) - np.pi)
    moved = (away[:, :2].max(axis=1) > _SAME_M) | (turned > _SAME_RAD)
    same_led = leds[:, :, None] == leds[best]
    same_spot = spots[:, :, None] == spots[best]
    relabelled = (leds != leds[best]).any(axis=1) & (same_led != same_spot).any(axis=(1, 2))
    different: NDArray[np.bool_] = moved | relabelled
    return different
