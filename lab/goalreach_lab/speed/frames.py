"""Speed of driving in one process: camera frames in a second of one core, all included."""

from __future__ import annotations

import argparse
import statistics
import time
from typing import NamedTuple

from goalreach_lab.row import BenchRow, Goal

SUMMARY = 'Camera frames a second of driving in one process: rendered, seen, answered, measured'

_FRAMES_PER_S = 2000.0


class _Round(NamedTuple):
    """What driving all starts once took."""

    frames: int
    cpu_s: float
    wall_s: float


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument('--rounds', type=int, default=5, help='times all starts are driven')
    parser.add_argument('--noise', default='nominal', help='none, nominal, harsh or a file')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option or a file is refused.
    """
    from goalreach_msgs_py.errors import ConfigurationError

    if options.rounds < 1:
        raise ConfigurationError('--rounds', options.rounds, 'a whole number >= 1')
    rounds = [_drive(options.noise, options.seed) for _ in range(options.rounds)]
    by_cpu = [one.frames / one.cpu_s for one in rounds]
    by_wall = [one.frames / one.wall_s for one in rounds]
    return [
        BenchRow(
            name='driving in one process, frames per second of processor time, best',
            unit='frames/s',
            ours=max(by_cpu),
            goal=Goal(of='ours', relation='>=', bound=_FRAMES_PER_S),
            n=len(rounds),
            note=f'median {statistics.median(by_cpu):.0f}; {rounds[0].frames} frames a round',
        ),
        BenchRow(
            name='the same per second of the wall clock, best',
            unit='frames/s',
            ours=max(by_wall),
            n=len(rounds),
            note=f'median {statistics.median(by_wall):.0f}; other programs on the machine count',
        ),
    ]


def _drive(noise: str, seed: int) -> _Round:
    """Drive from every start of the paper's arena; building the parts does not count."""
    import numpy as np

    from goalreach_evaluation.choices import choose_noise
    from goalreach_evaluation.drive import InProcessDrive
    from goalreach_learning.controller_config import ControllerConfig
    from goalreach_learning.training import train
    from goalreach_msgs_py.arena import Arena

    arena = Arena()
    drive = InProcessDrive(
        arena=arena,
        noise=choose_noise(noise),
        policy=train(arena, rng=np.random.default_rng(seed)).policy,
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(seed),
    )
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    for path, start in enumerate(arena.starts):
        drive.drive(start, path=path)
    return _Round(drive.frames, time.process_time() - cpu_s, time.perf_counter() - wall_s)
