"""The outcome of an injected fault, the outcomes of a kind of fault, and their table."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
import re
from typing import Any, Final

import numpy as np

from goalreach_lab.faults.kinds import KINDS, FaultKind
from goalreach_lab.faults.observer import Moment, StackObserver
from goalreach_lab.template import table

_ENDING: Final = {kind.name for kind in KINDS if kind.ends_paths}
_HEADINGS: Final = (
    'fault', 'expected', 'n', 'bumps', 'overconfident', 'worst', 'hangs', 'recovery', 'reported',
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FaultOutcome:
    """The outcome of one fault.

    Attributes:
        kind: Name of the kind.
        bumps: Walls run into from the beginning of the fault until the recovery.
        overconfident: States with confidence OK that were off by more than 6 in.
        worst_m: Largest error of a state with confidence OK.
        recovery_s: Seconds from the fault's end to normal driving, of the graph's clock or of the
            wall clock, whichever is more; None where the robot did not recover: a hang.
        report: The line that reported the fault, or an empty text.
        moment_s: When the fault began, seconds of the graph's clock.
        path_ended: Whether a path ended meanwhile: then the time contains the way to the next
            start and the search for LEDs there, which are no part of the fault.
    """

    kind: str
    bumps: int
    overconfident: int
    worst_m: float
    recovery_s: float | None
    report: str
    moment_s: float
    path_ended: bool = False

    @classmethod
    def observed(
        cls,
        kind: FaultKind,
        observer: StackObserver,
        *,
        began_ns: int,
        ended: Moment,
        normal: Moment | None,
        speed: float = 1.0,
    ) -> 'FaultOutcome':
        """Return the outcome of a fault from what was observed since it began.

        Args:
            kind: The kind of fault.
            observer: Its counts and lines were reset when the fault began.
            began_ns: When the fault began.
            ended: When it ended.
            normal: The first moment of normal driving after it, or None without any.
            speed: Seconds of the graph's clock in one of the wall clock.
        """
        recovery_s = None
        if normal is not None:
            by_graph_s = (normal[0] - ended[0]) * 1e-9
            recovery_s = round(max(0.0, by_graph_s, (normal[1] - ended[1]) * speed), 3)
        return cls(
            kind=kind.name,
            bumps=observer.bumps,
            overconfident=observer.overconfident,
            worst_m=round(observer.worst_m, 4),
            recovery_s=recovery_s,
            report=next(
                (line for line in observer.lines if re.search(kind.report_pattern, line)), ''
            ),
            moment_s=began_ns * 1e-9,
            path_ended=observer.paths_ended > 0,
        )

    @property
    def measures_recovery(self) -> bool:
        """Whether the recovery time is that of the fault alone."""
        return not self.path_ended or self.kind in _ENDING

    def to_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class KindSummary:
    """The outcomes of one kind of fault.

    Attributes:
        kind: The kind.
        injected: Number of faults.
        bumps: Walls run into.
        overconfident: Faults with an overconfident state.
        worst_m: Largest error of a state with confidence OK.
        hangs: Faults that were not recovered from.
        recovery_p95_s: 95th percentile of the recovery time, s; NaN without any.
        recovery_median_s: Its median.
        reported: Faults that a log or `/diagnostics` reported.
    """

    kind: FaultKind
    injected: int
    bumps: int
    overconfident: int
    worst_m: float
    hangs: int
    recovery_p95_s: float
    recovery_median_s: float
    reported: int

    @classmethod
    def of(cls, kind: FaultKind, outcomes: Sequence[FaultOutcome]) -> 'KindSummary':
        """Summarise the outcomes of a kind; there is at least one."""
        times_s = recovery_times_s(outcomes) or [float('nan')]
        return cls(
            kind=kind,
            injected=len(outcomes),
            bumps=sum(one.bumps for one in outcomes),
            overconfident=sum(one.overconfident > 0 for one in outcomes),
            worst_m=max(one.worst_m for one in outcomes),
            hangs=sum(one.recovery_s is None for one in outcomes),
            recovery_p95_s=float(np.percentile(times_s, 95, method='inverted_cdf')),
            recovery_median_s=float(np.median(times_s)),
            reported=sum(bool(one.report) for one in outcomes),
        )


def summarise_kinds(outcomes: Iterable[FaultOutcome]) -> list[KindSummary]:
    """Return one summary for each kind that was injected, in the order of `KINDS`."""
    by_name: dict[str, list[FaultOutcome]] = {}
    for outcome in outcomes:
        by_name.setdefault(outcome.kind, []).append(outcome)
    return [KindSummary.of(kind, by_name[kind.name]) for kind in KINDS if kind.name in by_name]


def recovery_times_s(outcomes: Iterable[FaultOutcome]) -> list[float]:
    """Return the recovery times, s, that are those of the faults alone."""
    return [o.recovery_s for o in outcomes if o.recovery_s is not None and o.measures_recovery]


def outcome_table(summaries: Iterable[KindSummary]) -> str:
    """Return the table of docs/FAULTS.md."""
    cells = []
    for one in summaries:
        counts = (one.injected, one.bumps, one.overconfident, f'{one.worst_m:.3f}', one.hangs)
        recovery = f'{one.recovery_median_s:.2f} / {one.recovery_p95_s:.2f}'
        cells.append((one.kind.name, one.kind.expected, *counts, recovery, one.reported))
    return table(_HEADINGS, cells)
