"""Calibration of a robot from one drive: all images and the odometry in one least-squares fit.

The unknowns are those of `calibration_model`. Their priors decide what images cannot tell: where
`map` lies follows from the survey. Solved by Gauss-Newton steps that weigh down images which do
not fit; the errors of the encoders of each image are eliminated. A landmark whose survey the
images contradict is found by the test of Baarda, "A testing procedure for use in geodetic
networks" (1968), and gets a wide prior.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from goalreach_msgs_py.tags import tags_to_flat
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.calibration_model import (
    DELAY,
    LANDMARKS,
    POSE,
    SCALE,
    SLIP,
    TURN,
    DriveModel,
    DriveRecord,
)
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_prediction import equivalent_gate

_MOUNT: Final = tuple(f'camera_mount {axis}' for axis in ('x', 'y', 'z', 'roll', 'pitch', 'yaw'))
_ODOMETRY: Final = ('odometry.scale', 'odometry.turn_scale', 'odometry.drift_rad_per_m')
_NAMES: Final = (*_MOUNT, *_ODOMETRY, 'camera_delay_s')
_WRONG_SURVEY_M: Final = 0.05
_CONTRADICTED, _INDISTINCT = 20.0, 0.7
"""Squared distance of an LED from its survey beyond which that is wrong (p = 2e-4; of a tag, the
equivalent), and what part of the largest is indistinct from it. Chosen."""
_FARTHEST: Final = 0.15
"""Shift of a landmark, m, or turn of a tag, rad, that means that lights were taken for each other.
Chosen."""
_RANK: Final = 1e-3
_STEP: Final = 1e-6
_ROUNDS, _CONVERGED = 20, 1e-3
_COARSE: Final = 0.02
"""Least error of a pixel over the median residual: far from the solution, images are not linear to
a small part of a pixel. Chosen."""
_OUTLIER: Final = 2.5
"""Residual of an image, over the median if that is above one, from which it counts less. Chosen.
"""
_OBSERVED: Final = 0.5
"""Part of its prior below which a standard deviation must be for a value to count. Chosen."""
_MISFIT: Final = 1.5
"""Residuals over those expected from which the model does not fit. Chosen."""
_FITTING, _USABLE = 0.9, 0.5
_TINY: Final = 1e-9
_OF_TAG: Final = (0, 1, 2, 4)
"""States of a tag that a parameter holds: its place, and its turn about its axis upward."""


@dataclass(frozen=True, kw_only=True)
class CalibratedValue:
    """One calibrated number.

    Attributes:
        name: Its parameter, and which of its numbers.
        value: The value; as given where the drive does not tell it.
        sigma: Its standard deviation.
        given: The value before.
        observed: Whether the drive tells it.
    """

    name: str
    value: float
    sigma: float
    given: float
    observed: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The result of a calibration.

    Attributes:
        parameters: The parameters of `landmark_localizer` that follow.
        residual_px: Root mean square of the residuals per axis, images that do not fit left out.
        expected_px: What it should be.
        misfits: What does not fit, one line each.
        usable: Whether the numbers explain the images.
    """

    values: tuple[CalibratedValue, ...]
    covariance: FloatArray
    parameters: dict[str, Any]
    residual_px: float
    expected_px: float
    misfits: tuple[str, ...]
    usable: bool


class _Equations(NamedTuple):
    """Normal equations of a drive without its priors, in units of the error of a pixel.

    Attributes:
        matrix: (states + 1, states + 1), the residuals as a last column.
        ratio: Squared residuals over their expectation.
        residual_px: Root mean square of the residuals.
        expected_px: What it should be.
        fitting: Part of the images that fit.
    """

    matrix: FloatArray
    ratio: float
    residual_px: float
    expected_px: float
    fitting: float


def _linearize(model: DriveModel, state: FloatArray) -> FloatArray:
    """Return by pixel its derivatives by the state, its residual, those by pan and tilt."""
    here, size = model.pixels(state), len(state)
    rows = np.empty((2 * len(here), size + 3))
    for index, step in enumerate(_STEP * np.eye(size)):
        rows[:, index] = (model.pixels(state + step) - here).reshape(-1) / _STEP
    rows[:, size] = (model.record.pixels_px - here).reshape(-1)
    for index, turn in enumerate(((_STEP, 0.0), (0.0, _STEP)), size + 1):
        rows[:, index] = (model.pixels(state, *turn) - here).reshape(-1) / _STEP
    return rows


