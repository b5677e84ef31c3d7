"""Errors, availability and overconfidence while robots drive, over noise and calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.drive import InProcessDrive
from goalreach_evaluation.starts import random_starts
from goalreach_lab.localization.frame_log import (
    FrameLog,
    Frames,
    error_summary,
    longest_gap_s,
    overconfident_episodes,
    percentiles,
)
from goalreach_lab.localization.waypoint_robot import FRAMES_PER_S, WaypointRobot
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.values import Pose2

SCALES: Final = {'none': 0.0, 'half': 0.5, 'nominal': 1.0, 'one and a half': 1.5, 'harsh': 2.0}
_SCALED_FRAMES: Final = 1500
_NOISES: Final = ('nominal', 'harsh')
_CALIBRATING: Final = {'calibrated': True, 'uncalibrated': False}
_CALIBRATION_S = 600.0
_MEASURED_S = 120.0


def noise_study(*, robots: int, seed: int, jobs: int) -> Study:
    """Return the study of robots that drive for a minute at each scale of the noise.

    Args:
        robots: Number of robots, each with its own drawn errors, the same draws at every scale.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    return Study(
        name='noise',
        key=('scale', 'robot'),
        settings={'seed': seed},
        cases=[{'scale': name, 'robot': robot} for name in SCALES for robot in range(robots)],
        measure=per_case(functools.partial(_drive_scaled, seed=seed), jobs=jobs),
        analyse=_analyse_noise,
        rows=_noise_rows,
    )


def _drive_scaled(case: Case, *, seed: int) -> Result:
    noise = NoiseModel().scaled(SCALES[case['scale']])
    robot = WaypointRobot((seed, case['robot'], 50), noise=noise)
    return _log(robot, _SCALED_FRAMES).to_json()


def _log(robot: WaypointRobot, frames: int) -> Frames:
    log = FrameLog()
    for step in robot.run(frames):
        log.add_output(step.frame, step.output)
    return log.take()


def _grouped(results: Sequence[Result], field: str) -> dict[str, list[Frames]]:
    """Return the frames of each result by the value of a field."""
    groups: dict[str, list[Frames]] = {}
    for result in results:
        groups.setdefault(result[field], []).append(Frames.from_json(result))
    return groups


def _analyse_noise(results: Sequence[Result]) -> dict[str, Any]:
    found = {}
    for name, drives in _grouped(results, 'scale').items():
        frames = Frames.join(drives)
        found[name] = {
            **error_summary(frames),
            'scale': SCALES[name],
            'robots': len(drives),
            'wrong': int(frames.wrong.sum()),
        }
    return found


def _shares(leds: Sequence[float]) -> str:
    """Return the share of images by the number of LEDs seen."""
    seen = ', '.join(f'{count} {100.0 * leds[count]:.1f} %' for count in (2, 1, 0))
    return f'3 LEDs {100.0 * leds[3]:.1f} %, {seen} of images'


def _noise_rows(result: dict[str, Any]) -> list[BenchRow]:
    rows = []
    for name, found in result.items():
        position, heading = found['position_in'], found['heading_deg']
        rows += [
            BenchRow(
                name=f'noise {name} ({found["scale"]:g} x nominal): position error p95',
                unit='in',
                ours=position['p95'],
                n=found['frames'],
                note=f'{found["robots"]} robots; rms {position["rms"]:.2f}, max '
                f'{position["max"]:.2f} in; heading p95 {heading["p95"]:.2f} deg; '
                f'{found["wrong"]} images with a wrong pose trusted',
            ),
            BenchRow(
                name=f'noise {name}: trusted pose available',
                unit='% of the time',
                ours=100.0 * found['available'],
                n=found['frames'],
                note=f'including the first search; {_shares(found["leds"])}',
            ),
        ]
    return rows


@dataclass(frozen=True, kw_only=True)
class _Drives:
    """What the drives of a study have in common."""

    policy: Policy
    starts: Sequence[Pose2]
    seed: int

    def measure(self, case: Case) -> Result:
        """Return the frames of a path or of a robot that drives to random waypoints."""
        kind, number = case['kind'], case['number']
        if kind in _NOISES:
            return self._to_goal(kind, number).to_json()
        robot = WaypointRobot(
            (self.seed, number, 10), noise=noise_preset('nominal'), calibrate=_CALIBRATING[kind]
        )
        for _ in robot.run(round(_CALIBRATION_S * FRAMES_PER_S)):
            pass
        return _log(robot, round(_MEASURED_S * FRAMES_PER_S)).to_json()

    def _to_goal(self, noise: str, path: int) -> Frames:
        """Return the frames of a path, driven by a robot with its own drawn errors."""
        log = FrameLog()
        drive = InProcessDrive(
            arena=Arena(),
            noise=noise_preset(noise),
            policy=self.policy,
            controller=ControllerConfig(),
            seed=np.random.SeedSequence(self.seed, spawn_key=(path,)),
        )
        for frame in drive.drive_frames(self.starts[path], path=path):
            log.add(frame.sensors, frame.localization, frame.state)
        return log.take()


