"""Statistics of learners over seeds and tasks, with stratified bootstrap intervals.

R. Agarwal, M. Schwarzer, P. S. Castro, A. Courville and M. G. Bellemare, "Deep Reinforcement
Learning at the Edge of the Statistical Precipice", NeurIPS 2021. Scores are (runs, tasks).
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from goalreach_msgs_py.values import FloatArray


def interquartile_mean(scores: FloatArray) -> float:
    """Return the mean of the middle half of all scores; a share of a score counts as such.

    >>> interquartile_mean(np.array([[0.0], [1.0], [2.0], [9.0]]))
    1.5
    """
    ordered = np.sort(scores, axis=None)
    edges = np.clip(np.arange(ordered.size + 1) / ordered.size, 0.25, 0.75)
    weights = 2.0 * np.diff(edges)
    return float(weights[weights > 0.0] @ ordered[weights > 0.0])  # the rest may be infinite


def performance_profile(scores: FloatArray, thresholds: Sequence[float]) -> FloatArray:
    """Return the share of runs with at most each threshold, the mean over the tasks.

    Args:
        scores: (runs, tasks), the smaller the better.
        thresholds: (t,) ascending.
    """
    below = scores[:, :, None] <= np.asarray(thresholds)
    return np.asarray(below.mean(axis=(0, 1)))


def probability_of_improvement(first: FloatArray, second: FloatArray) -> float:
    """Return how probably a run of the first is better, that is smaller, than one of the second.

    A tie counts half; the mean over the tasks (Mann and Whitney's U).
    """
    ours, theirs = first[:, None, :], second[None, :, :]
    return float(((ours < theirs) + 0.5 * (ours == theirs)).mean())


def bootstrap_interval(
    statistic: Callable[..., Any],
    *groups: FloatArray,
    rng: np.random.Generator,
    resamples: int = 2000,
) -> tuple[Any, Any]:
    """Return the 95 % percentile interval of a statistic; runs are drawn anew within every task.

    Args:
        statistic: Function of the groups.
        groups: Scores (runs, tasks) of each learner.
        rng: Source of the draws.
        resamples: Number of draws.
    """
    drawn = [statistic(*(_resampled(group, rng) for group in groups)) for _ in range(resamples)]
    method: Any = 'linear' if np.isfinite(drawn).all() else 'nearest'  # between infinities is none
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0, method=method)
    return low, high


def _resampled(scores: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.take_along_axis(scores, rng.integers(len(scores), size=scores.shape), axis=0)
