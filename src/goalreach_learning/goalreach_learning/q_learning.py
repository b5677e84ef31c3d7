"""Q-learning with Boltzmann exploration: equations (1) and (2), one function each.

Plain floats on purpose: a table of 72 numbers is faster this way than as an array.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from goalreach_learning.learning_config import LearningConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.parameters import flatten_config
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Region

__all__ = ['QLearner', 'boltzmann_probabilities', 'q_update', 'select_action']


def q_update(
    q: float, reward: float, next_q: Sequence[float], *, alpha: float, gamma: float
) -> float:
    """Return the new value of Q(s, a): equation (1).

    Q(s, a) <- (1 - alpha) Q(s, a) + alpha (r + gamma max_b Q(s', b))

    Args:
        q: Q(s, a) before.
        reward: r, the reward of the transition.
        next_q: Q(s', b) of all b; empty where the path ends in s' (goal or bump), after which
            nothing can be earned. The paper leaves this case open.
        alpha: Learning rate.
        gamma: Discount factor.

    >>> q_update(0.5, 0.0, [0.0, 1.0], alpha=0.5, gamma=0.9)
    0.7
    """
    future = gamma * max(next_q) if next_q else 0.0
    return (1.0 - alpha) * q + alpha * (reward + future)


def boltzmann_probabilities(q: Sequence[float], temperature: float) -> list[float]:
    """Return the probability of every action of a state: equation (2).

    Args:
        q: Q(s, a) of all a.
        temperature: T > 0, in units of reward.

    Returns:
        exp(q / T) / sum exp(q / T). The largest q is subtracted first, which changes nothing
        but keeps the exponentials finite at any temperature.
    """
    best = max(q)
    exp = math.exp
    weights = [exp((value - best) / temperature) for value in q]
    total = sum(weights)
    return [weight / total for weight in weights]


def select_action(q: Sequence[float], *, visited: bool, temperature: float, uniform: float) -> int:
    """Return the action to try: uniform in a state never visited, else by equation (2).

    Args:
        q: Q(s, a) of all a.
        visited: Whether the state has been met before.
        temperature: T of equation (2), > 0.
        uniform: A sample of the uniform distribution on [0, 1).

    Returns:
        The index of the action: the sample's place in the cumulative distribution.
    """
    if not visited:
        return int(uniform * len(q))
    cumulative, last = 0.0, 0
    for action, probability in enumerate(boltzmann_probabilities(q, temperature)):
        cumulative += probability
        if uniform < cumulative:
            return action
        if probability > 0.0:
            last = action
    return last  # the sum fell short of the sample by rounding


class QLearner:
    """A Q-table that learns: the same for one process, Gymnasium and the live graph.

    Args:
        config: Learning rate, discount and temperatures.
        regions: The region map that the states belong to.
        policy: A policy to go on from; its Q-values and visits are taken over.

    Attributes:
        config: As given.
        q: Q-values, nested lists [x][y][action].
        visits: How often each was updated, nested lists [x][y][action].
    """

    def __init__(
        self, config: LearningConfig, regions: RegionMap, policy: Policy | None = None
    ) -> None:
        """Start with nothing known, or with what a policy knows."""
        self.config = config
        self.regions = regions
        start = policy or Policy.unlearned(regions)
        self.q: list[list[list[float]]] = start.q.tolist()
        self.visits: list[list[list[int]]] = start.visits.tolist()

    def choose(self, region: Region, temperature: float, uniform: float) -> int:
        """Return the action to try in a region, by `select_action`.

        Args:
            region: The state.
            temperature: T of equation (2).
            uniform: A sample of the uniform distribution on [0, 1).
        """
        i, j = region
        visited = any(self.visits[i][j])
        return select_action(
            self.q[i][j], visited=visited, temperature=temperature, uniform=uniform
        )

    def update(
        self, state: Region, action: int, reward: float, next_state: Region, *, terminal: bool
    ) -> None:
        """Learn from one finished action by equation (1).

        Args:
            state: Region in which the action was chosen.
            action: Its index.
            reward: What it earned.
            next_state: Region in which it ended.
            terminal: Whether the path ended there by goal or bump. A time-out is not terminal.
        """
        i, j = state
        values = self.q[i][j]
        next_q = () if terminal else self.q[next_state[0]][next_state[1]]
        values[action] = q_update(
            values[action], reward, next_q, alpha=self.config.alpha, gamma=self.config.gamma
        )
        self.visits[i][j][action] += 1

    def policy(self) -> Policy:
        """Return what is known now as a policy of its own."""
        return Policy(
            q=np.array(self.q, dtype=np.float64),
            visits=np.array(self.visits, dtype=np.int64),
            regions=self.regions,
            learning=flatten_config(self.config),
        )
