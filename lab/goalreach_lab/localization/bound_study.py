"""One image with three LEDs and pure pixel noise: the error beside the Cramer-Rao bound."""

from __future__ import annotations

import functools
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.sessions import each
from goalreach_lab.localization.bounds import Bound, one_image_bound
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.camera import optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.association import AssociationConfig, identify
from goalreach_perception.head_tracker import HeadConfig, HeadTracker
from goalreach_perception.measurement_model import LEDS, Lens, project
from goalreach_perception.one_image_pose import ImageGeometry, solve_poses
from goalreach_perception.triangulation import align, level_points
from goalreach_sim.simulator_config import SimulatorConfig

NOISES_PX: Final = (0.1, 0.3, 1.0)
_COLUMNS, _ROWS = 15, 21
_TRIPLE = 3
_WALL_M = BODY_RADIUS_M + 0.02
_SAME = 1e-3
_SURE_TRIALS = 4000
"""With fewer images at a place chance alone exceeds what is aimed at. Chosen."""
_WORST_SIGMAS = 3.0
"""The largest of some hundred normal numbers."""
_DEGREES = math.degrees(1.0)
_CONFIG: Final = SimulatorConfig()
_LENS: Final = Lens.of_camera(_CONFIG.calibrated_camera)


def study_bound(*, trials: int, identified: int, seed: int, jobs: int) -> dict[str, Any]:
    """Return errors and bounds over a grid of the floor.

    Args:
        trials: Noisy images for each place and noise: solved with the right labelling.
        identified: How many of them are labelled as well, as the localizer does it.
        seed: Of the noise and of the headings.
        jobs: Processes.

    Returns:
        Places with three LEDs (`x_m`, `y_m`), and by noise the bound and what was measured at
        each of them.
    """
    arena = Arena()
    xs = np.linspace(_WALL_M, arena.width_m - _WALL_M, _COLUMNS)
    ys = np.linspace(_WALL_M, arena.length_m - _WALL_M, _ROWS)
    floor = [(x, y) for y in ys.tolist() for x in xs.tolist()]
    places = [place for place in floor if _bound(*place, 1.0).leds == _TRIPLE]
    items = list(enumerate(places))
    solve = functools.partial(_at_place, trials=trials, identified=identified, seed=seed)
    cells = list(each(solve, items, jobs=jobs))
    return {
        'x_m': [x for x, _ in places],
        'y_m': [y for _, y in places],
        'floor': [_COLUMNS, _ROWS],
        'trials': trials,
        'identified': identified,
        'cells': {
            str(noise): [cell[index] for cell in cells] for index, noise in enumerate(NOISES_PX)
        },
    }


def _bound(x_m: float, y_m: float, noise_px: float) -> Bound:
    return one_image_bound(
        x_m,
        y_m,
        leds_m=_CONFIG.landmark_array_m,
        camera=_CONFIG.calibrated_camera,
        camera_height_m=_CONFIG.camera_height_m,
        pixel_sigma_px=noise_px,
    )


def _at_place(
    item: tuple[int, tuple[float, float]], *, trials: int, identified: int, seed: int
) -> list[dict[str, float]]:
    """Return what was measured at one place, for each noise."""
    number, place = item
    rng = np.random.default_rng([seed, number])
    return [
        _with_noise(place, noise, rng, trials=trials, identified=identified) for noise in NOISES_PX
    ]


def _with_noise(
    place: tuple[float, float],
    noise_px: float,
    rng: np.random.Generator,
    *,
    trials: int,
    identified: int,
) -> dict[str, float]:
    x_m, y_m = place
    azimuth, tilt, pixels_px = _image(x_m, y_m)
    noisy_px = pixels_px + noise_px * rng.standard_normal((trials, _TRIPLE, 2))
    poses, chi2 = _solved(noisy_px, noise_px, tilt)
    away_m = poses[:, :2] - [x_m, y_m]
    turned = np.remainder(poses[:, 2] - azimuth + np.pi, 2.0 * np.pi) - np.pi
    bound = _bound(x_m, y_m, noise_px)
    none = wrong = 0
    for pose, image_px in zip(poses[:identified], noisy_px, strict=False):
        fix = _identified(image_px, noise_px, tilt)
        none += fix is None
        wrong += fix is not None and bool(np.abs(fix - pose).max() > _SAME)
    return {
        'bound_in': bound.position_sigma_m / INCH_M,
        'rms_in': float(np.sqrt((away_m * away_m).sum(axis=1).mean())) / INCH_M,
        'bound_deg': bound.heading_sigma_rad * _DEGREES,
        'rms_deg': float(np.sqrt((turned * turned).mean())) * _DEGREES,
        'chi2': float(chi2.mean()),
        'not_identified': none,
        'wrongly_identified': wrong,
    }


