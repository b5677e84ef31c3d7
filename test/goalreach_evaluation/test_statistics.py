"""Statistics of learners against numbers by hand."""

import math

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
import pytest

from goalreach_evaluation.statistics import (
    bootstrap_interval,
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
)
from goalreach_msgs_py.values import FloatArray

SCORES = arrays(
    np.float64, st.tuples(st.integers(1, 9), st.integers(1, 3)), elements=st.floats(0, 99)
)


def test_the_middle_half_by_hand() -> None:
    assert interquartile_mean(np.array([[0.0, 7.0], [3.0, 5.0], [4.0, 90.0], [6.0, 1.0]])) == 4.5
    # three scores: the middle one, and a quarter of each of the others
    assert interquartile_mean(np.array([[1.0], [2.0], [6.0]])) == pytest.approx(
        (0.25 * 1.0 + 2.0 + 0.25 * 6.0) / 1.5
    )
    assert interquartile_mean(np.array([[1.0], [2.0], [3.0], [math.inf]])) == 2.5


@given(SCORES)
def test_the_middle_half_lies_between_the_extremes(scores: FloatArray) -> None:
    assert scores.min() - 1e-9 <= interquartile_mean(scores) <= scores.max() + 1e-9


def test_a_profile_by_hand() -> None:
    scores = np.array([[1.0, 4.0], [2.0, math.inf]])
    assert performance_profile(scores, (1.0, 3.0, 5.0)).tolist() == [0.25, 0.5, 0.75]


def test_the_probability_of_improvement_by_hand() -> None:
    first, second = np.array([[1.0], [3.0]]), np.array([[2.0], [3.0]])
    assert probability_of_improvement(first, second) == pytest.approx((1 + 1 + 0 + 0.5) / 4)
    assert probability_of_improvement(first, first + 9.0) == 1.0
    lost = np.array([[math.inf]])
    assert probability_of_improvement(lost, lost) == 0.5


def test_the_interval_covers_the_mean_of_a_known_distribution() -> None:
    rng, covered = np.random.default_rng(1), 0
    for _ in range(100):
        sample = rng.normal(5.0, 1.0, (40, 1))
        low, high = bootstrap_interval(np.mean, sample, rng=rng, resamples=300)
        covered += low <= 5.0 <= high
    assert 85 <= covered <= 100


def test_runs_are_drawn_within_their_task() -> None:
    scores = np.array([[1.0, 10.0], [1.0, 10.0]])
    low, high = bootstrap_interval(interquartile_mean, scores, rng=np.random.default_rng(0))
    assert low == high == 5.5


def test_an_interval_ends_at_infinity_where_runs_did_not_learn() -> None:
    scores = np.array([[3.0], [4.0], [math.inf], [math.inf]])
    low, high = bootstrap_interval(interquartile_mean, scores, rng=np.random.default_rng(0))
    assert 3.0 <= low <= 4.0
    assert high == math.inf
