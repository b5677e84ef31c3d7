"""Train DQN and PPO of stable-baselines3 on the goal-reaching environment.

Needs stable-baselines3, which installs torch: `pip install '.[sb3]'`. Then:

    python examples/stable_baselines3_agents.py --agent dqn --steps 20000 --seed 0

The agent observes the region alone, like the paper's table, and chooses one of eight headings.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import time
from typing import Any

import gymnasium
from stable_baselines3 import DQN, PPO

import goalreach

_ENVIRONMENT = 'goalreach/GoalReach-v0'
# Chosen by hand for short episodes of one to ten steps; all others are the library's defaults.
_DQN: dict[str, Any] = {
    'learning_rate': 1e-3,
    'learning_starts': 200,
    'gamma': 0.9,
    'exploration_fraction': 0.5,
    'target_update_interval': 250,
}
_PPO: dict[str, Any] = {'n_steps': 256, 'gamma': 0.9, 'ent_coef': 0.01}


def make_agent(name: str, *, seed: int, observation: str = 'region') -> Any:  # noqa: ANN401 - DQN or PPO
    """Return an untrained agent.

    Args:
        name: 'dqn' or 'ppo'.
        seed: Seed of the agent and of its environment.
        observation: Kind of its observations, see the environment.
    """
    env = gymnasium.make(
        _ENVIRONMENT, observation=observation, start_jitter_m=0.05, overshoot_m=0.05
    )
    kind, settings = (DQN, _DQN) if name == 'dqn' else (PPO, _PPO)
    return kind('MlpPolicy', env, seed=seed, device='cpu', verbose=0, **settings)


def successes(agent: Any, *, observation: str = 'region') -> list[bool]:  # noqa: ANN401 - DQN or PPO
    """Return, for each start of the paper, whether the agent's best actions reach the goal.

    Args:
        agent: An agent with a method `predict`.
        observation: Kind of observations it was trained on.
    """
    env = gymnasium.make(_ENVIRONMENT, observation=observation)
    reached = []
    for start in range(len(goalreach.Arena().starts)):
        seen, info = env.reset(seed=0, options={'start': start})
        ended = False
        while not ended:
            action, _ = agent.predict(seen, deterministic=True)
            seen, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
        reached.append(bool(info['is_success']))
    return reached


def main(arguments: Sequence[str] | None = None) -> int:
    """Train, then drive from every start; return 0 if all reach the goal, else 1."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--agent', choices=('dqn', 'ppo'), default='dqn')
    parser.add_argument('--steps', type=int, default=20_000, help='actions to learn from')
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args(arguments)
    agent = make_agent(options.agent, seed=options.seed)
    began_s = time.perf_counter()
    agent.learn(options.steps)
    took_s = time.perf_counter() - began_s
    reached = successes(agent)
    print(
        f'{options.agent}: {options.steps} actions in {took_s:.1f} s; '
        f'{sum(reached)} of {len(reached)} starts reach the goal'
    )
    return 0 if all(reached) else 1


if __name__ == '__main__':
    raise SystemExit(main())
