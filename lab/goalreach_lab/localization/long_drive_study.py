"""One robot that drives for a day: drift of the localizer and of odometry, minute by minute."""

from collections.abc import Iterator, Sequence
import functools
import math
from pathlib import Path
import pickle
from typing import Any, Final

import numpy as np

from goalreach_lab.localization.frame_log import pose_error, pose_nees
from goalreach_lab.localization.waypoint_robot import FRAMES_PER_S, WaypointRobot
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study
from goalreach_lab.study_file import code_version
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.files import write_bytes_atomically
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import FloatArray

FRAMES_PER_MINUTE: Final = 60 * FRAMES_PER_S
_MINUTES_PER_HOUR = 60
_BIN_IN = 0.05
"""Width of a bin of the histogram of position errors, inches."""
_BINS = 201
"""The last bin counts all larger errors."""
_CHECKPOINT_MINUTES = 10
"""Minutes between checkpoints of the robot; chosen: they are driven again in seconds."""
_LARGEST_RATIO = 1.25
"""Largest ratio of the worst hour's error to the first hour's; chosen: hours of one robot on
random paths differ by about a tenth."""
_WITHIN_MIN = 10.0
_LOST_SHARE = 0.1
"""Odometry is lost where its region is wrong in this share of a minute's images. Chosen."""


class LongDrive:
    """A robot that drives minute after minute; its odometry starts at the true pose.

    Args:
        seed: Seed of everything random.

    Attributes:
        seed: The same.
        minutes: Minutes driven.
        code: Version of the code of the robot.
    """

    def __init__(self, seed: int) -> None:
        self.seed, self.minutes = seed, 0
        self.code = code_version('src', 'lab')
        self._robot = WaypointRobot((seed, 40), noise=noise_preset('nominal'))

    def drive(self) -> dict[str, Any]:
        """Drive for a minute and return its measurements, JSON-ready."""
        region_at = Arena().regions.region_at
        rows: list[tuple[float, ...]] = []
        odometry_wrong = 0
        for step in self._robot.run(FRAMES_PER_MINUTE):
            truth, odometry = step.frame.truth.pose, step.frame.odometry.pose
            region = region_at(truth.x_m, truth.y_m)
            odometry_wrong += region_at(odometry.x_m, odometry.y_m) != region
            if step.output.mode == 'tracking':
                pose = step.output.estimate.pose
                dx_m, dy_m, turned = pose_error(pose, truth).tolist()
                nees = pose_nees(step.output.estimate, truth)
                wrong = region_at(pose.x_m, pose.y_m) != region
                error_in = math.hypot(dx_m, dy_m) / INCH_M
                rows.append((error_in, math.degrees(turned), nees, wrong))
        self.minutes += 1
        drift = pose_error(odometry, truth)
        return {
            **_summary(np.array(rows, dtype=np.float64).reshape(-1, 4)),
            'odometry_in': math.hypot(drift[0], drift[1]) / INCH_M,
            'odometry_region_wrong': odometry_wrong,
            'lost': step.output.counters.lost,
        }


def _summary(rows: FloatArray) -> dict[str, Any]:
    """Return the measurements of tracked images, (n, 4): inches, degrees, NEES, wrong region."""
    errors_in, turned_deg, nees, wrong = rows.T
    bins = np.bincount(np.minimum(errors_in / _BIN_IN, _BINS - 1).astype(int))
    return {
        'good': len(rows),
        'bins': bins.tolist(),
        'rms_in': _rms(errors_in),
        'max_in': float(errors_in.max(initial=0.0)),
        'rms_deg': _rms(turned_deg),
        'nees': float(nees.mean()) if len(rows) else 0.0,
        'region_wrong': int(wrong.sum()),
    }


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.square(values).mean())) if len(values) else 0.0


def long_drive_study(*, hours: float, seed: int, folder: Path | None) -> Study:
    """Return the study of a robot that drives for many hours.

    Args:
        hours: Length of the drive.
        seed: Seed of everything random.
        folder: Where the robot is kept, so that an interrupted drive resumes; None for nowhere.
    """
    minutes = max(1, round(hours * _MINUTES_PER_HOUR))
    checkpoint = None if folder is None else folder / 'long.checkpoint'
    return Study(
        name='long',
        key=('minute',),
        settings={'seed': seed},
        cases=[{'minute': minute + 1} for minute in range(minutes)],
        measure=functools.partial(_measure, seed=seed, checkpoint=checkpoint),
        analyse=analyse_minutes,
        rows=long_drive_rows,
    )


def _measure(
    cases: Sequence[Case], *, seed: int, checkpoint: Path | None
) -> Iterator[tuple[Case, Result]]:
    """Drive from the last checkpoint to the last minute asked for."""
    wanted = {case['minute'] for case in cases}
    drive = _restore(checkpoint)
    if drive is None or drive.seed != seed or drive.minutes >= min(wanted):
        drive = LongDrive(seed)
    while drive.minutes < max(wanted):
        measured = drive.drive()
        if drive.minutes in wanted:
            yield {'minute': drive.minutes}, measured
        if checkpoint is not None and drive.minutes % _CHECKPOINT_MINUTES == 0:
            write_bytes_atomically(checkpoint, pickle.dumps(drive))


