"""Fixtures of the tests of bags in graphs."""

from collections.abc import Callable
from pathlib import Path

import pytest

from goalreach_bringup.cli import main
from goalreach_msgs_py.ros.dds_profile import PROFILE_VARIABLE, fast_dds_profile
import graphs

Refusal = Callable[..., str]


@pytest.fixture
def refusal(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Refusal:
    """Give a function that runs a command in this process and returns the line that refuses it."""
    for name, value in graphs.graph_environment(graphs.fresh_domain(), tmp_path).items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv(PROFILE_VARIABLE, fast_dds_profile())  # as in the other tests

    def refuse(*arguments: str) -> str:
        assert main(arguments) == 2
        out, error = capfd.readouterr()
        assert out == ''
        assert len(error.splitlines()) == 1, error
        return error

    return refuse
