"""One thing that reads what others made, and how it is judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
import math
import time
import traceback
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.errors import GoalreachError

SLOW_S: Final = 5.0
"""An input that takes more processor time than this hangs; chosen: a hundred times the usual."""

STUCK_S: Final = 60.0
"""One that takes longer than this by the clock hangs, whatever it waits for; chosen."""

_LONGEST_LINE: Final = 1500


class Nonsense(Exception):  # noqa: N818 - what it is
    """A reader accepted what makes no sense."""


@dataclass(frozen=True, kw_only=True)
class Reader:
    """Something that reads input.

    Attributes:
        name: What it reads.
        attempt: Makes one bad input from the generator and reads it; returns what was read.
            Raises `GoalreachError` where it refused, `Nonsense` where it should have.
    """

    name: str
    attempt: Callable[[np.random.Generator], object]


@dataclass
class Tally:
    """What a reader did with many inputs.

    Attributes:
        name: The reader.
        inputs: How many.
        refused: Refused with one line.
        accepted: Accepted, and sensible.
        tracebacks: Seeds and texts of those that ended in another exception, an unclear line,
            or were accepted and make no sense.
        hangs: Seeds of those that took too long.
    """

    name: str
    inputs: int = 0
    refused: int = 0
    accepted: int = 0
    tracebacks: list[tuple[int, str]] = field(default_factory=list)
    hangs: list[int] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Count what the reader did with further inputs."""
        self.inputs += other.inputs
        self.refused += other.refused
        self.accepted += other.accepted
        self.tracebacks += other.tracebacks
        self.hangs += other.hangs


def try_inputs(reader: Reader, seeds: Iterable[int]) -> Tally:
    """Return what a reader did with the inputs of some seeds."""
    tally = Tally(reader.name)
    for seed in seeds:
        tally.inputs += 1
        began_s, worked_s = time.monotonic(), time.process_time()
        try:
            reader.attempt(np.random.default_rng(seed))
            tally.accepted += 1
        except GoalreachError as error:
            tally.refused += 1
            line = str(error)
            if '\n' in line or not line.strip() or len(line) > _LONGEST_LINE:
                tally.tracebacks.append((seed, f'not one clear line: {line[:200]!r}'))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is found here
            frames = traceback.extract_tb(error.__traceback__)
            where = f'{frames[-1].filename.rpartition("/")[2]}:{frames[-1].lineno}'
            text = f'{type(error).__name__}: {str(error)[:200]} ({where})'
            tally.tracebacks.append((seed, text))
        worked_s = time.process_time() - worked_s
        if worked_s > SLOW_S or time.monotonic() - began_s > STUCK_S:
            tally.hangs.append(seed)
    return tally


def require_finite(value: Any, place: str = '') -> None:
    """Look through a value for numbers that are none.

    Raises:
        Nonsense: There is one.
    """
    if isinstance(value, float) and not math.isfinite(value):
        raise Nonsense(f'{place} = {value}')
    if isinstance(value, np.ndarray) and not np.isfinite(value).all():
        raise Nonsense(f'{place} holds a number that is none')
    if isinstance(value, dict):
        for key, element in value.items():
            require_finite(element, f'{place}.{key}')
    if isinstance(value, (list, tuple)):
        for index, element in enumerate(value):
            require_finite(element, f'{place}[{index}]')
    if hasattr(value, '__dataclass_fields__'):
        for name in value.__dataclass_fields__:
            require_finite(getattr(value, name), f'{place}.{name}')