def _restore(checkpoint: Path | None) -> LongDrive | None:
    """Return the robot of a checkpoint, or None without a readable one of the same code."""
    try:
        drive = None if checkpoint is None else pickle.loads(checkpoint.read_bytes())  # noqa: S301 - written by this module
    except (OSError, pickle.UnpicklingError, AttributeError, EOFError, ImportError):
        return None
    same = isinstance(drive, LongDrive) and vars(drive).get('code') == code_version('src', 'lab')
    return drive if same else None


def analyse_minutes(minutes: Sequence[Result]) -> dict[str, Any]:
    """Return the findings of a drive, for rows and figure."""
    chunks = [
        minutes[first : first + _MINUTES_PER_HOUR]
        for first in range(0, len(minutes), _MINUTES_PER_HOUR)
    ]
    whole = [chunk for chunk in chunks if len(chunk) == _MINUTES_PER_HOUR]
    wrong = np.array([minute['odometry_region_wrong'] for minute in minutes])
    lost = np.flatnonzero(wrong > _LOST_SHARE * FRAMES_PER_MINUTE)
    after = wrong[lost[0] :] if len(lost) else np.zeros(1)
    good = sum(minute['good'] for minute in minutes)
    return {
        'minutes': len(minutes),
        'hours': [_hour(chunk) for chunk in whole or chunks[:1]],
        'first_wrong_min': int(lost[0]) + 1 if len(lost) else None,
        'odometry_wrong_share': float(after.mean() / FRAMES_PER_MINUTE),
        'vision_wrong_share': sum(minute['region_wrong'] for minute in minutes) / max(1, good),
        'available': good / (FRAMES_PER_MINUTE * len(minutes)),
        'lost': minutes[-1]['lost'],
        'nees': float(np.mean([minute['nees'] for minute in minutes])),
        'vision_rms_in': [minute['rms_in'] for minute in minutes],
        'odometry_in': [minute['odometry_in'] for minute in minutes],
    }


def _hour(minutes: Sequence[Result]) -> dict[str, float]:
    good = np.array([minute['good'] for minute in minutes], dtype=np.float64)
    squares = np.array([minute['rms_in'] ** 2 for minute in minutes])
    counts = np.zeros(_BINS)
    for minute in minutes:
        counts[: len(minute['bins'])] += minute['bins']
    return {
        'rms_in': float(np.sqrt((good * squares).sum() / max(1.0, good.sum()))),
        'p95_in': quantile_in(counts, 0.95),
        'max_in': max(minute['max_in'] for minute in minutes),
        'rms_deg': _rms(np.array([minute['rms_deg'] for minute in minutes])),
    }


def quantile_in(counts: FloatArray, share: float) -> float:
    """Return a quantile of a histogram of errors, inches, interpolated within its bin."""
    sums = np.concatenate([[0.0], np.cumsum(counts)])
    return float(np.interp(share * sums[-1], sums, _BIN_IN * np.arange(len(sums))))


def long_drive_rows(found: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of a long drive."""
    hours, minutes = found['hours'], found['minutes']
    worst = max(hours, key=lambda hour: hour['p95_in'])
    first, last = hours[0], hours[-1]
    return [
        BenchRow(
            name='position error p95 of the worst hour',
            unit='in',
            ours=worst['p95_in'],
            reference=first['p95_in'],
            reference_name='in the first hour',
            goal=Goal(of='ratio', relation='<=', bound=_LARGEST_RATIO),
            n=minutes,
            note=f'{minutes / _MINUTES_PER_HOUR:.2f} h; last hour p95 '
            f'{last["p95_in"]:.2f}, rms {last["rms_in"]:.2f} in, {last["rms_deg"]:.2f} deg; '
            f'largest of all {max(hour["max_in"] for hour in hours):.2f} in; '
            f'mean NEES {found["nees"]:.2f} (expected 3)',
        ),
        BenchRow(
            name='trusted pose available',
            unit='% of the time',
            ours=100.0 * found['available'],
            n=minutes,
            note=f'track lost {found["lost"]} times',
        ),
        BenchRow(
            name='odometry alone: minute in which its region is wrong for a tenth of the time',
            unit='min',
            ours=float(found['first_wrong_min'] or math.inf),
            goal=Goal(of='ours', relation='<=', bound=_WITHIN_MIN),
            n=minutes,
            note=f'wrong for {100.0 * found["odometry_wrong_share"]:.1f} % of the time from then '
            f'on; vision for {100.0 * found["vision_wrong_share"]:.2f} % of the whole time',
        ),
    ]
