"""The paper's arena, and a policy learned in it."""

import numpy as np
import pytest

from goalreach_learning.policy import Policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena


@pytest.fixture(scope='session')
def arena() -> Arena:
    return Arena()


@pytest.fixture(scope='session')
def learned(arena: Arena) -> Policy:
    return train(arena, rng=np.random.default_rng(0)).policy
