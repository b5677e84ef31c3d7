"""What MuJoCo needs to render without a window, installed where that is allowed."""

from __future__ import annotations

from ctypes.util import find_library
import importlib.util

import pytest

import debian

_ADVICE = 'needs a renderer for MuJoCo: apt-get install libegl1 libgl1-mesa-dri'


def require_rendering() -> None:
    """Make sure that MuJoCo can render; else skip, or fail where CI=true."""
    if importlib.util.find_spec('mujoco') is None:
        pytest.skip('needs MuJoCo: the extra mujoco')
    debian.require(
        lambda: bool(find_library('EGL') or find_library('OSMesa')),
        _ADVICE,
        'libegl1',
        'libgl1-mesa-dri',
    )
