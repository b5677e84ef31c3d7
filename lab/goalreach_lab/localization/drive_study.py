"""Driving to the goal by images: errors, wrong beliefs, availability; and self-calibration."""

from __future__ import annotations

from collections.abc import Sequence
import functools
from typing import Any, Final

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.sessions import EvaluationPlan, each
from goalreach_evaluation.starts import random_starts
from goalreach_lab.localization.beliefs import longest_gap_s, wrong_beliefs
from goalreach_lab.localization.frame_log import FrameLog, Frames, percentiles
from goalreach_lab.localization.wanderer import Wanderer
from goalreach_lab.row import BenchRow, Goal
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset

_NOISES: Final = ('nominal', 'harsh')
_TAUGHT_S = 600.0
_MEASURED_S = 120.0
_FRAMES_PER_S = 25


def study_drives(*, starts: int, robots: int, seed: int, jobs: int) -> dict[str, Any]:
    """Return how well robots know where they are on their way to the goal.

    Args:
        starts: Random starts beside the 22 of the paper.
        robots: Robots that calibrate themselves for ten minutes before two are measured; each
            drives a second time without calibration.
        seed: Of everything random.
        jobs: Processes.
    """
    arena = Arena()
    learner, places = np.random.SeedSequence(seed).spawn(2)
    policy = train(arena, rng=np.random.default_rng(learner)).policy
    drawn = random_starts(arena, starts, np.random.default_rng(places))
    result: dict[str, Any] = {'starts': len(arena.starts) + len(drawn)}
    for noise in _NOISES:
        plan = EvaluationPlan(
            arena=arena,
            noise=noise_preset(noise),
            policy=policy,
            controller=ControllerConfig(),
            starts=(*arena.starts, *drawn),
            seed=seed,
        )
        paths = each(functools.partial(_drive, plan), range(len(plan.starts)), jobs=jobs)
        result[noise] = _summary(list(paths))
    for name, calibrate in (('calibrated', True), ('uncalibrated', False)):
        wander = functools.partial(_wander, seed=seed, calibrate=calibrate)
        result[name] = _errors(Frames.joined(list(each(wander, range(robots), jobs=jobs))))
        result[name]['robots'] = robots
    return result


def _drive(plan: EvaluationPlan, path: int) -> Frames:
    """Return the frames of a path; every path has a robot of its own, with its own errors."""
    log = FrameLog()
    drive = InProcessDrive(
        arena=plan.arena,
        noise=plan.noise,
        policy=plan.policy,
        controller=plan.controller,
        seed=np.random.SeedSequence(plan.seed, spawn_key=(path,)),
    )
    for frame in drive.drive_frames(plan.starts[path], path=path):
        log.add(frame.sensors, frame.localization, frame.state)
    return log.take()


def _wander(number: int, *, seed: int, calibrate: bool) -> Frames:
    """Return what a robot sees after ten minutes of wandering."""
    robot = Wanderer((seed, number, 10), noise=noise_preset('nominal'), calibrate=calibrate)
    log = FrameLog()
    for _ in range(round(_TAUGHT_S * _FRAMES_PER_S)):
        robot.step()
    for step in robot.run(round(_MEASURED_S * _FRAMES_PER_S)):
        log.look(step.frame, step.output)
    return log.take()


def _errors(frames: Frames) -> dict[str, Any]:
    good = frames.trusted
    leds = np.bincount(frames.leds.astype(int), minlength=4) / max(1, len(frames))
    return {
        'frames': len(frames),
        'position_in': percentiles(frames.error_in[good]),
        'heading_deg': percentiles(frames.turned_deg[good]),
        'available': float(good.mean()),
        'leds': leds.tolist(),
    }


def _summary(paths: Sequence[Frames]) -> dict[str, Any]:
    episodes = [episode for path in paths for episode in wrong_beliefs(path)]
    firsts = [float(path.time_s[path.trusted.argmax()] - path.time_s[0]) for path in paths]
    return {
        **_errors(Frames.joined(paths)),
        'first_pose_s': percentiles(np.array(firsts)),
        'longest_gap_s': max(longest_gap_s(path) for path in paths),
        'wrong_beliefs': [[one.detected_s, one.recovered_s, one.worst_in] for one in episodes],
    }


def drive_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of driving."""
    nominal, harsh = result['nominal'], result['harsh']
    starts = result['starts']
    calibrated = 'calibrating for 10 min: position error p95'
    rows = [
        _row('nominal: position error p95', nominal, 'position_in', bound=1.3, starts=starts),
        _row('nominal: heading error p95', nominal, 'heading_deg', bound=0.5, starts=starts),
        _row(
            calibrated,
            result['calibrated'],
            'position_in',
            bound=0.8,
            beside=result['uncalibrated'],
        ),
        _row('harsh: position error p95', harsh, 'position_in', starts=starts),
        _row('harsh: heading error p95', harsh, 'heading_deg', starts=starts),
    ]
    for noise in _NOISES:
        rows += _belief_rows(noise, result[noise], starts)
    return rows


def _row(
    name: str,
    found: dict[str, Any],
    what: str,
    *,
    bound: float | None = None,
    starts: int | None = None,
    beside: dict[str, Any] | None = None,
) -> BenchRow:
    errors, unit = found[what], what.rpartition('_')[2]
    of = f'{starts} starts and robots' if starts else f'{found["robots"]} robots'
    return BenchRow(
        name=name,
        unit=unit,
        ours=errors['p95'],
        reference=None if beside is None else beside[what]['p95'],
        reference_name='' if beside is None else 'without calibration',
        goal=None if bound is None else Goal(of='ours', relation='<=', bound=bound),
        n=found['frames'],
        note=f'{of}; rms {errors["rms"]:.2f}, median {errors["median"]:.2f}, '
        f'max {errors["max"]:.2f} {unit}',
    )


def _belief_rows(noise: str, found: dict[str, Any], starts: int) -> list[BenchRow]:
    episodes = found['wrong_beliefs']
    longest = max((one[1] for one in episodes), default=0.0)
    detected = max((one[0] for one in episodes), default=0.0)
    worst = max((one[2] for one in episodes), default=0.0)
    three, two, one, none = (100.0 * found['leds'][count] for count in (3, 2, 1, 0))
    first = found['first_pose_s']
    return [
        BenchRow(
            name=f'{noise}: from a wrong pose believed to a right one, longest',
            unit='s',
            ours=longest,
            goal=Goal(of='ours', relation='<=', bound=2.0),
            n=starts,
            note=f'{len(episodes)} times wrong; detected after {detected:.2f} s at most; '
            f'worst error meanwhile {worst:.1f} in',
        ),
        BenchRow(
            name=f'{noise}: longest time without a good pose once there was one',
            unit='s',
            ours=found['longest_gap_s'],
            goal=Goal(of='ours', relation='<=', bound=2.0),
            n=starts,
        ),
        BenchRow(
            name=f'{noise}: a good pose is there',
            unit='% of the time',
            ours=100.0 * found['available'],
            n=found['frames'],
            note=f'first pose after {first["median"]:.2f} s (median), {first["max"]:.2f} s at '
            f'most; 3 LEDs {three:.1f} %, 2 {two:.1f} %, 1 {one:.1f} %, 0 {none:.1f} % of images',
        ),
    ]
