"""Q-learning with Boltzmann exploration: equations (1) and (2), one function each.

Plain floats, since a table of 72 numbers is faster as lists than as an array.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from goalreach_msgs_py.parameters import Configuration, parameter


@dataclass(frozen=True, kw_only=True)
class LearningConfig(Configuration):
    """Parameters of the learning.

    The paper gives 20 trials of 22 paths; all other values are chosen.

    Raises:
        ConfigurationError: A value is out of its range; the field is named.
    """

    alpha: float = parameter(
        0.3, 'Learning rate of equation (1), there below 1; chosen, it has none', within=(0.0, 1.0)
    )
    gamma: float = parameter(
        0.9, 'Discount factor of equation (1); chosen, the paper gives none', within=(0.0, 0.999)
    )
    temperature_start: float = parameter(
        1.0,
        'Temperature of equation (2) in the first trial, in units of reward; chosen',
        within=(1e-3, 1e3),
    )
    temperature_end: float = parameter(
        0.01,
        'Boltzmann temperature of equation (2) in the last trial, in units of reward; chosen: '
        '0.05 learns the same with 40 % more actions',
        within=(1e-3, 1e3),
    )
    trials: int = parameter(
        20,
        'Trials, each with one path from every start (20 in section "The Simulation Phase")',
        within=(1, 100_000),
    )
    max_options: int = parameter(
        60, 'Actions after which a path is truncated, without penalty; chosen', within=(1, 100_000)
    )
    start_jitter_m: float = parameter(
        0.05, 'Largest random shift of the starts along x and y, m; chosen', within=(0.0, 0.5)
    )
    overshoot_m: float = parameter(
        0.05, 'Distance past a border at which a robot notices it, m; chosen', within=(0.0, 0.5)
    )

    def temperature(self, trial: int) -> float:
        """Return the temperature of a trial: geometric from start to end, then constant.

        "Tuning opportunely the temperature parameter from higher to lower value" (section "The
        Action Set and Q-learning"); the shape is chosen.
        """
        fraction = min(1.0, trial / max(1, self.trials - 1))
        ratio = self.temperature_end / self.temperature_start
        return float(self.temperature_start * ratio**fraction)


def q_update(
    q: float, reward: float, next_q: Sequence[float], *, alpha: float, gamma: float
) -> float:
    """Return the new value of Q(s, a): equation (1).

    Q(s, a) <- (1 - alpha) Q(s, a) + alpha (r + gamma max_b Q(s', b))

    Args:
        q: Q(s, a) before.
        reward: r, the reward of the transition.
        next_q: Q(s', b) of all b; empty if the path ends in s' (goal or bump), after which there
            is no reward. The paper does not specify this case.
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
        exp(q / T) / sum exp(q / T). Subtracting the largest q first does not change the result
        and keeps the exponentials finite.
    """
    best = max(q)
    exp = math.exp
    weights = [exp((value - best) / temperature) for value in q]
    total = sum(weights)
    return [weight / total for weight in weights]


def select_action(q: Sequence[float], *, visited: bool, temperature: float, uniform: float) -> int:
    """Return the action to try: uniform in an unvisited state, else by equation (2).

    Args:
        q: Q(s, a) of all a.
        visited: Whether an action was tried in the state before.
        temperature: T of equation (2), > 0.
        uniform: A sample of the uniform distribution on [0, 1).

    Returns:
        Index of the action at which the cumulative distribution exceeds the sample.
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
