"""The gate's second run of the few tests that failed."""

from pathlib import Path

import pytest

import gate

TESTS = """
import os

def test_alone():
    assert 'PYTEST_XDIST_WORKER' not in os.environ

def test_never():
    assert {never}
"""


@pytest.mark.parametrize('never', [True, False])
def test_a_test_that_passes_only_alone_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, never: bool
) -> None:
    (tmp_path / 'test_some.py').write_text(TESTS.format(never=never))
    monkeypatch.delenv('PYTEST_XDIST_WORKER', raising=False)
    monkeypatch.setattr(gate, 'ROOT', tmp_path)
    monkeypatch.setattr(gate, 'WORKERS', 1)
    ok, note = gate._pytest([])
    assert ok is never
    assert note.endswith('; passed only alone: test_some.py::test_alone')
