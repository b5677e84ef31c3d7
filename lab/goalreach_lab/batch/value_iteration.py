"""The optimal values of the decision process that the learner met, by value iteration."""

from __future__ import annotations

import numpy as np

from goalreach_lab.batch.batch_environment import IntArray
from goalreach_lab.batch.batch_training import BUMP_END, GOAL_END
from goalreach_learning.task import BUMP_REWARD, GOAL_REWARD
from goalreach_msgs_py.values import FloatArray

_REGIONS = 9


def value_iteration(counts: IntArray, *, gamma: float, tolerance: float = 1e-12) -> FloatArray:
    """Return the optimal Q-values of the process with the transition frequencies given.

    The nine regions are not a Markov state: where an action leads depends on where in the region
    it began. The frequencies with which it led there average over that, as the learner does.

    Args:
        counts: How often each action led where, (3, 3, 8, 11), as `BatchResult.counts`.
        gamma: Discount factor, below 1.
        tolerance: Largest change of a value at which to stop.

    Returns:
        (3, 3, 8); zero where an action was never tried.
    """
    total = counts.sum(axis=-1, keepdims=True)
    share = counts / np.maximum(total, 1)
    reward = GOAL_REWARD * share[..., GOAL_END] + BUMP_REWARD * share[..., BUMP_END]
    tried = total[..., 0] > 0
    q = np.zeros(reward.shape)
    while True:
        best = np.where(tried, q, -np.inf).max(axis=-1)
        values = np.where(np.isfinite(best), best, 0.0).reshape(_REGIONS)
        update = reward + gamma * (share[..., :_REGIONS] @ values)
        if np.abs(update - q).max() <= tolerance:
            return np.asarray(update)
        q = update
