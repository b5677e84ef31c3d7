"""One line of a benchmark: our figure, its reference, and the goal."""

from dataclasses import asdict, dataclass
import math
import operator
from typing import Any

from goalreach_evaluation.path_metrics import wilson_interval

_RELATIONS = {'<=': operator.le, '>=': operator.ge}


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A bound of a row's value or ratio.

    Attributes:
        of: 'ours' or 'ratio'.
        relation: '<=' or '>='.
        bound: The bound.
    """

    of: str
    relation: str
    bound: float

    def __str__(self) -> str:
        """Return the goal as it is printed."""
        return f'{"ratio " if self.of == "ratio" else ""}{self.relation} {self.bound:g}'


@dataclass(frozen=True, kw_only=True)
class BenchRow:
    """A measured figure.

    Attributes:
        name: What was measured.
        unit: Its unit.
        ours: Our figure.
        reference: The floor's or peer's figure in the same unit, or None.
        reference_name: What the reference is.
        goal: The goal, or None.
        n: Number of samples behind the figure.
        note: One line for people: spread, interval, or why a row is missing.
    """

    name: str
    unit: str
    ours: float
    reference: float | None = None
    reference_name: str = ''
    goal: Goal | None = None
    n: int = 1
    note: str = ''

    @classmethod
    def none_allowed(
        cls, name: str, count: float, *, unit: str = '', n: int = 1, note: str = ''
    ) -> 'BenchRow':
        """Return the row of a count whose goal is zero."""
        goal = Goal(of='ours', relation='<=', bound=0.0)
        return cls(name=name, unit=unit, ours=count, goal=goal, n=n, note=note)

    @classmethod
    def share(
        cls,
        name: str,
        count: int,
        n: int,
        *,
        unit: str,
        least: float | None = None,
        note: str = '',
    ) -> 'BenchRow':
        """Return the row of a share in percent, its 95 % interval before the note."""
        low, high = wilson_interval(count, n)
        goal = None if least is None else Goal(of='ours', relation='>=', bound=least)
        interval = f'95 % interval {100 * low:.2f} to {100 * high:.2f} %'
        return cls(
            name=name, unit=unit, ours=100 * count / n, goal=goal, n=n, note=interval + note
        )

    @property
    def ratio(self) -> float | None:
        """Ours divided by the reference, or None without one."""
        return self.ours / self.reference if self.reference else None

    @property
    def met(self) -> bool | None:
        """Whether the goal is met, or None without one."""
        if self.goal is None:
            return None
        value = self.ours if self.goal.of == 'ours' else self.ratio
        return value is not None and bool(_RELATIONS[self.goal.relation](value, self.goal.bound))

    def to_json(self) -> dict[str, Any]:
        """Return the row as `bench --json` writes it: None for what is not finite."""
        row = {**asdict(self), 'ratio': self.ratio, 'met': self.met}
        row['goal'] = None if self.goal is None else str(self.goal)
        infinite = [
            name for name, x in row.items() if isinstance(x, float) and not math.isfinite(x)
        ]
        return row | dict.fromkeys(infinite)
