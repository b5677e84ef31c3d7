"""Robots carried off to random places: found again, how soon, and never believed elsewhere."""

from __future__ import annotations

import functools
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.sessions import each
from goalreach_lab.localization.frame_log import WRONG_IN, FrameLog, percentiles
from goalreach_lab.localization.wanderer import Wanderer
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.noise import noise_preset

_PER_ROBOT: Final = 20
"""Kidnappings of one robot with its own drawn errors; chosen."""
_WITHIN_S = 30.0
_RIGHT_M = WRONG_IN * INCH_M
_FRAMES_PER_S = 25
_SURE_FRAMES = 25
"""Images with a right pose in a row after which a robot is found; chosen: one second."""


def study_kidnaps(*, count: int, seed: int, jobs: int) -> dict[str, Any]:
    """Return how kidnapped robots fared.

    Nothing tells the robot: no encoder counts and no joint moves while it is carried.

    Args:
        count: Kidnappings; whole robots of 20 are done.
        seed: Of everything random.
        jobs: Processes.
    """
    robots = -(-count // _PER_ROBOT)
    life = functools.partial(_life, seed=seed, most=count)
    lives = each(life, range(robots), jobs=jobs)
    kidnaps = [one for some in lives for one in some][:count]
    return {'kidnaps': kidnaps}


def _life(number: int, *, seed: int, most: int) -> list[dict[str, float]]:
    """Return what happened at each kidnapping of one robot."""
    robot = Wanderer((seed, number, 30), noise=noise_preset('nominal'))
    _until_found(robot)
    found = []
    for _ in range(min(most, _PER_ROBOT)):
        for _ in range(_FRAMES_PER_S):
            robot.step()
        robot.carry_off()
        found.append(_until_found(robot))
    return found


def _until_found(robot: Wanderer) -> dict[str, float]:
    """Return how long the old pose was believed, when a right one came, wrong ones after that."""
    log = FrameLog()
    right_in_a_row = 0
    for step in robot.run(round(_WITHIN_S * _FRAMES_PER_S)):
        good = log.look(step.frame, step.output)
        position = step.frame.truth.pose
        pose = step.output.estimate.pose
        away_m = math.hypot(pose.x_m - position.x_m, pose.y_m - position.y_m)
        right = good and away_m < _RIGHT_M
        right_in_a_row = right_in_a_row + 1 if right else 0
        if right_in_a_row >= _SURE_FRAMES:
            break
    frames = log.take()
    wrong, trusted = frames.wrong, frames.trusted
    times = (frames.time_s - frames.time_s[0]) + 1.0 / _FRAMES_PER_S
    doubted = int(np.argmin(wrong)) if not wrong.all() else len(wrong)
    right_at = np.flatnonzero(trusted & ~wrong)
    return {
        'believed_s': doubted / _FRAMES_PER_S,
        'found_s': float(times[right_at[0]]) if right_in_a_row >= _SURE_FRAMES else math.inf,
        'wrong_again': float(wrong[doubted:].sum()),
        'worst_in': float(np.nanmax(frames.error_in[doubted:], initial=0.0)),
    }


def _worst(again: list[dict[str, float]]) -> str:
    """Return in words what was believed wrongly."""
    if not again:
        return f'wrong: more than {WRONG_IN:g} in off, or outside its own covariance'
    images = sum(one['wrong_again'] for one in again)
    worst_in = max(one['worst_in'] for one in again)
    return f'{images:.0f} images in all, up to {worst_in:.1f} in off (wrong: {WRONG_IN:g} in)'


def kidnap_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of kidnappings."""
    kidnaps = result['kidnaps']
    times = np.array([one['found_s'] for one in kidnaps])
    lost = int((~np.isfinite(times)).sum())
    late = percentiles(times[np.isfinite(times)])
    believed = np.array([one['believed_s'] for one in kidnaps])
    again = [one for one in kidnaps if one['wrong_again'] > 0.0]
    none = Goal(of='ours', relation='<=', bound=0.0)
    return [
        BenchRow(
            name='kidnapped and not found again',
            unit='robots',
            ours=lost,
            goal=none,
            n=len(kidnaps),
        ),
        BenchRow(
            name='kidnapped and believed to be at another wrong place',
            unit='robots',
            ours=len(again),
            goal=none,
            n=len(kidnaps),
            note=_worst(again),
        ),
        BenchRow(
            name='the pose of before the kidnapping believed on, longest',
            unit='s',
            ours=float(believed.max()),
            n=len(kidnaps),
            note=f'longer than one image after {100.0 * (believed > 0.05).mean():.1f} % of them',  # noqa: PLR2004 - more than one period
        ),
        BenchRow(
            name='found again after, p95',
            unit='s',
            ours=late['p95'],
            n=len(kidnaps) - lost,
            note=f'median {late["median"]:.2f} s, longest {late["max"]:.2f} s',
        ),
    ]
