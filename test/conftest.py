"""Fixtures of many tests, and the mark of those that `colcon test` runs."""

from pathlib import Path

from hypothesis import HealthCheck, settings
import numpy as np
import pytest

from goalreach_learning.policy import Policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena

# No test judges by the wall clock: the machine may be busy.
settings.register_profile('untimed', deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile('untimed')

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope='session')
def arena() -> Arena:
    return Arena()


@pytest.fixture(scope='session')
def learned(arena: Arena) -> Policy:
    return train(arena, rng=np.random.default_rng(0)).policy


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    packages = {path.parent.name for path in (ROOT / 'src').glob('*/package.xml')}
    for item in items:
        folder = item.path.relative_to(ROOT / 'test').parts[0]
        if folder in packages:
            item.add_marker(pytest.mark.package)
