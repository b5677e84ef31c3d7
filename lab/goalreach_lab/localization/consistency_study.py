"""Whether the covariance is honest: NEES and NIS over many runs against their bands."""

from __future__ import annotations

import functools
from typing import Any, Final

import numpy as np

from goalreach_evaluation.sessions import each
from goalreach_lab.localization.consistency import mean_band
from goalreach_lab.localization.frame_log import FrameLog
from goalreach_lab.localization.wanderer import Wanderer
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import FloatArray

_FRAMES_PER_S: Final = 25
_SETTLING_S: Final = 5.0
"""Time for the first search; chosen: it ends within three seconds."""
_LEAST_SHARE = 0.5
"""A step is judged where at least this part of the runs has a pose; chosen."""
_POSE_DOF = 3
_INSIDE = 90.0


def study_consistency(
    *, runs: int, run_s: float, seed: int, jobs: int, calibrate: bool
) -> dict[str, Any]:
    """Return the mean NEES and NIS of each time step, with their 95 % bands.

    Every run has a robot and a set-up of its own, with its own drawn constant errors.

    Args:
        runs: How many.
        run_s: Length of each, seconds.
        seed: Of everything random.
        jobs: Processes.
        calibrate: Whether the localizer calibrates itself.
    """
    run = functools.partial(_run, run_s=run_s, seed=seed, calibrate=calibrate)
    found = np.array(list(each(run, range(runs), jobs=jobs)))[
        :, round(_SETTLING_S * _FRAMES_PER_S) :
    ]
    nees, nis, dof = found[..., 0], found[..., 1], found[..., 2]
    tracking = np.isfinite(nees)
    corrected = (dof > 0.0).sum(axis=0)
    judged = (tracking.sum(axis=0) >= _LEAST_SHARE * runs) & (corrected >= _LEAST_SHARE * runs)
    steps = np.flatnonzero(judged)
    poses = tracking.sum(axis=0)[steps]
    freedom = dof.sum(axis=0)[steps]
    return {
        'runs': runs,
        'run_s': run_s,
        'time_s': (_SETTLING_S + steps / _FRAMES_PER_S).round(3).tolist(),
        'nees': _series(np.nansum(nees, axis=0)[steps] / poses, poses, _POSE_DOF),
        'nis': _series(nis.sum(axis=0)[steps] / freedom, freedom, 1),
    }


def _run(number: int, *, run_s: float, seed: int, calibrate: bool) -> FloatArray:
    """Return NEES, NIS and its degrees of freedom at each step of a run, (n, 3)."""
    robot = Wanderer((seed, number, 20), noise=noise_preset('nominal'), calibrate=calibrate)
    log = FrameLog(robot.localizer.filter)
    for step in robot.run(round(run_s * _FRAMES_PER_S)):
        log.look(step.frame, step.output)
    frames = log.take()
    return np.stack([frames.nees, frames.nis, frames.nis_dof], axis=1)


def _series(means: FloatArray, counts: FloatArray, dof: int) -> dict[str, Any]:
    """Return means with their bands and the share of steps within."""
    bands = {int(count): mean_band(dof, int(count)) for count in np.unique(counts)}
    low, high = np.array([bands[int(count)] for count in counts]).reshape(-1, 2).T
    return {
        'mean': means.round(4).tolist(),
        'low': low.round(4).tolist(),
        'high': high.round(4).tolist(),
        'inside': float(((means >= low) & (means <= high)).mean()),
        'below': float((means < low).mean()),
        'above': float((means > high).mean()),
    }


def consistency_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of consistency, with and without calibration.

    Only the localizer as it drives, which calibrates itself, is held to an aim.
    """
    rows = []
    for name, found in result.items():
        for what in ('nees', 'nis'):
            judged = what == 'nees' and name == 'calibrating'
            series = found[what]
            mean = float(np.mean(series['mean']))
            expected = '3' if what == 'nees' else '1 for each degree of freedom'
            rows.append(
                BenchRow(
                    name=f'{name}: mean {what.upper()} within its 95 % band',
                    unit='% of time steps',
                    ours=100.0 * series['inside'],
                    goal=Goal(of='ours', relation='>=', bound=_INSIDE) if judged else None,
                    n=len(series['mean']),
                    note=f'{found["runs"]} runs of {found["run_s"]:.0f} s; mean {mean:.3f}, '
                    f'expected {expected}; {100.0 * series["below"]:.1f} % below, '
                    f'{100.0 * series["above"]:.1f} % above',
                )
            )
    return rows
