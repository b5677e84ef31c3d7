"""The table of faults: what was done, what should come of it, what came."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math
import statistics
import textwrap

from goalreach_lab.faults.judge import Verdict
from goalreach_lab.faults.kinds import KINDS, FaultKind

_ENDING = {kind.name for kind in KINDS if kind.ends_paths}
_WIDTH = 99
_HEAD = """# Faults, and what comes of them

Each fault was injected into a live stack of four processes at a random moment and place of
driving, over real DDS on loopback. A gate before every input of every node makes messages late,
lost, doubled and so on; processes are killed and stopped by signals; what happens to robot, camera
and lights is switched by the parameters `faults.*` of `nomad200`.

Measured by `{command}`.
{note}
* **bumps**: walls run into, from the beginning of the fault until sound driving.
* **wrong**: faults in which a state with level OK was more than 6 in off the truth.
* **worst**: the largest error of a state with level OK, metres.
* **hangs**: faults after which the robot did not drive again within 25 s.
* **recovery**: seconds from the fault's end (a kill has ended when it is done) to sound driving: a
  good pose, fresh commands and motion for 0.4 s. Of the graph's clock or of the wall's, whichever
  is more. Median and 95th percentile.
* **named**: faults that a log or `/diagnostics` reported by name.

Faults begin at least 1.5 m before the goal region; between two of them the robot is put back. No
node is killed twice in a minute: for one that keeps dying, the wait before the next start grows.
Where a path ended all the same before the robot had recovered, the time would hold the way to the
next start and the search for LEDs there: such a fault counts in every column but the recovery, and
another one is injected (but for a stuck bumper and a full disk, in which a path always ends).

| fault | what should come | n | bumps | wrong | worst | hangs | recovery | named |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |"""


@dataclass(frozen=True, kw_only=True)
class KindSummary:
    """What came of one kind of fault.

    Attributes:
        kind: The kind.
        injected: How often it was injected.
        bumps: Walls run into.
        wrong: Faults during which a wrong pose was believed good.
        worst_m: Largest error of a pose believed good.
        hangs: Faults that were not recovered from.
        recovery_p95_s: 95th percentile of the time to recover, s; NaN without any.
        recovery_median_s: Its median.
        named: Faults that were reported by name.
    """

    kind: FaultKind
    injected: int
    bumps: int
    wrong: int
    worst_m: float
    hangs: int
    recovery_p95_s: float
    recovery_median_s: float
    named: int


def summarise_kinds(verdicts: Iterable[Verdict]) -> list[KindSummary]:
    """Return one summary for each kind that was injected, in the usual order."""
    by_name: dict[str, list[Verdict]] = {}
    for verdict in verdicts:
        by_name.setdefault(verdict.kind, []).append(verdict)
    return [_summary(kind, by_name[kind.name]) for kind in KINDS if kind.name in by_name]


def recovery_times(verdicts: Iterable[Verdict]) -> list[float]:
    """Return the times to recover, s, of those whose time tells of the fault alone."""
    return [v.recovery_s for v in verdicts if v.recovery_s is not None and tells_of_recovery(v)]


def tells_of_recovery(verdict: Verdict) -> bool:
    """Return whether no path ended meanwhile, or one had to."""
    return not verdict.path_ended or verdict.kind in _ENDING


def _summary(kind: FaultKind, verdicts: Sequence[Verdict]) -> KindSummary:
    times_s = sorted(recovery_times(verdicts))
    rank = max(0, math.ceil(0.95 * len(times_s)) - 1)
    return KindSummary(
        kind=kind,
        injected=len(verdicts),
        bumps=sum(v.bumps for v in verdicts),
        wrong=sum(v.wrong > 0 for v in verdicts),
        worst_m=max(v.worst_m for v in verdicts),
        hangs=sum(v.recovery_s is None for v in verdicts),
        recovery_p95_s=times_s[rank] if times_s else math.nan,
        recovery_median_s=statistics.median(times_s) if times_s else math.nan,
        named=sum(bool(v.report) for v in verdicts),
    )


def fault_document(summaries: Sequence[KindSummary], command: str, note: str = '') -> str:
    """Return docs/FAULTS.md.

    Args:
        summaries: What came of each kind.
        command: The command that measured it.
        note: A sentence about the machine, or empty.
    """
    wrapped = '\n'.join(['', *textwrap.wrap(note, _WIDTH), '']) if note else ''
    lines = [_HEAD.format(command=command, note=wrapped)]
    for one in summaries:
        recovery = f'{one.recovery_median_s:.2f} / {one.recovery_p95_s:.2f}'
        lines.append(
            f'| {one.kind.name} | {one.kind.expected} | {one.injected} | {one.bumps} '
            f'| {one.wrong} | {one.worst_m:.3f} | {one.hangs} | {recovery} | {one.named} |'
        )
    return '\n'.join([*lines, ''])