def _equations(model: DriveModel, state: FloatArray, config: LocalizerConfig) -> _Equations:
    """Return the normal equations, the errors of the encoders of each image eliminated."""
    rows = _linearize(model, state)
    far_px = float(np.median(np.abs(rows[:, len(state)])))
    sigma_px = max(config.detection.centroid_sigma_px, _COARSE * far_px)
    rows /= sigma_px
    rows, turns = rows[:, :-2], rows[:, -2:] * config.noise.pan_tilt_noise_rad
    begins = 2 * np.flatnonzero(np.diff(model.record.images, prepend=-1))
    lengths = np.diff(begins, append=len(rows))
    shared = np.add.reduceat(turns[:, :, None] * rows[:, None, :], begins)
    own = np.add.reduceat(turns[:, :, None] * turns[:, None, :], begins)
    gain = np.linalg.inv(np.eye(2) + own)
    squares = np.add.reduceat(rows[:, -1] ** 2, begins)
    squares -= np.einsum('ia,iab,ib->i', shared[:, :, -1], gain, shared[:, :, -1])
    sizes = np.sqrt(np.maximum(squares / lengths, _TINY))
    bound = _OUTLIER * max(1.0, float(np.median(sizes)))
    weights = np.minimum(1.0, (bound / sizes) ** 2)
    by_row, fits = np.repeat(weights, lengths), np.repeat(sizes <= bound, lengths)
    explained = (weights[:, None, None] * gain) @ shared
    flat = (len(begins) * 2, rows.shape[1])
    matrix = rows.T @ (by_row[:, None] * rows) - shared.reshape(flat).T @ explained.reshape(flat)
    return _Equations(
        matrix,
        float(weights @ squares) / max(float(by_row.sum()) - len(state), 1.0),
        sigma_px * float(np.sqrt(np.mean(rows[fits, -1] ** 2))),
        sigma_px * float(np.sqrt(1.0 + np.mean(np.sum(turns**2, axis=1)))),
        float(fits.mean()),
    )


class _Fit(NamedTuple):
    """A state, as a difference from what was given, its covariance, and the last equations."""

    state: FloatArray
    covariance: FloatArray
    equations: _Equations


def _fit(
    model: DriveModel, sigmas: FloatArray, state: FloatArray, config: LocalizerConfig
) -> _Fit:
    """Return the most likely state."""
    information = sigmas**-2.0
    for _ in range(_ROUNDS):
        model.linearize_at(float(model.given[DELAY] + state[DELAY]))
        equations = _equations(model, state, config)
        curvature = equations.matrix[:-1, :-1] + np.diag(information)
        gradient = equations.matrix[:-1, -1] - information * state
        step = np.linalg.solve(curvature, gradient)
        state = state + step
        if float(gradient @ step) < _CONVERGED:
            break
    return _Fit(state, np.asarray(np.linalg.inv(curvature), np.float64), equations)


def _contradicted(model: DriveModel, sigmas: FloatArray, fit: _Fit) -> list[int]:
    """Return the landmarks whose survey may be wrong."""
    distances = np.zeros(len(model.groups))
    for index, group in enumerate(model.groups):
        if sigmas[group.start] < _WRONG_SURVEY_M:
            shift = fit.state[group]
            gained = np.diag(sigmas[group] ** 2) - fit.covariance[group, group]
            distance2 = shift @ np.linalg.pinv(gained, rcond=_RANK, hermitian=True) @ shift
            distances[index] = distance2 / equivalent_gate(_CONTRADICTED, 3, len(shift))
    bound = max(1.0, _INDISTINCT * float(distances.max()))
    return [int(index) for index in np.flatnonzero(distances > bound)]


def calibrate(record: DriveRecord, config: LocalizerConfig) -> Calibration:
    """Calibrate a robot."""
    model = DriveModel(record, config)
    sigmas, wrong = model.sigmas.copy(), list[int]()
    fit = _fit(model, sigmas, np.zeros(len(sigmas)), config)
    while found := _contradicted(model, sigmas, fit):
        wrong += found
        for group in (model.groups[index] for index in found):
            sigmas[group.start : group.start + 3] = _WRONG_SURVEY_M
        fit = _fit(model, sigmas, fit.state, config)
    covariance = fit.covariance * max(1.0, fit.equations.ratio)
    spread = np.sqrt(covariance.diagonal())
    unseen = POSE + np.flatnonzero(spread[POSE:SLIP] > _OBSERVED * sigmas[POSE:SLIP])
    if len(unseen):
        sigmas[unseen] = _TINY
        fit = _fit(model, sigmas, fit.state, config)
    states, values = zip(*_values(model, config, fit, spread, set(unseen.tolist())), strict=True)
    return Calibration(
        values=values,
        covariance=covariance[np.ix_(states, states)],
        parameters=_parameters(values, config),
        residual_px=fit.equations.residual_px,
        expected_px=fit.equations.expected_px,
        misfits=tuple(_misfits(model, config, fit, wrong)),
        usable=fit.equations.ratio <= _MISFIT**2
        and fit.equations.fitting > _USABLE
        and bool(np.abs(fit.state[LANDMARKS : model.groups[-1].stop]).max() < _FARTHEST),
    )


