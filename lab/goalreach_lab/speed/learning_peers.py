"""Learning against peers: stable-baselines3 with DQN, and IR-SIM driving for as long."""

from dataclasses import dataclass
import importlib.util
import statistics
import time
from typing import Any, NamedTuple

import numpy as np

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
_CHECK_STEPS = 250
_MAX_STEPS = 40_000
_DQN_SETTINGS: dict[str, Any] = {
    'learning_rate': 1e-3,
    'learning_starts': 200,
    'gamma': 0.9,
    'exploration_fraction': 0.15,
    'target_update_interval': 250,
}
"""Chosen by hand for short episodes: exploration ends after 6000 actions. The rest is default."""


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
    if dqn:
        rows += _dqn_rows(ours, dqn)
    return rows


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


def _dqn_rows(ours: list[float], dqn: list['DqnLearning']) -> list[BenchRow]:
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


class DqnLearning(NamedTuple):
    """Effort of DQN to reach the goal from all 22 starts.

    Attributes:
        seconds: Time spent learning, without the trials of the starts.
        steps: Actions taken.
        episodes: Paths driven.
        reached: Number of starts from which the goal is reached at the end.
    """

    seconds: float
    steps: int
    episodes: int
    reached: int


def is_sb3_installed() -> bool:
    """Return whether Gymnasium and stable-baselines3 can be imported; extra `sb3`."""
    return all(importlib.util.find_spec(name) for name in ('gymnasium', 'stable_baselines3'))


def learn_with_dqn(seed: int) -> DqnLearning:
    """Learn until the greedy actions reach the goal from all starts, or the budget is used up.

    Every 250 actions, all starts are tried. Jitter and overshoot are those of our own learner.

    Args:
        seed: Seed of agent and environment.
    """
    import gymnasium
    from stable_baselines3 import DQN
    from stable_baselines3.common.monitor import Monitor
    import torch

    from goalreach_learning.gym_environment import ENVIRONMENT_ID

    torch.set_num_threads(1)
    env: Any = Monitor(gymnasium.make(ENVIRONMENT_ID, start_jitter_m=0.05, overshoot_m=0.05))
    trial = gymnasium.make(ENVIRONMENT_ID)
    agent: Any = DQN('MlpPolicy', env, seed=seed, device='cpu', **_DQN_SETTINGS)
    starts, tried_s, reached = len(Arena().starts), 0.0, 0

    def go_on(_locals: object, _globals: object) -> bool:
        nonlocal tried_s, reached
        if agent.num_timesteps % _CHECK_STEPS:
            return True
        began_s = time.perf_counter()
        reached = sum(_reaches(agent, trial, start) for start in range(starts))
        tried_s += time.perf_counter() - began_s
        return reached < starts

    began_s = time.perf_counter()
    agent.learn(_MAX_STEPS, callback=go_on)
    seconds = time.perf_counter() - began_s - tried_s
    return DqnLearning(seconds, agent.num_timesteps, len(env.get_episode_rewards()), reached)


def _reaches(agent: Any, env: Any, start: int) -> bool:
    """Return whether the greedy actions lead from a start to the goal."""
    seen, info = env.reset(seed=0, options={'start': start})
    ended = False
    while not ended:
        action, _ = agent.predict(seen, deterministic=True)
        seen, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    return bool(info['is_success'])
