"""What is told of many paths, without keeping them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from goalreach_bringup.path_metrics import PathResult

__all__ = ['PathTally', 'Spread']

_MEASURES: Final = ('duration_s', 'length_m', 'turning_rad')
_ERRORS: Final = ('pose_error_m', 'heading_error_rad')


@dataclass
class Spread:
    """Mean and worst of one measure of paths, in its unit.

    Attributes:
        total: Sum over the paths.
        worst: The largest.
    """

    total: float = 0.0
    worst: float = 0.0

    def add(self, value: float) -> None:
        """Count one path's."""
        self.total += value
        self.worst = max(self.worst, value)


@dataclass
class PathTally:
    """Counts paths one by one; a run of days takes no more room than one path.

    Attributes:
        paths: How many there were.
        goals: How many reached the goal, judged by the truth.
        spreads: Of 'duration_s', 'length_m', 'turning_rad', and of the 95th percentiles of a
            path's 'pose_error_m' and 'heading_error_rad'.
    """

    paths: int = 0
    goals: int = 0
    spreads: dict[str, Spread] = field(
        default_factory=lambda: {name: Spread() for name in (*_MEASURES, *_ERRORS)}
    )

    @classmethod
    def of(cls, results: Iterable[PathResult]) -> PathTally:
        """Return the tally of paths that are there."""
        tally = cls()
        for result in results:
            tally.add(result)
        return tally

    def add(self, result: PathResult) -> None:
        """Count a path."""
        self.paths += 1
        self.goals += result.outcome == 'goal'
        for name in _MEASURES:
            self.spreads[name].add(getattr(result, name))
        for name in _ERRORS:
            self.spreads[name].add(getattr(result, name)['p95'])

    def mean(self, name: str) -> float:
        """Return the mean over the paths of one of the measures; 0 where there are no paths."""
        return self.spreads[name].total / self.paths if self.paths else 0.0