def _image(x_m: float, y_m: float) -> tuple[float, float, FloatArray]:
    """Return azimuth and tilt of the camera that holds the LEDs, and their exact pixels."""
    offsets_m = _CONFIG.landmark_array_m - np.array([x_m, y_m, _CONFIG.camera_height_m])
    azimuth, tilt = HeadTracker(HeadConfig()).aim_at(offsets_m.tolist(), _LENS)
    rotation = optical_rotation(azimuth, tilt)
    return azimuth, tilt, project(offsets_m, rotation, _LENS).pixels_px


def _geometry(spots: int, tilt: float) -> ImageGeometry:
    """Return what is known of an image: everything, exactly, but the pose."""
    states = LEDS + _CONFIG.landmark_array_m.size
    return ImageGeometry(
        leds_m=_CONFIG.landmark_array_m,
        camera_height_m=_CONFIG.camera_height_m,
        turns_rad=np.zeros(spots),
        tilts_rad=np.full(spots, tilt),
        lens=_LENS,
        nuisance_covariance=np.zeros((states, states)),
        tilt_noise_rad=0.0,
    )


def _solved(images_px: FloatArray, noise_px: float, tilt: float) -> tuple[FloatArray, FloatArray]:
    """Return pose and chi-square of many images, the labelling known."""
    count = len(images_px)
    geometry = _geometry(_TRIPLE * count, tilt)
    leds_m = geometry.leds_m
    slopes = (images_px - _LENS.centre_px) / _LENS.focal_px
    level_m = level_points(slopes, leds_m[:, 2] - geometry.camera_height_m, np.array(tilt))
    flat_m = np.tile(leds_m[:, 0] + 1j * leds_m[:, 1], (count, 1))
    found = solve_poses(
        geometry,
        images_px.reshape(-1, 2),
        np.full(_TRIPLE * count, noise_px),
        spots=np.arange(_TRIPLE * count).reshape(count, _TRIPLE),
        leds=np.tile(np.arange(_TRIPLE), (count, 1)),
        seeds=align(flat_m, level_m),
    )
    return found.poses, found.chi2


def _identified(image_px: FloatArray, noise_px: float, tilt: float) -> FloatArray | None:
    """Return the pose of an image whose LEDs nobody names, as the localizer finds it."""
    fix = identify(
        _geometry(_TRIPLE, tilt),
        image_px,
        np.full(_TRIPLE, noise_px),
        arena_size_m=(_CONFIG.arena_width_m, _CONFIG.arena_length_m),
        config=AssociationConfig(),
    )
    return None if fix is None else np.array([fix.x_m, fix.y_m, fix.azimuth_rad])


def bound_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return what is held against the bound."""
    rows: list[BenchRow] = []
    for noise, cells in result['cells'].items():
        rows += _rows_of(noise, cells, result)
    return rows


def _rows_of(noise: str, cells: list[dict[str, float]], result: dict[str, Any]) -> list[BenchRow]:
    within, about_3 = (Goal(of='ours', relation='<=', bound=bound) for bound in (5.0, 0.1))
    rows = []
    for what, unit in (('position', 'in'), ('heading', 'deg')):
        bounds, errors = (
            np.array([cell[f'{name}_{unit}'] for cell in cells]) for name in ('bound', 'rms')
        )
        ratio = float(np.sqrt((errors**2).sum() / (bounds**2).sum()))
        worst = float((errors / bounds)[np.argmax(np.abs(errors / bounds - 1.0))])
        rows.append(
            BenchRow(
                name=f'{noise} px: rms {what} error off the Cramer-Rao bound',
                unit='%',
                ours=100.0 * abs(ratio - 1.0),
                goal=within,
                n=len(cells) * result['trials'],
                note=f'{ratio:.4f} of it; median bound {np.median(bounds):.3f} {unit}',
            )
        )
        rows.append(
            BenchRow(
                name=f'{noise} px: the same of the {what} at the worst place',
                unit='%',
                ours=100.0 * abs(worst - 1.0),
                goal=within if result['trials'] >= _SURE_TRIALS else None,
                n=result['trials'],
                note=f'{worst:.3f} of it, of {len(cells)} places; chance alone makes up to '
                f'{100.0 * _WORST_SIGMAS / math.sqrt(2.0 * result["trials"]):.1f} %',
            )
        )
    chi2 = float(np.mean([cell['chi2'] for cell in cells]))
    rows.append(
        BenchRow(
            name=f'{noise} px: mean chi-square off its 3 degrees of freedom',
            unit='',
            ours=abs(chi2 - 3.0),
            goal=about_3,
            n=len(cells) * result['trials'],
            note=f'mean {chi2:.4f}',
        )
    )
    tried = len(cells) * result['identified']
    none = sum(cell['not_identified'] for cell in cells)
    rows.append(
        BenchRow(
            name=f'{noise} px: images labelled wrongly',
            unit='images',
            ours=sum(cell['wrongly_identified'] for cell in cells),
            goal=Goal(of='ours', relation='<=', bound=0.0),
            n=tried,
            note=f'{none:.0f} called ambiguous or fitting nowhere',
        )
    )
    return rows
