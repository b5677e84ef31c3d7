"""Outcomes of faults and their table, by hand."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from goalreach_lab.cli import main
from goalreach_lab.faults.kinds import KINDS, choose_kinds
from goalreach_lab.faults.observer import StackObserver
from goalreach_lab.faults.outcome import FaultOutcome, outcome_table, summarise_kinds
from goalreach_lab.faults.suite import Options, plan
from goalreach_lab.study_file import StudyFile
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError

TICK_NS = 40_000_000


def outcome_of(
    *,
    ended: tuple[int, float],
    normal: tuple[int, float],
    speed: float = 1.0,
    lines: Sequence[str] = (),
) -> FaultOutcome:
    observer = StackObserver(Arena())
    observer.lines.extend(lines)
    return FaultOutcome.observed(
        KINDS[0], observer, began_ns=20 * TICK_NS, ended=ended, normal=normal, speed=speed
    )


def test_recovery_counts_from_the_end_of_the_fault() -> None:
    lines = ['nomad200: ready', 'nomad200: error: was ended by SIGKILL']
    one = outcome_of(ended=(20 * TICK_NS, 0.8), normal=(47 * TICK_NS, 1.88), lines=lines)
    assert one.recovery_s == pytest.approx(27 * 0.04)
    assert one.moment_s == pytest.approx(0.8)
    assert not one.path_ended
    assert one.report == lines[1]


def test_recovery_takes_as_long_by_the_wall_while_the_clock_of_the_graph_stands() -> None:
    ended, normal = (20 * TICK_NS, 10.0), (25 * TICK_NS, 11.5)
    assert outcome_of(ended=ended, normal=normal).recovery_s == pytest.approx(1.5)
    assert outcome_of(ended=ended, normal=normal, speed=2.0).recovery_s == pytest.approx(3.0)


def two_outcomes(kind: str) -> list[FaultOutcome]:
    """Return the outcomes of a fault without and with the end of a path in it."""
    return [
        FaultOutcome(
            kind=kind, bumps=0, overconfident=0, worst_m=0.01, recovery_s=taken_s, report='r',
            moment_s=1.0, path_ended=ended,
        )
        for taken_s, ended in ((1.0, False), (9.0, True))
    ]  # fmt: skip


@pytest.mark.parametrize(
    ('kind', 'p95_s'), [('/odom lost', 1.0), ('a bumper stuck', 9.0), ('clock stalled', 1.0)]
)
def test_the_search_after_a_path_is_no_recovery_unless_one_had_to_end(
    kind: str, p95_s: float
) -> None:
    (one,) = summarise_kinds(two_outcomes(kind))
    assert (one.injected, one.hangs, one.recovery_p95_s) == (2, 0, p95_s)


def test_the_table_counts_what_came_of_each_kind() -> None:
    kind = KINDS[0]
    good, _ = two_outcomes(kind.name)
    bad = replace(good, bumps=1, overconfident=3, worst_m=0.3, recovery_s=None, report='')
    (one,) = summarise_kinds([good, bad])
    assert (one.injected, one.bumps, one.overconfident, one.hangs, one.reported) == (2, 1, 1, 1, 1)
    assert f'| {kind.name} |' in outcome_table([one])


def test_there_are_enough_kinds_each_with_its_own_name() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS) >= 50


def test_kinds_are_chosen_by_a_word() -> None:
    assert [kind.name for kind in choose_kinds('camera frozen')] == ['camera frozen']
    assert choose_kinds('') == KINDS
    with pytest.raises(ConfigurationError, match='--kinds'):
        choose_kinds('earthquake')


def test_what_is_missing_is_planned_with_numbers_that_no_kept_outcome_has(tmp_path: Path) -> None:
    kinds = choose_kinds('/odom lost, clock stalled')
    file = StudyFile(tmp_path / 'faults.jsonl', key=('kind', 'number'), settings={'speed': 1.0})
    good, ended = two_outcomes('/odom lost')
    for number, outcome in ((0, good), (2, ended), (4, good)):  # of two jobs, one was interrupted
        file.add({'kind': outcome.kind, 'number': number}, outcome.to_json())
    planned = plan(Options(times=3), kinds, tmp_path)
    assert [number for number, _ in planned] == [5, 6, 7, 8]
    names = [kind.name for _, kind in planned]
    assert (names.count('/odom lost'), names.count('clock stalled')) == (1, 3)
    assert plan(Options(times=0), kinds, tmp_path) == []


def test_kept_outcomes_become_the_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = StudyFile(tmp_path / 'faults.jsonl', key=('kind', 'number'), settings={'speed': 1.0})
    for number, outcome in enumerate(two_outcomes('/odom lost')):
        file.add({'kind': outcome.kind, 'number': number}, outcome.to_json())
    stops = StudyFile(tmp_path / 'stops.jsonl', key=('number',), settings={'speed': 1.0})
    stops.add({'number': 0}, {'node': 'n', 'signal': 'SIGKILL', 'taken_s': 0.7})
    document = tmp_path / 'FAULTS.md'
    words = ['--results', str(tmp_path), '--out', str(document), '--note', 'A quiet machine.']
    assert main(['faults', '--as-it-is', *words]) == 1  # late at rest
    text = document.read_text()
    assert 'A quiet machine.' in text
    assert '| /odom lost |' in text
    assert '| 2 | 0 | 0 | 0.010 | 0 | 1.00 / 1.00 | 2 |' in text
    assert 'longest 0.70 s' in capsys.readouterr().out
