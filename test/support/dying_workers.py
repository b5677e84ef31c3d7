"""Work that kills the process that does it; other processes must be able to import it."""

import os
from pathlib import Path
import signal
from typing import Any

from goalreach_evaluation.sweep import SweepCase


def die_once(mark: str, one: SweepCase) -> dict[str, Any]:
    """Kill the worker at the case of seed 1, the first time it comes."""
    path = Path(mark)
    if one.seed == 1 and not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return one.key


def die(one: SweepCase) -> dict[str, Any]:
    """Kill the worker at the case of seed 1."""
    if one.seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return one.key
