"""A headless browser for tests: Debian's Chromium, installed where that is allowed."""

from __future__ import annotations

import debian
from goalreach_lab.rigs.chromium import ADVICE, is_installed


def require_browser() -> None:
    """Make sure that there is a browser; else skip, or fail where CI=true."""
    debian.require(is_installed, ADVICE, 'chromium', 'chromium-driver')
