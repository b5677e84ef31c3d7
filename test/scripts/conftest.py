"""Fixtures of the tests of the scripts."""

from pathlib import Path

import pytest

from small_clone import Clone


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if 'clone' in getattr(item, 'fixturenames', ()):
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    """Give a clone in a folder whose special characters must be no obstacle."""
    root = tmp_path / 'a $HOME; "b"'
    root.mkdir()
    return Clone(root)
