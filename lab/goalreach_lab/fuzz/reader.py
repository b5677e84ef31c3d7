"""Readers under test, and the tally of what they did with bad input."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
import math
import time
import traceback
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.errors import GoalreachError

SLOW_S: Final = 5.0
"""An input that takes more processor time is a hang; chosen, a hundred times the usual."""

STUCK_S: Final = 60.0
"""An input that takes longer by the wall clock is a hang; chosen."""

_LONGEST_LINE: Final = 1500


class InvalidAcceptedError(Exception):
    """A reader accepted an invalid value."""


@dataclass(frozen=True, kw_only=True)
class Reader:
    """A reader under test.

    Attributes:
        name: Name of its input.
        attempt: Makes one bad input from the generator, reads it and returns the value read.
            Raises `GoalreachError` where the reader refuses the input, and `InvalidAcceptedError`
            where it accepts an invalid value.
    """

    name: str
    attempt: Callable[[np.random.Generator], object]


@dataclass
class Tally:
    """Counts of what a reader did with many inputs.

    Attributes:
        name: Name of the reader.
        inputs: Number of inputs.
        refused: Inputs refused with one line.
        accepted: Inputs accepted with a valid value.
        tracebacks: Seeds and texts of inputs that ended in another exception or an unclear line,
            or were accepted with an invalid value.
        hangs: Seeds of inputs that took too long.
    """

    name: str
    inputs: int = 0
    refused: int = 0
    accepted: int = 0
    tracebacks: list[tuple[int, str]] = field(default_factory=list)
    hangs: list[int] = field(default_factory=list)

    def add(self, other: 'Tally') -> None:
        """Add the counts of further inputs."""
        self.inputs += other.inputs
        self.refused += other.refused
        self.accepted += other.accepted
        self.tracebacks += other.tracebacks
        self.hangs += other.hangs


def try_inputs(reader: Reader, seeds: Iterable[int]) -> Tally:
    """Feed a reader the inputs of some seeds; return its tally."""
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
        except Exception as error:  # noqa: BLE001 - any other exception is a finding
            frames = traceback.extract_tb(error.__traceback__)
            where = f'{frames[-1].filename.rpartition("/")[2]}:{frames[-1].lineno}'
            text = f'{type(error).__name__}: {str(error)[:200]} ({where})'
            tally.tracebacks.append((seed, text))
        worked_s = time.process_time() - worked_s
        if worked_s > SLOW_S or time.monotonic() - began_s > STUCK_S:
            tally.hangs.append(seed)
    return tally


def require_finite(value: Any, place: str = '') -> None:
    """Search a value, however nested, for numbers that are not finite.

    Raises:
        InvalidAcceptedError: There is one.
    """
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidAcceptedError(f'{place} = {value}')
    if isinstance(value, np.ndarray) and not np.isfinite(value).all():
        raise InvalidAcceptedError(f'{place} holds a number that is not finite')
    if isinstance(value, dict):
        for key, element in value.items():
            require_finite(element, f'{place}.{key}')
    if isinstance(value, (list, tuple)):
        for index, element in enumerate(value):
            require_finite(element, f'{place}[{index}]')
    if hasattr(value, '__dataclass_fields__'):
        for name in value.__dataclass_fields__:
            require_finite(getattr(value, name), f'{place}.{name}')
