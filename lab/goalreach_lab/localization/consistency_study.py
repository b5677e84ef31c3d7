"""Consistency of the covariance: NEES and NIS over many runs against their chi-square bands.

Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation" (2001),
section 5.4.
"""

from collections.abc import Sequence
import functools
from typing import Any

import numpy as np
from scipy.stats import chi2

from goalreach_lab.localization.frame_log import FrameLog
from goalreach_lab.localization.waypoint_robot import FRAMES_PER_S, WaypointRobot
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import FloatArray

_SETTLING_S = 5.0
"""Time for the first search; chosen: it ends within three seconds."""
_LEAST_SHARE = 0.5
"""A time step counts where at least this share of the runs has a pose; chosen."""
_POSE_DOF = 3
_INSIDE_PERCENT = 90.0
_MEASURED = ('nees', 'nis', 'nis_dof')
_FILTERS = {False: 'not calibrating', True: 'calibrating'}


def mean_band(dof: int, runs: int, *, probability: float = 0.95) -> tuple[float, float]:
    """Return the band in which the mean over independent runs of a consistent NEES or NIS lies.

    Args:
        dof: Degrees of freedom of one value.
        runs: Number of independent values in the mean.
        probability: Probability of the band; half of the rest lies on either side.
    """
    low, high = chi2.interval(probability, dof * runs)
    return float(low) / runs, float(high) / runs


def consistency_study(*, runs: int, run_s: float, seed: int, jobs: int) -> Study:
    """Return the study of the mean NEES and NIS of each time step, with their 95 % bands.

    Every run has its own robot and arena, with its own drawn constant errors.

    Args:
        runs: Number of runs.
        run_s: Length of each, seconds.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    return Study(
        name='consistency',
        key=('calibrate', 'run'),
        settings={'run_s': run_s, 'seed': seed},
        cases=[{'calibrate': c, 'run': run} for c in _FILTERS for run in range(runs)],
        measure=per_case(functools.partial(_drive, run_s=run_s, seed=seed), jobs=jobs),
        analyse=functools.partial(_analyse, run_s=run_s),
        rows=_rows,
    )


def _drive(case: Case, *, run_s: float, seed: int) -> Result:
    """Return NEES, NIS and its degrees of freedom at each time step of a run."""
    robot = WaypointRobot(
        (seed, case['run'], 20), noise=noise_preset('nominal'), calibrate=case['calibrate']
    )
    log = FrameLog(robot.localizer.filter)
    for step in robot.run(round(run_s * FRAMES_PER_S)):
        log.add_output(step.frame, step.output)
    kept = log.take().to_json()
    return {name: kept[name] for name in _MEASURED}


def _analyse(results: Sequence[Result], *, run_s: float) -> dict[str, Any]:
    """Return the findings of each filter by its name."""
    found = {}
    for calibrate, name in _FILTERS.items():
        runs = [result for result in results if result['calibrate'] == calibrate]
        if runs:
            found[name] = {'runs': len(runs), 'run_s': run_s, **_time_steps(runs)}
    return found


def _time_steps(runs: Sequence[Result]) -> dict[str, Any]:
    settled = round(_SETTLING_S * FRAMES_PER_S)
    nees, nis, dof = (
        np.array([run[name] for run in runs], dtype=np.float64)[:, settled:] for name in _MEASURED
    )
    least = _LEAST_SHARE * len(runs)
    tracking = np.isfinite(nees).sum(axis=0)
    steps = np.flatnonzero((tracking >= least) & ((dof > 0.0).sum(axis=0) >= least))
    poses, freedom = tracking[steps], dof.sum(axis=0)[steps]
    return {
        'time_s': (_SETTLING_S + steps / FRAMES_PER_S).round(3).tolist(),
        'nees': _series(np.nansum(nees, axis=0)[steps] / poses, poses, _POSE_DOF),
        'nis': _series(nis.sum(axis=0)[steps] / freedom, freedom, 1),
    }


def _series(means: FloatArray, counts: FloatArray, dof: int) -> dict[str, Any]:
    """Return means with their bands and the share of time steps inside, below and above."""
    bands = {int(count): mean_band(dof, int(count)) for count in np.unique(counts)}
    low, high = np.array([bands[int(count)] for count in counts]).reshape(-1, 2).T
    return {
        'mean': means,
        'low': low,
        'high': high,
        'inside': float(((means >= low) & (means <= high)).mean()),
        'below': float((means < low).mean()),
        'above': float((means > high).mean()),
    }


def _rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows; only the NEES of the default, calibrating filter has a goal."""
    rows = []
    for name, found in result.items():
        for what, expected in (('nees', '3'), ('nis', '1 for each degree of freedom')):
            series = found[what]
            has_goal = what == 'nees' and name == _FILTERS[True]
            rows.append(
                BenchRow(
                    name=f'{name}: mean {what.upper()} within its 95 % band',
                    unit='% of time steps',
                    ours=100.0 * series['inside'],
                    goal=Goal(of='ours', relation='>=', bound=_INSIDE_PERCENT)
                    if has_goal
                    else None,
                    n=len(series['mean']),
                    note=f'{found["runs"]} runs of {found["run_s"]:.0f} s; mean '
                    f'{np.mean(series["mean"]):.3f}, expected {expected}; '
                    f'{100.0 * series["below"]:.1f} % below, '
                    f'{100.0 * series["above"]:.1f} % above',
                )
            )
    return rows
