"""Kidnapped robots: time to relocalize, and wrong poses trusted until then."""

from collections.abc import Iterator, Sequence
import functools
import math
from typing import Final

import numpy as np

from goalreach_lab.localization.frame_log import WRONG_IN, FrameLog, percentiles
from goalreach_lab.localization.waypoint_robot import FRAMES_PER_S, WaypointRobot
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.noise import noise_preset

_PER_ROBOT: Final = 20
"""Kidnappings of one robot with its own drawn errors; chosen."""
_GIVE_UP_S = 30.0
_RIGHT_M = WRONG_IN * INCH_M
_RIGHT_FRAMES = 25
"""Consecutive images with a right pose after which a robot has relocalized; chosen: one second."""


def kidnap_study(*, count: int, seed: int, jobs: int) -> Study:
    """Return the study of robots that are moved without any encoder counting it.

    Args:
        count: Number of kidnappings, up to 20 of each robot.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    robots = range(-(-count // _PER_ROBOT))
    return Study(
        name='kidnap',
        key=('robot', 'kidnappings'),
        settings={'seed': seed},
        cases=[
            {'robot': robot, 'kidnappings': min(_PER_ROBOT, count - robot * _PER_ROBOT)}
            for robot in robots
        ],
        measure=per_case(functools.partial(_kidnap_robot, seed=seed), jobs=jobs),
        analyse=lambda results: [one for robot in results for one in robot['found']],
        rows=_rows,
    )


def _kidnap_robot(case: Case, *, seed: int) -> Result:
    robot = WaypointRobot((seed, case['robot'], 30), noise=noise_preset('nominal'))

    def kidnappings() -> Iterator[dict[str, float]]:
        for _ in range(case['kidnappings']):
            for _ in robot.run(FRAMES_PER_S):
                pass
            robot.kidnap()
            yield _relocalize(robot)

    _relocalize(robot)
    return {'found': list(kidnappings())}


def _relocalize(robot: WaypointRobot) -> dict[str, float]:
    """Drive until the robot has relocalized.

    Returns:
        'trusted_s': how long the old pose was trusted; 'found_s': time until a second began in
        which a right pose was, infinite if none did; 'wrong_again': images in which another wrong
        pose was trusted; 'worst_in': the largest error of a pose after the old one.
    """
    log = FrameLog()
    right_in_a_row = 0
    for step in robot.run(round(_GIVE_UP_S * FRAMES_PER_S)):
        trusted = log.add_output(step.frame, step.output)
        truth, pose = step.frame.truth.pose, step.output.estimate.pose
        error_m = math.hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m)
        right_in_a_row = right_in_a_row + 1 if trusted and error_m < _RIGHT_M else 0
        if right_in_a_row >= _RIGHT_FRAMES:
            break
    frames = log.take()
    wrong = frames.wrong
    times_s = (frames.time_s - frames.time_s[0]) + 1.0 / FRAMES_PER_S
    doubted = int(np.argmin(wrong)) if not wrong.all() else len(wrong)
    return {
        'trusted_s': doubted / FRAMES_PER_S,
        'found_s': float(times_s[-_RIGHT_FRAMES]) if right_in_a_row == _RIGHT_FRAMES else math.inf,
        'wrong_again': float(wrong[doubted:].sum()),
        'worst_in': float(np.nanmax(frames.error_in[doubted:], initial=0.0)),
    }


def _rows(kidnaps: Sequence[dict[str, float]]) -> list[BenchRow]:
    times_s = np.array([one['found_s'] for one in kidnaps])
    found = np.isfinite(times_s)
    late_s = percentiles(times_s[found])
    trusted_s = np.array([one['trusted_s'] for one in kidnaps])
    again = [one for one in kidnaps if one['wrong_again'] > 0.0]
    longer = 100.0 * (trusted_s > 1.5 / FRAMES_PER_S).mean()
    return [
        BenchRow.none_allowed(
            'kidnapped robots that did not relocalize',
            int((~found).sum()),
            unit='robots',
            n=len(kidnaps),
        ),
        BenchRow.none_allowed(
            'kidnapped robots that trusted another wrong pose',
            len(again),
            unit='robots',
            n=len(kidnaps),
            note=_describe(again),
        ),
        BenchRow(
            name='longest time the old pose was trusted after the kidnapping',
            unit='s',
            ours=float(trusted_s.max()),
            n=len(kidnaps),
            note=f'longer than one image after {longer:.1f} % of them',
        ),
        BenchRow(
            name='time to relocalize, p95',
            unit='s',
            ours=late_s['p95'],
            n=int(found.sum()),
            note=f'median {late_s["median"]:.2f} s, longest {late_s["max"]:.2f} s',
        ),
    ]


def _describe(again: Sequence[dict[str, float]]) -> str:
    if not again:
        return f'wrong: position error above {WRONG_IN:g} in, or outside its own covariance'
    images = sum(one['wrong_again'] for one in again)
    worst_in = max(one['worst_in'] for one in again)
    return f'{images:.0f} images in all, error up to {worst_in:.1f} in (wrong: {WRONG_IN:g} in)'
