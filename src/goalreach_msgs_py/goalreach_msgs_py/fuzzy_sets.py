"""The fuzzy sets of the paper's Fig. 5: three trapezoids over an axis that sum to one."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ['memberships']


def memberships(value: float, knots: Sequence[float]) -> tuple[float, float, float]:
    """Return how far a value belongs to each of three fuzzy sets.

    Fig. 5 of the paper: the first set is full on [k0, k1] and fades to the second on [k1, k2],
    the second is full on [k2, k3] and fades to the third on [k3, k4], the third is full on
    [k4, k5]. Beyond the outer knots the nearest set is full.

    Args:
        value: Position along the axis, in the unit of the knots.
        knots: Six ascending numbers.

    Returns:
        Memberships in [0, 1] whose sum is one; at most two are above zero.

    >>> memberships(2.5, (0.0, 1.0, 3.0, 5.0, 7.0, 8.0))
    (0.25, 0.75, 0.0)
    """
    _, k1, k2, k3, k4, _ = knots
    if value < k2:
        first = 1.0 if value <= k1 else (k2 - value) / (k2 - k1)
        return first, 1.0 - first, 0.0
    if value > k3:
        third = 1.0 if value >= k4 else (value - k3) / (k4 - k3)
        return 0.0, 1.0 - third, third
    return 0.0, 1.0, 0.0
