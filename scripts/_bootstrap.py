"""Refuses Windows and Pythons that are too old, in a syntax that even they can read.

Every script imports this module first. What it imports is written for Python 3.10.
"""

import sys

if sys.version_info < (3, 10):
    sys.exit(
        'goalreach needs Python 3.10 or newer, and this is Python %d.%d (%s).'
        % (sys.version_info[0], sys.version_info[1], sys.executable)
    )

if sys.platform == 'win32':
    sys.exit('goalreach runs on Linux only: start it in WSL or in a container.')

from _environment import prepare, run

__all__ = ['prepare', 'run']
