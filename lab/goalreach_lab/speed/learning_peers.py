"""Learning against peers: stable-baselines3 with DQN, and IR-SIM driving for as long."""

from dataclasses import dataclass
import statistics
import time

import numpy as np

from goalreach_evaluation.sweep import CurveCase, learn_case
from goalreach_lab.learners.curves import DQN, LIMIT, is_sb3_installed
from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.random_drives import STEPS, IrSimDrives, RandomDrives, is_irsim_installed
from goalreach_lab.row import BenchRow, Goal
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.options import option

SUMMARY = 'One learning phase against DQN on the same task and IR-SIM over the same robot-seconds'

_STEP_S = 0.1
_MOST_DRIVES = 4000
_FASTER = Goal(of='ratio', relation='<=', bound=1 / 200)


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    rounds: int = option(3, 'times each is measured, in turn', minimum=1)


def execute(options: Options) -> list[BenchRow]:
    """Measure ours and the peers that are installed, in turns."""
    has_sb3, has_irsim = is_sb3_installed(), is_irsim_installed()
    if not has_sb3:
        print('stable-baselines3 is not installed: left out (pip install goalreach[sb3])')
    if not has_irsim:
        print('IR-SIM is not installed: left out (pip install goalreach[bench])')
    ours, robot_s, dqn, irsim = [], [], [], []
    _learn(options.seed)  # the first phase also loads libraries and fills caches
    for number in range(options.rounds):
        took_s, drove_s = _learn(options.seed + number)
        ours.append(took_s)
        robot_s.append(drove_s)
        if has_sb3:
            dqn.append(learn_with_dqn(options.seed + number))
        if has_irsim:
            irsim.append(_irsim_s(drove_s, options.seed + number))
    rows = [_irsim_row(ours, robot_s, irsim)]
    return rows + (_dqn_rows(ours, dqn) if dqn else [])


def _learn(seed: int) -> tuple[float, float]:
    """Return the duration of one learning phase, s, and the driving time of its paths, s."""
    arena, rng = Arena(), np.random.default_rng(seed)
    began_s = time.perf_counter()
    result = train(arena, rng=rng)
    took_s = time.perf_counter() - began_s
    return took_s, result.length_m / ControllerConfig().cruise_speed_m_per_s


def _irsim_s(robot_s: float, seed: int) -> float:
    """Return the time, s, that IR-SIM takes to simulate some robot-seconds at 10 Hz."""
    arena = Arena()
    peer = IrSimDrives(arena, step_s=_STEP_S)
    count = min(_MOST_DRIVES, max(1, round(robot_s / (_STEP_S * STEPS))))
    drives = RandomDrives.draw(count, arena, np.random.default_rng(seed))
    return peer.time(drives, range(count)) * robot_s / (count * STEPS * _STEP_S)


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


def learn_with_dqn(seed: int) -> tuple[float, float]:
    """Return the time, s, and the paths that DQN needs until all starts lead to the goal.

    Jitter and overshoot are those of our own learner. The policy is judged after every path, which
    counts.
    """
    arena, began_s = Arena(), time.perf_counter()
    case = CurveCase(
        learner=DQN, arena_name=arena.name, arena=arena, noise_name='', noise=None, limit=LIMIT,
        after=0, seed=seed,
    )  # fmt: skip
    found = learn_case(case)
    return time.perf_counter() - began_s, found['paths'] if found['learned'] else LIMIT


def _dqn_rows(ours: list[float], dqn: list[tuple[float, float]]) -> list[BenchRow]:
    seconds, paths = map(statistics.median, zip(*dqn, strict=True))
    return [
        BenchRow(
            name=name,
            unit=unit,
            ours=value,
            reference=reference,
            reference_name='DQN of stable-baselines3',
            n=len(ours),
            note=f'DQN stops when all starts lead to the goal, at {LIMIT} paths at the latest; '
            'ours drives all 20 trials',
        )
        for name, unit, value, reference in (
            ('learning to reach the goal from all 22 starts, median', 's',
             statistics.median(ours), seconds),
            ('paths driven for that, median', 'paths', 440.0, paths),
        )
    ]  # fmt: skip
