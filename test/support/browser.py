"""A headless browser for tests: Debian's Chromium, installed where that is allowed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from goalreach_lab.rigs.chromium import ADVICE, is_installed

_INSTALL_S = 600.0


def require_browser() -> None:
    """Make sure that there is a browser; else skip, or fail where CI=true."""
    if is_installed():
        return
    if os.geteuid() == 0 and shutil.which('apt-get'):
        _install()
    if is_installed():
        return
    if os.environ.get('CI') == 'true':
        pytest.fail(ADVICE)
    pytest.skip(ADVICE)


def _install() -> None:
    for words in (['update'], ['install', '-y', 'chromium', 'chromium-driver']):
        sys.stderr.write(f'apt-get {" ".join(words)}\n')
        subprocess.run(
            ['apt-get', '-q', *words],
            check=False,
            stdout=subprocess.DEVNULL,
            timeout=_INSTALL_S,
            env={**os.environ, 'DEBIAN_FRONTEND': 'noninteractive'},
        )