def _values(
    model: DriveModel, config: LocalizerConfig, fit: _Fit, spread: FloatArray, unseen: set[int]
) -> Iterator[tuple[int, CalibratedValue]]:
    """Yield the state and the result of each number."""
    for name, state, given in _table(model, config):
        observed, sigma = state not in unseen, float(spread[state])
        value = given + float(fit.state[state]) * observed
        one = CalibratedValue(name=name, value=value, sigma=sigma, given=given, observed=observed)
        yield state, one


def _table(model: DriveModel, config: LocalizerConfig) -> Iterator[tuple[str, int, float]]:
    """Yield name, state and given value of each number."""
    for state, name in enumerate(_NAMES, POSE):
        yield name, state, float(model.given[state]) + (state in {SCALE, TURN})
    leds = config.landmark_array_m.tolist()
    for (index, led), group in zip(enumerate(leds), model.groups, strict=False):
        for axis, at in enumerate(led):
            yield f'landmarks_m LED {index} {"xyz"[axis]}', group.start + axis, at
    for tag, group in zip(config.tag_list, model.groups[len(leds) :], strict=True):
        places = {'x': tag.x_m, 'y': tag.y_m, 'z': tag.z_m, 'facing': tag.facing_rad}
        for offset, (name, at) in zip(_OF_TAG, places.items(), strict=True):
            yield f'tags tag {tag.id} {name}', group.start + offset, at


def _parameters(
    values: tuple[CalibratedValue, ...], config: LocalizerConfig
) -> dict[str, float | tuple[float, ...]]:
    """Return the parameters of `landmark_localizer` with the values."""
    numbers = iter(values)
    mount = tuple(next(numbers) for _ in _MOUNT)
    parameters: dict[str, Any] = {'camera_mount': tuple(one.value for one in mount)}
    parameters |= {name: next(numbers).value for name in _NAMES[len(_MOUNT) :]}
    survey = [*numbers]
    leds, rest = survey[: config.landmark_array_m.size], survey[config.landmark_array_m.size :]
    if leds:
        parameters['landmarks_m'] = tuple(one.value for one in leds)
    fours = zip(config.tag_list, *(iter(rest),) * len(_OF_TAG), strict=True)
    fields = ('x_m', 'y_m', 'z_m', 'facing_rad')
    tags = [
        replace(tag, **{field: one.value for field, one in zip(fields, four, strict=True)})
        for tag, *four in fours
    ]
    if tags:
        parameters['tags'] = tags_to_flat(tags)
    sigma_m = max(one.sigma for one in survey if not one.name.endswith('facing'))
    parameters['noise.survey_error_m'] = max(config.noise.survey_error_m, sigma_m)
    sigma_m = max((one.sigma for one in mount[:2] if one.observed), default=0.0)
    parameters['filter.mount_sigma_m'] = max(config.filter.mount_sigma_m, sigma_m)
    return parameters


def _misfits(
    model: DriveModel, config: LocalizerConfig, fit: _Fit, wrong: list[int]
) -> Iterator[str]:
    leds, (_, ratio, _, _, fitting) = len(config.landmark_array_m), fit.equations
    for index in sorted(wrong):
        start = model.groups[index].start
        name = f'LED {index}' if index < leds else f'tag {config.tag_list[index - leds].id}'
        off_m = float(np.linalg.norm(fit.state[start : start + 3]))
        unsure = ', or another one in its place' if len(wrong) > 1 else ''
        yield f'the survey of {name} is off by {off_m:.3f} m{unsure}'
    if ratio > _MISFIT**2:
        times = f'{ratio**0.5:.1f} times as large as expected'
        yield f'residuals are {times}: check camera_info, the arena, slip of the wheels'
    if fitting < _FITTING:
        yield f'{1.0 - fitting:.0%} of the images do not fit: check lights besides the landmarks'
