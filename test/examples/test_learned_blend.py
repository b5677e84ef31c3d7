"""The example that learns a weight of a blend."""

import pytest

pytest.importorskip('gymnasium')

from learned_blend import WEIGHTS, BlendEnv, learn


def test_a_path_is_driven_and_rewarded() -> None:
    env = BlendEnv()
    env.reset(seed=3)
    first = env.arena
    _, reward, terminated, truncated, info = env.step(3)
    assert (terminated, truncated) == (True, False)
    assert info['outcome'] == 'goal'
    assert 0.5 < reward < 1.0
    env.reset()
    assert env.arena != first
    env.reset(seed=3)
    assert env.arena == first


def test_only_weights_that_were_driven_gain_a_value() -> None:
    values = learn(paths=2, seed=1)
    assert len(values) == len(WEIGHTS)
    assert 1 <= sum(value != 0.0 for value in values) <= 2
