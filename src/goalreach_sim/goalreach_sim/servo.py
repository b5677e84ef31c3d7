"""A position servo of the camera head, limited in range and rate."""

from __future__ import annotations

import math

__all__ = ['Servo']


class Servo:
    """Turns towards its target at a constant rate and holds it; exact for any step length.

    Args:
        minimum_rad: Lower end of its range.
        maximum_rad: Upper end of its range.
        rate_rad_per_s: How fast it turns.

    Attributes:
        position_rad: Where it stands by its own encoder, before noise.
    """

    def __init__(self, *, minimum_rad: float, maximum_rad: float, rate_rad_per_s: float) -> None:
        self.position_rad = 0.0
        self._minimum_rad = minimum_rad
        self._maximum_rad = maximum_rad
        self._rate_rad_per_s = rate_rad_per_s
        self._target_rad = 0.0

    @property
    def velocity_rad_per_s(self) -> float:
        """How fast it turns now."""
        to_go_rad = self._target_rad - self.position_rad
        if to_go_rad == 0.0:
            return 0.0
        return self._rate_rad_per_s if to_go_rad > 0.0 else -self._rate_rad_per_s

    def place(self, position_rad: float) -> None:
        """Stand still at a position."""
        self.position_rad = self._target_rad = position_rad

    def go_to(self, target_rad: float) -> None:
        """Take a new target, clipped to the range.

        Raises:
            ValueError: The target is not finite.
        """
        if not math.isfinite(target_rad):
            raise ValueError(f'target {target_rad!r} is not finite')
        self._target_rad = min(max(target_rad, self._minimum_rad), self._maximum_rad)

    def advance(self, dt_s: float) -> None:
        """Turn for a time."""
        reach_rad = self._rate_rad_per_s * dt_s
        to_go_rad = self._target_rad - self.position_rad
        if abs(to_go_rad) <= reach_rad:
            self.position_rad = self._target_rad
        else:
            self.position_rad += reach_rad if to_go_rad > 0.0 else -reach_rad
