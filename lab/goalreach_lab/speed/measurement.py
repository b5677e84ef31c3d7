"""The extent of a measurement, and the spread of repeated ones."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Budget:
    """How much all measurements of a run may cost.

    Attributes:
        seed: Seed of everything random.
        scale: Factor on seconds, frames, drives and rounds; 1 is that of the document.
    """

    seed: int
    scale: float

    def count(self, full: int, least: int = 1) -> int:
        """Return a number of things that is `full` at scale 1."""
        return max(least, round(full * self.scale))

    def seconds(self, full: float, least: float = 0.5) -> float:
        """Return a duration, s, that is `full` at scale 1."""
        return max(least, full * self.scale)


def spread(values: Sequence[float], reference: Sequence[float] = ()) -> str:
    """Return the range of repeated measurements, and of those of the reference, as text."""
    ours = f'from {min(values):.3g} to {max(values):.3g}'
    if not reference:
        return ours
    return f'{ours}; reference from {min(reference):.3g} to {max(reference):.3g}'
