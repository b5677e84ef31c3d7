"""What repeated measurements come to."""

from __future__ import annotations

from collections.abc import Sequence
import statistics
from typing import NamedTuple

import numpy as np


class Line(NamedTuple):
    """A straight line through measurements.

    Attributes:
        start: Value at 0.
        slope: Gain for each unit.
        r_squared: Share of the variance that the line explains.
    """

    start: float
    slope: float
    r_squared: float


def fit_line(x: Sequence[float], y: Sequence[float]) -> Line:
    """Return the line of least squares.

    >>> fit_line([0, 1, 2], [1, 3, 5])
    Line(start=1.0, slope=2.0, r_squared=1.0)
    """
    mean_x, mean_y = statistics.fmean(x), statistics.fmean(y)
    from_x = [one - mean_x for one in x]
    from_y = [one - mean_y for one in y]
    slope = sum(a * b for a, b in zip(from_x, from_y, strict=True)) / sum(a * a for a in from_x)
    off = sum((b - slope * a) ** 2 for a, b in zip(from_x, from_y, strict=True))
    total = sum(b * b for b in from_y)
    return Line(mean_y - slope * mean_x, slope, 1.0 - off / total if total else 1.0)


def percentile(values: Sequence[float], percent: float) -> float:
    """Return a percentile."""
    return float(np.percentile(values, percent))


def spread(values: Sequence[float], reference: Sequence[float] = ()) -> str:
    """Return from where to where repeated measurements go, in words."""
    ours = f'from {min(values):.3g} to {max(values):.3g}'
    if not reference:
        return ours
    return f'{ours}; reference from {min(reference):.3g} to {max(reference):.3g}'
