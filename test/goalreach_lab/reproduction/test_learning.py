import numpy as np
import pytest

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.reproduction.learning import (
    BUMP_END,
    GOAL_END,
    SETTLED,
    SUCCESS,
    VALUES,
    learning_study,
    settled_after,
    value_iteration,
)
from goalreach_lab.study import find


def test_wilson_interval_by_hand() -> None:
    # z^2 = 3.8415: centre (0.5 + 0.19207) / 1.38415, half 1.96 sqrt(0.025 + 0.0096) / 1.38415
    assert wilson_interval(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert wilson_interval(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)


def test_settled_after() -> None:
    assert settled_after([True, True, True]) == 1
    assert settled_after([False, True, False, True]) == 4
    assert settled_after([True, False]) == 3  # not within the two


def test_a_chain_has_powers_of_gamma() -> None:
    counts = np.zeros((3, 3, 8, 11), dtype=np.int64)
    counts[0, 2, 0, 1] = 5  # (0, 2) -> (0, 1) -> (0, 0) -> goal
    counts[0, 1, 0, 0] = 5
    counts[0, 0, 0, GOAL_END] = 5
    counts[0, 0, 3, BUMP_END] = 1
    q = value_iteration(counts, gamma=0.5)
    assert q[0, 0, 0] == pytest.approx(1.0)
    assert q[0, 1, 0] == pytest.approx(0.5)
    assert q[0, 2, 0] == pytest.approx(0.25)
    assert q[0, 0, 3] == -1.0
    assert q[2, 2].tolist() == [0.0] * 8


def test_frequencies_are_averaged() -> None:
    counts = np.zeros((3, 3, 8, 11), dtype=np.int64)
    counts[0, 0, 0, GOAL_END] = 3
    counts[0, 0, 0, BUMP_END] = 1
    counts[0, 1, 2, 0] = 1
    q = value_iteration(counts, gamma=0.9)
    assert q[0, 0, 0] == pytest.approx(0.75 - 0.25)
    assert q[0, 1, 2] == pytest.approx(0.45)


def test_rows_of_a_small_study() -> None:
    study = learning_study(seeds=40, variation_seeds=5, seed=0, jobs=1)
    by_name = {row.name: row for row in study.rows(find(study))}
    success = by_name[SUCCESS]
    assert (success.ours, success.n, success.met) == (100.0, 40, True)
    assert 1 <= by_name[SETTLED].ours <= 10
    assert 0.0 < by_name[VALUES].ours < 0.05
    assert sum(name.startswith('with ') for name in by_name) == 9
