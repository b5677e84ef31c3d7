"""A day of driving: does vision stay where it was, and how soon is odometry alone lost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import tempfile
from typing import Any

import numpy as np

from goalreach_lab.localization.long_run import BIN_IN, FRAMES_PER_MINUTE
from goalreach_lab.localization.long_run_file import drive_on, read_minutes
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.values import FloatArray

_MINUTES_PER_HOUR = 60
_STAYS = 1.25
"""An hour is as good as the first one up to this ratio; chosen: hours of one robot on random
ways differ by about a tenth."""
_WITHIN_MIN = 10.0
_LOST_SHARE = 0.1
"""Odometry is lost where its region is wrong in so many of the images of a minute. Chosen."""


def study_long(*, hours: float, seed: int, folder: Path | None) -> dict[str, Any]:
    """Return what a day of driving showed.

    Args:
        hours: Length of the drive.
        seed: Of everything random.
        folder: Where finished minutes are kept, to go on from; None for nowhere.
    """
    minutes = max(1, round(hours * _MINUTES_PER_HOUR))
    with tempfile.TemporaryDirectory() as spare:
        place = Path(spare) if folder is None else folder
        return _summary(drive_on(_file(place, seed), minutes=minutes, seed=seed))


def kept_long(folder: Path, seed: int) -> dict[str, Any] | None:
    """Return what the drive that is kept showed so far; None where there is none."""
    minutes = read_minutes(_file(folder, seed))
    return _summary(minutes) if minutes else None


def _file(folder: Path, seed: int) -> Path:
    return folder / f'long-seed-{seed}.jsonl'


def _summary(minutes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return hours and minutes as a figure and the rows need them."""
    chunks = [
        minutes[first : first + _MINUTES_PER_HOUR]
        for first in range(0, len(minutes), _MINUTES_PER_HOUR)
    ]
    hours = [
        _hour(chunk) for chunk in chunks if len(chunk) == _MINUTES_PER_HOUR or chunk is chunks[0]
    ]
    wrong = np.array([minute['odometry_region_wrong'] for minute in minutes])
    lost = wrong > _LOST_SHARE * FRAMES_PER_MINUTE
    first = int(np.argmax(lost)) if lost.any() else len(minutes)
    after = wrong[first:]
    good = sum(minute['good'] for minute in minutes)
    return {
        'minutes': len(minutes),
        'hours': hours,
        'first_wrong_min': first + 1 if lost.any() else None,
        'odometry_wrong_share': float(after.mean() / FRAMES_PER_MINUTE) if len(after) else 0.0,
        'vision_wrong_share': sum(minute['region_wrong'] for minute in minutes) / max(1, good),
        'available': good / (FRAMES_PER_MINUTE * len(minutes)),
        'lost': minutes[-1]['lost'],
        'nees': float(np.mean([minute['nees'] for minute in minutes])),
        'vision_rms_in': [round(minute['rms_in'], 3) for minute in minutes],
        'odometry_in': [round(minute['odometry_in'], 2) for minute in minutes],
    }


def _hour(minutes: Sequence[dict[str, Any]]) -> dict[str, float]:
    good = np.array([minute['good'] for minute in minutes], dtype=np.float64)
    squares = np.array([minute['rms_in'] ** 2 for minute in minutes])
    counts = np.zeros(max(len(minute['bins']) for minute in minutes))
    for minute in minutes:
        counts[: len(minute['bins'])] += minute['bins']
    return {
        'rms_in': float(np.sqrt((good * squares).sum() / good.sum())),
        'p95_in': _quantile(counts, 0.95),
        'max_in': max(minute['max_in'] for minute in minutes),
        'rms_deg': float(np.sqrt(np.mean([minute['rms_deg'] ** 2 for minute in minutes]))),
    }


def _quantile(counts: FloatArray, share: float) -> float:
    """Return a quantile of a histogram of errors, inches: within its bin in proportion."""
    sums = np.cumsum(counts)
    wanted = share * sums[-1]
    at = int(np.searchsorted(sums, wanted))
    before = sums[at - 1] if at else 0.0
    return float(BIN_IN * (at + (wanted - before) / max(counts[at], 1.0)))


def long_rows(found: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of a day of driving."""
    hours = found['hours']
    worst = max(hours, key=lambda hour: hour['p95_in'])
    first, last = hours[0], hours[-1]
    lost_min = found['first_wrong_min']
    return [
        BenchRow(
            name='position error p95 of the worst hour',
            unit='in',
            ours=worst['p95_in'],
            reference=first['p95_in'],
            reference_name='in the first hour',
            goal=Goal(of='ratio', relation='<=', bound=_STAYS),
            n=found['minutes'],
            note=f'{found["minutes"] / _MINUTES_PER_HOUR:.2f} h; last hour p95 '
            f'{last["p95_in"]:.2f}, rms {last["rms_in"]:.2f} in, {last["rms_deg"]:.2f} deg; '
            f'largest of all {max(hour["max_in"] for hour in hours):.2f} in; '
            f'mean NEES {found["nees"]:.2f} (expected 3)',
        ),
        BenchRow(
            name='a good pose is there',
            unit='% of the time',
            ours=100.0 * found['available'],
            n=found['minutes'],
            note=f'given up {found["lost"]} times',
        ),
        BenchRow(
            name='odometry alone: minute in which its region is wrong for a tenth of the time',
            unit='min',
            ours=float(lost_min or found['minutes']),
            goal=Goal(of='ours', relation='<=', bound=_WITHIN_MIN),
            n=found['minutes'],
            note=f'wrong for {100.0 * found["odometry_wrong_share"]:.1f} % of the time from then '
            f'on; vision for {100.0 * found["vision_wrong_share"]:.2f} % of all of it',
        ),
    ]
