"""docs/PERFORMANCE.md, written from rows that meet their goals and rows that do not."""

from pathlib import Path

from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed.driving import profile_driving
from goalreach_lab.speed.measurement import Budget
from goalreach_lab.speed.suite import write_performance

BUDGET = Budget(seed=3, scale=0.02)


def row(ours: float) -> BenchRow:
    goal = Goal(of='ratio', relation='<=', bound=1.6)
    return BenchRow(
        name='tick', unit='ms', ours=ours, reference=2.0, reference_name='relay', goal=goal
    )


def test_missed_goals_are_listed_and_groups_that_were_not_measured_left_out(
    tmp_path: Path,
) -> None:
    path = tmp_path / 'P.md'
    write_performance(path, {'lockstep': [row(3.0), row(4.0)]}, BUDGET)
    text = path.read_text()
    assert '1 of 2 goals are met. Missed:\n\n* tick: 4 ms, ratio 2, goal ratio <= 1.6' in text
    assert '| tick | 3 ms | 2 (relay) | 1.5 | ratio <= 1.6 | yes | 1 |' in text
    assert '--seed 3 --scale 0.02' in text
    assert '## A tick in lockstep' in text
    assert '## How to add a row' in text
    assert '## Recording' not in text
    assert '$' not in text


def test_without_a_missed_goal_none_is_listed(tmp_path: Path) -> None:
    path = tmp_path / 'P.md'
    write_performance(path, {'lockstep': [row(2.0)]}, BUDGET)
    text = path.read_text()
    assert '1 of 1 goals are met.\n' in text
    assert 'Missed' not in text


def test_driving_is_profiled(tmp_path: Path) -> None:
    path = tmp_path / 'P.md'
    write_performance(path, {'driving': [row(2.0)]}, BUDGET)
    assert 'goalreach_perception.' in path.read_text()


def test_a_profile_names_our_modules_and_adds_up() -> None:
    shares = profile_driving(1, paths=1, most=3)
    assert len(shares) == 4
    assert sum(share.percent for share in shares) == 100.0
    assert all(share.module.startswith('goalreach_') for share in shares[:-1])
    assert shares[0].percent >= shares[1].percent >= shares[2].percent > 0.0
