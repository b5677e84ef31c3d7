"""How much a measurement may cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Budget:
    """What all measurements share.

    Attributes:
        seed: Seed of everything random.
        scale: Factor on seconds, frames, drives and rounds; 1 is what the document is made with.
    """

    seed: int
    scale: float

    def count(self, full: int, least: int = 1) -> int:
        """Return a number of things that is `full` at scale 1."""
        return max(least, round(full * self.scale))

    def seconds(self, full: float, least: float = 0.5) -> float:
        """Return a duration that is `full` at scale 1."""
        return max(least, full * self.scale)
