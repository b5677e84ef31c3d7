"""stable-baselines3's DQN learning the goal-reaching task."""

from __future__ import annotations

import importlib.util
import time
from typing import Any, NamedTuple

from goalreach_msgs_py.arena import Arena

_CHECK_STEPS = 250
_MAX_STEPS = 40_000
_SETTINGS: dict[str, Any] = {
    'learning_rate': 1e-3,
    'learning_starts': 200,
    'gamma': 0.9,
    'exploration_fraction': 0.15,
    'target_update_interval': 250,
}
# Chosen by hand for short episodes: exploration ends after 6000 actions. The rest is default.


class DqnLearning(NamedTuple):
    """What it took to reach the goal from all 22 starts.

    Attributes:
        seconds: Time spent learning; trying the starts does not count.
        steps: Actions taken.
        episodes: Paths driven.
        reached: How many starts reach the goal at the end.
    """

    seconds: float
    steps: int
    episodes: int
    reached: int


def is_installed() -> bool:
    """Return whether Gymnasium and stable-baselines3 can be imported; extra `sb3`."""
    return all(importlib.util.find_spec(name) for name in ('gymnasium', 'stable_baselines3'))


def learn_with_dqn(seed: int) -> DqnLearning:
    """Learn until the greedy actions reach the goal from all starts, or the budget is used up.

    Every 250 actions the starts are tried. Jitter and overshoot are those of our own learner.

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
    agent: Any = DQN('MlpPolicy', env, seed=seed, device='cpu', **_SETTINGS)
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
    """Return whether the best actions lead from a start to the goal."""
    seen, info = env.reset(seed=0, options={'start': start})
    ended = False
    while not ended:
        action, _ = agent.predict(seen, deterministic=True)
        seen, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    return bool(info['is_success'])
