"""Where two messages of one type differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import itertools
import math
from typing import Any

import numpy as np

from goalreach_bringup.bags.decoder import flatten

__all__ = ['FieldDifference', 'differences']


@dataclass(frozen=True, kw_only=True)
class FieldDifference:
    """One field that is not the same.

    Attributes:
        field: Its dotted name, with the index of the worst element for an array.
        first: Its value in the first message.
        second: Its value in the second.
        amount: Absolute difference; infinite where one is no number.
    """

    field: str
    first: Any
    second: Any
    amount: float


def differences(first: object, second: object) -> Iterator[FieldDifference]:
    """Yield the fields in which two messages differ.

    Texts that both are numbers count as numbers: diagnostics carry values that way. NaN equals
    NaN: it means "not seen".

    Args:
        first: A message.
        second: Another one of the same type.
    """
    for mine, yours in itertools.zip_longest(flatten(first), flatten(second)):
        if mine is None or yours is None or mine[0] != yours[0]:
            name = (mine or yours or ('', None))[0]
            yield _different(name, mine and mine[1], yours and yours[1], math.inf)
            return
        yield from _compare(mine[0], mine[1], yours[1])


def _compare(name: str, first: Any, second: Any) -> Iterator[FieldDifference]:  # noqa: ANN401
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        yield from _compare_arrays(name, first, second)
        return
    left, right = _number(first), _number(second)
    if left is None or right is None:
        if first != second:
            yield _different(name, first, second, math.inf)
        return
    amount = _distance(left, right)
    if amount:
        yield _different(name, first, second, amount)


def _compare_arrays(
    name: str, first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]
) -> Iterator[FieldDifference]:
    if first.shape != second.shape:
        yield _different(f'{name}.length', len(first), len(second), math.inf)
        return
    with np.errstate(invalid='ignore'):
        distances = np.abs(first.astype(np.float64) - second.astype(np.float64))
    same = (first == second) | (np.isnan(distances) & _both_nan(first, second))
    distances[same] = 0.0
    distances[np.isnan(distances)] = np.inf
    if distances.size and distances.max() > 0.0:
        worst = int(distances.argmax())
        found = first.item(worst), second.item(worst)
        yield _different(f'{name}[{worst}]', *found, float(distances[worst]))


def _both_nan(
    first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    if first.dtype.kind != 'f':
        return np.zeros(first.shape, dtype=np.bool_)
    both: np.ndarray[Any, np.dtype[np.bool_]] = np.isnan(first) & np.isnan(second)
    return both


def _number(value: Any) -> float | None:  # noqa: ANN401 - a field of any type
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _distance(first: float, second: float) -> float:
    if first == second or (math.isnan(first) and math.isnan(second)):
        return 0.0
    distance = abs(first - second)
    return math.inf if math.isnan(distance) else distance


def _different(name: str, first: object, second: object, amount: float) -> FieldDifference:
    return FieldDifference(field=name, first=first, second=second, amount=amount)