def drive_study(*, starts: int, robots: int, seed: int, jobs: int) -> Study:
    """Return the study of localization on the way to the goal, and of self-calibration.

    Args:
        starts: Random starts in addition to the 22 of the paper, each with its own robot.
        robots: Robots that calibrate themselves for ten minutes before two are measured; each
            drives a second time without calibration.
        seed: Seed of everything random.
        jobs: Number of processes.
    """
    arena = Arena()
    learner, places = np.random.SeedSequence(seed).spawn(2)
    drives = _Drives(
        policy=train(arena, rng=np.random.default_rng(learner)).policy,
        starts=(*arena.starts, *random_starts(arena, starts, np.random.default_rng(places))),
        seed=seed,
    )
    counts = {**dict.fromkeys(_NOISES, len(drives.starts)), **dict.fromkeys(_CALIBRATING, robots)}
    return Study(
        name='drives',
        key=('kind', 'number'),
        settings={'seed': seed},
        cases=[{'kind': k, 'number': n} for k, count in counts.items() for n in range(count)],
        measure=per_case(drives.measure, jobs=jobs),
        analyse=_analyse_drives,
        rows=_drive_rows,
    )


def _analyse_drives(results: Sequence[Result]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind, drives in _grouped(results, 'kind').items():
        found[kind] = {**error_summary(Frames.join(drives)), 'drives': len(drives)}
        if kind in _NOISES:
            episodes = [one for drive in drives for one in overconfident_episodes(drive)]
            firsts = [first_pose_s(drive) for drive in drives]
            found[kind] |= {
                'first_pose_s': percentiles(np.array(firsts)),
                'longest_gap_s': max(map(longest_gap_s, drives)),
                'episodes': episodes,
            }
    return found


def first_pose_s(frames: Frames) -> float:
    """Return the time until the first trusted pose of a drive, infinite where none is."""
    good_s = frames.time_s[frames.trusted]
    return float(good_s[0] - frames.time_s[0]) if len(good_s) else math.inf


def _drive_rows(found: dict[str, Any]) -> list[BenchRow]:
    rows = []
    for kind, what, bound in (
        ('nominal', 'position', 1.3),
        ('nominal', 'heading', 0.5),
        ('calibrated', 'position', 0.8),
        ('harsh', 'position', None),
        ('harsh', 'heading', None),
    ):
        if kind in found:
            rows.append(_error_row(kind, what, bound, found))
    for noise in _NOISES:
        if noise in found:
            rows += _trust_rows(noise, found[noise])
    return rows


def _error_row(kind: str, what: str, bound: float | None, found: dict[str, Any]) -> BenchRow:
    unit = {'position': 'in', 'heading': 'deg'}[what]
    field = f'{what}_{unit}'
    errors, drives = found[kind][field], found[kind]['drives']
    calibrated = kind == 'calibrated'
    name = 'calibrating for 10 min' if calibrated else kind
    reference = found.get('uncalibrated') if calibrated else None
    return BenchRow(
        name=f'{name}: {what} error p95',
        unit=unit,
        ours=errors['p95'],
        reference=None if reference is None else reference[field]['p95'],
        reference_name='' if reference is None else 'without calibration',
        goal=None if bound is None else Goal(of='ours', relation='<=', bound=bound),
        n=found[kind]['frames'],
        note=f'{drives} {"robots" if calibrated else "starts and robots"}; '
        f'rms {errors["rms"]:.2f}, median {errors["median"]:.2f}, max {errors["max"]:.2f} {unit}',
    )


def _trust_rows(noise: str, found: dict[str, Any]) -> list[BenchRow]:
    episodes, first = found['episodes'], found['first_pose_s']
    detected_s = max((one.detected_s for one in episodes), default=0.0)
    worst_in = max((one.worst_in for one in episodes), default=0.0)
    goal = Goal(of='ours', relation='<=', bound=2.0)
    return [
        BenchRow(
            name=f'{noise}: longest time from a wrong pose trusted to a right one',
            unit='s',
            ours=max((one.recovered_s for one in episodes), default=0.0),
            goal=goal,
            n=found['drives'],
            note=f'{len(episodes)} times wrong; detected after {detected_s:.2f} s at most; '
            f'largest error in it {worst_in:.1f} in',
        ),
        BenchRow(
            name=f'{noise}: longest time without a trusted pose after the first one',
            unit='s',
            ours=found['longest_gap_s'],
            goal=goal,
            n=found['drives'],
        ),
        BenchRow(
            name=f'{noise}: trusted pose available',
            unit='% of the time',
            ours=100.0 * found['available'],
            n=found['frames'],
            note=f'first pose after {first["median"]:.2f} s (median), {first["max"]:.2f} s at '
            f'most; {_shares(found["leds"])}',
        ),
    ]
