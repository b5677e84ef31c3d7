"""Debian packages that tests need, installed where that is allowed."""

from __future__ import annotations

from collections.abc import Callable
import os
import shutil
import subprocess
import sys

import pytest

_INSTALL_S = 600.0


def require(is_installed: Callable[[], bool], advice: str, *packages: str) -> None:
    """Make sure that something is installed; else skip, or fail where CI=true.

    Args:
        is_installed: Returns whether it is.
        advice: Reason of the skip or failure.
        packages: Debian packages that bring it.
    """
    if is_installed():
        return
    if os.geteuid() == 0 and shutil.which('apt-get'):
        _install(*packages)
    if is_installed():
        return
    if os.environ.get('CI') == 'true':
        pytest.fail(advice)
    pytest.skip(advice)


def _install(*packages: str) -> None:
    for words in (['update'], ['install', '-y', *packages]):
        sys.stderr.write(f'apt-get {" ".join(words)}\n')
        subprocess.run(
            ['apt-get', '-q', *words],
            check=False,
            stdout=subprocess.DEVNULL,
            timeout=_INSTALL_S,
            env={**os.environ, 'DEBIAN_FRONTEND': 'noninteractive'},
        )
