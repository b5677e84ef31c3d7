"""Fixtures of the tests of the scripts."""

from pathlib import Path

import pytest

from small_clone import Clone


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    root = tmp_path / 'clone'
    root.mkdir()
    return Clone(root)
