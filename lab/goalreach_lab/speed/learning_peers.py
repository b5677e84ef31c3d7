"""Learning beside peers: stable-baselines3's DQN, and IR-SIM driving as long as we learn."""

from __future__ import annotations

import argparse
import statistics
import time
from typing import TYPE_CHECKING

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.rigs.sb3_learning import DqnLearning


SUMMARY = 'One learning phase beside DQN on the same task and IR-SIM over the same robot-seconds'

_STEP_S = 0.1
_MOST_DRIVES = 4000
_FASTER = Goal(of='ratio', relation='<=', bound=1 / 200)


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument('--rounds', type=int, default=3, help='times each is measured, in turn')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure.

    Raises:
        ConfigurationError: An option is refused.
    """
    from goalreach_lab.rigs import irsim_drives, sb3_learning
    from goalreach_msgs_py.errors import ConfigurationError

    if options.rounds < 1:
        raise ConfigurationError('--rounds', options.rounds, 'a whole number >= 1')
    has_sb3, has_irsim = sb3_learning.is_installed(), irsim_drives.is_installed()
    if not has_sb3:
        print('stable-baselines3 is not installed: left out (pip install goalreach[sb3])')
    if not has_irsim:
        print('IR-SIM is not installed: left out (pip install goalreach[bench])')
    ours, robot_s, dqn, irsim = [], [], [], []
    _learn(options.seed)  # the first one pays for what is loaded and computed once
    for number in range(options.rounds):
        took_s, drove_s = _learn(options.seed + number)
        ours.append(took_s)
        robot_s.append(drove_s)
        if has_sb3:
            dqn.append(sb3_learning.learn_with_dqn(options.seed + number))
        if has_irsim:
            irsim.append(_irsim_s(drove_s, options.seed + number))
    rows = [_irsim_row(ours, robot_s, irsim)]
    if dqn:
        rows += _dqn_rows(ours, dqn)
    return rows


def _learn(seed: int) -> tuple[float, float]:
    """Return the seconds of one learning phase, and how long a robot would drive for it."""
    import numpy as np

    from goalreach_learning.controller_config import ControllerConfig
    from goalreach_learning.training import train
    from goalreach_msgs_py.arena import Arena

    arena, rng = Arena(), np.random.default_rng(seed)
    began_s = time.perf_counter()
    result = train(arena, rng=rng)
    took_s = time.perf_counter() - began_s
    return took_s, result.length_m / ControllerConfig().cruise_speed_m_per_s


def _irsim_s(robot_s: float, seed: int) -> float:
    """Return how long IR-SIM takes for so many robot-seconds at 10 Hz."""
    import numpy as np

    from goalreach_lab.rigs.irsim_drives import IrSimDrives
    from goalreach_lab.rigs.random_drives import STEPS, RandomDrives
    from goalreach_msgs_py.arena import Arena

    arena = Arena()
    peer = IrSimDrives(arena, step_s=_STEP_S)
    count = min(_MOST_DRIVES, max(1, round(robot_s / (_STEP_S * STEPS))))
    drives = RandomDrives.draw(count, arena, np.random.default_rng(seed))
    wall_s = 0.0
    for index in range(count):
        peer.place(drives, index)
        began_s = time.perf_counter()
        peer.drive(drives, index)
        wall_s += time.perf_counter() - began_s
    return wall_s * robot_s / (count * STEPS * _STEP_S)


def _irsim_row(ours: list[float], robot_s: list[float], irsim: list[float]) -> BenchRow:
    drove_s = statistics.median(robot_s)
    return BenchRow(
        name='one learning phase of 440 paths, median',
        unit='s',
        ours=statistics.median(ours),
        reference=statistics.median(irsim) if irsim else None,
        reference_name='IR-SIM driving as long, 10 Hz' if irsim else '',
        goal=_FASTER if irsim else None,
        n=len(ours),
        note=f'{drove_s:.0f} robot-seconds of driving at full speed, turns not counted',
    )


def _dqn_rows(ours: list[float], dqn: list[DqnLearning]) -> list[BenchRow]:
    reached = [one.reached for one in dqn]
    return [
        BenchRow(
            name='learning to reach the goal from all 22 starts, median',
            unit='s',
            ours=statistics.median(ours),
            reference=statistics.median(one.seconds for one in dqn),
            reference_name='DQN of stable-baselines3',
            n=len(ours),
            note='DQN stops when it first does, ours drives all 20 trials; at its end DQN '
            f'reached it from {min(reached)} to {max(reached)} starts',
        ),
        BenchRow(
            name='paths driven for that, median',
            unit='paths',
            ours=440.0,
            reference=statistics.median(one.episodes for one in dqn),
            reference_name='DQN of stable-baselines3',
            n=len(ours),
            note=f'{statistics.median(one.steps for one in dqn):.0f} actions of DQN',
        ),
    ]
