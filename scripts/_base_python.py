"""Finds the Python that the private environment is made with."""

from pathlib import Path
import platform
import re
import shutil
import subprocess
import sys

from _install import SetupError

OLDEST_GLIBC = (2, 28)  # of the ROS 2 wheels
SUPPORTED_MINORS = (13, 12, 11, 10)  # of Python 3: those the ROS 2 Jazzy wheels are built for


def base_python() -> str:
    """Return a Python that can make the environment.

    Raises:
        SetupError: Where there is none, with what is missing.
    """
    libc, version = platform.libc_ver()
    numbers = tuple(int(part) for part in re.findall(r'\d+', version)[:2])
    here = (sys.platform, platform.machine(), libc)
    if here != ('linux', 'x86_64', 'glibc') or numbers < OLDEST_GLIBC:
        message = (
            'ROS 2 comes as wheels for Linux on x86_64 with glibc 2.28 or newer only: on this '
            'machine, source a ROS 2 Jazzy workspace first.'
        )
        raise SetupError(message)
    python = _candidate()
    if not _answers(python, 'import ensurepip, venv'):
        message = (
            f'{python} has no venv module: install it (Debian and Ubuntu: `sudo apt install '
            'python3-venv`), then start the same command again.'
        )
        raise SetupError(message)
    return python


def own_base() -> str:
    """Return the Python this one is, or was made from if it is a virtual environment's."""
    path = Path(sys.base_prefix, 'bin', f'python3.{sys.version_info[1]}')
    return str(path) if path.exists() else sys.executable


def _candidate() -> str:
    if sys.version_info[1] in SUPPORTED_MINORS:
        return own_base()
    for minor in SUPPORTED_MINORS:
        path = shutil.which(f'python3.{minor}')
        if path and _answers(path, 'pass'):
            return path
    message = (
        'ROS 2 Jazzy comes as wheels for Python 3.10 to 3.13, and none of them is here (this is '
        f'{platform.python_version()}): install one and start the same command with it.'
    )
    raise SetupError(message)


def _answers(python: str, code: str) -> bool:
    return not subprocess.run([python, '-c', code], capture_output=True, check=False).returncode
