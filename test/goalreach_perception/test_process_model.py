from __future__ import annotations

from dataclasses import replace
import itertools
import math

import numpy as np
import pytest

from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.measurement_model import DRIFT, HEADING, LEVEL, SCALE, SLIP
from goalreach_perception.process_model import FadingMemory, OdometryConfig, OdometryModel

MEMORY = FadingMemory(
    np.array([1.0, 5.0]), np.diag([4.0, 0.0]), np.array([True, False]), memory_s=10.0
)


def test_after_one_time_constant() -> None:
    mean, covariance = MEMORY.fade(np.array([2.0, 7.0]), np.diag([0.5, 0.3]), 10.0)
    kept = math.exp(-1.0)
    assert mean == pytest.approx([1.0 + kept, 7.0])
    assert covariance == pytest.approx(np.diag([0.5 * kept**2 + 4.0 * (1.0 - kept**2), 0.3]))


def test_two_half_steps_equal_one() -> None:
    start = np.array([2.0, 7.0]), np.array([[0.5, 0.1], [0.1, 0.3]])
    once = MEMORY.fade(*start, 4.0)
    twice = MEMORY.fade(*MEMORY.fade(*start, 2.0), 2.0)
    assert twice[0] == pytest.approx(once[0])
    assert twice[1] == pytest.approx(once[1])


def test_an_infinite_time_restores_the_prior() -> None:
    mean, covariance = MEMORY.fade(np.array([2.0, 7.0]), np.diag([0.5, 0.3]), math.inf)
    assert mean == pytest.approx([1.0, 7.0])
    assert covariance == pytest.approx(np.diag([4.0, 0.3]))


@pytest.mark.parametrize('recovers', [True, False])
def test_growth_fades_where_all_constants_do_and_outlives_a_loss(*, recovers: bool) -> None:
    prior = np.diag([4.0, 1.0])
    memory = FadingMemory(np.zeros(2), prior, np.array([True, recovers]), memory_s=10.0)
    memory.growth = 5.0
    state: tuple[FloatArray, FloatArray] = np.zeros(2), 5.0 * prior
    assert memory.fade(*state, math.inf)[1] == pytest.approx(5.0 * prior)
    memory.fade(*state, 10.0)
    assert memory.growth == pytest.approx(1.0 + 4.0 * math.exp(-1.0) if recovers else 5.0)
    for _ in range(10):
        state = memory.fade(*state, 10.0)
    assert memory.growth == (1.0 if recovers else 5.0)
    assert state[1] == pytest.approx(prior if recovers else 5.0 * prior)


def test_a_turn_may_be_divided() -> None:
    """A quarter circle of 1 m radius by wheels that turn a tenth further than odometry says."""
    ends = []
    for steps in (10, 1000):
        model, mean = OdometryModel(21, OdometryConfig(turn_scale=1.1)), np.zeros(21)
        model.restart(0.0, 0.0)
        angles = np.linspace(0.0, math.pi / 2, steps + 1)
        poses = [Pose2(x_m=math.sin(a), y_m=1.0 - math.cos(a), heading_rad=a) for a in angles]
        for before, after in itertools.pairwise(poses):
            model.propagate_mean(mean, before, after)
        ends.append(mean[:3].copy())
    assert ends[0] == pytest.approx(ends[1], abs=2e-3)


def _in_a_bend(state: int, value: float) -> tuple[FloatArray, FloatArray]:
    """Return the pose after half a second of a bend, and its derivative by a state."""
    model, mean, prior = OdometryModel(21), np.zeros(21), np.zeros((21, 21))
    mean[:3], prior[state, state] = (1.0, 2.0, 0.5), 1.0
    mean[state] += value
    model.restart(1.0, 2.0)
    before = Pose2(x_m=0.3, y_m=0.1, heading_rad=0.2)
    model.propagate_mean(mean, before, Pose2(x_m=0.5, y_m=0.2, heading_rad=0.6), 0.5)
    return mean[:3], model.propagate_covariance(prior)[:3, state]


@pytest.mark.parametrize('base_turns', [False, True])
def test_the_level_turns_in_the_map_with_a_base_that_turns(*, base_turns: bool) -> None:
    model, mean, prior = OdometryModel(23, base_turns=base_turns), np.zeros(23), np.eye(23)
    mean[LEVEL:], prior[LEVEL, LEVEL], prior[0, LEVEL] = (0.002, 0.001), 4.0, 0.5
    prior[LEVEL, 0] = 0.5
    before = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
    turn_rad = math.pi / 2 if base_turns else 0.0
    model.propagate_mean(mean, before, replace(before, heading_rad=math.pi / 2))
    turn = np.exp(1j * turn_rad) * (0.002 + 0.001j)
    assert mean[LEVEL:] == pytest.approx([turn.real, turn.imag], abs=1e-12)
    after = model.propagate_covariance(prior)
    assert after.diagonal()[LEVEL:] == pytest.approx([1.0, 4.0] if base_turns else [4.0, 1.0])
    assert after[0, LEVEL:] == pytest.approx([0.0, 0.5] if base_turns else [0.5, 0.0])


@pytest.mark.parametrize('state', [HEADING, SCALE, DRIFT, SLIP])
def test_derivatives_of_the_motion(state: int) -> None:
    cosine, sine = math.cos(0.3), math.sin(0.3)  # from odom to map
    pose, derivative = _in_a_bend(state, 0.0)
    east, north = 0.2 * cosine - 0.1 * sine, 0.2 * sine + 0.1 * cosine
    assert pose == pytest.approx([1.0 + east, 2.0 + north, 0.9])
    numeric = (_in_a_bend(state, 1e-6)[0] - _in_a_bend(state, -1e-6)[0]) / 2e-6
    assert derivative == pytest.approx(numeric, abs=1e-6)
    if state == SLIP:  # outwards, by the speed times the turn of 0.8 rad/s
        assert derivative == pytest.approx([0.8 * north, -0.8 * east, 0.0])
