"""95 % intervals of what the studies measured."""

from __future__ import annotations

from collections.abc import Sequence
import math
import statistics

from goalreach_evaluation.path_metrics import wilson_interval

_Z95 = 1.959964


def mean_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return a mean and half the width of its 95 % interval, by the normal approximation.

    Args:
        values: At least one; a single one has no width, NaN.
    """
    mean = statistics.fmean(values)
    if len(values) == 1:
        return mean, math.nan
    return mean, _Z95 * statistics.stdev(values) / math.sqrt(len(values))


def difference_of_shares(
    first: tuple[int, int], second: tuple[int, int]
) -> tuple[float, float, float]:
    """Return the difference of two shares and its 95 % interval.

    Newcombe's hybrid score interval (Statistics in Medicine 17, 1998, method 10), of Wilson's two.

    Args:
        first: Successes and number of the first.
        second: Successes and number of the second.
    """
    p, q = first[0] / first[1], second[0] / second[1]
    (p_low, p_high), (q_low, q_high) = wilson_interval(*first), wilson_interval(*second)
    below = math.hypot(p - p_low, q_high - q)
    above = math.hypot(p_high - p, q - q_low)
    return p - q, p - q - below, p - q + above
