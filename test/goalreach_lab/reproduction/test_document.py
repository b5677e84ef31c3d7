from dataclasses import replace

import pytest

from goalreach_lab.reproduction.document import (
    difference_of_shares,
    driving_values,
    from_same_starts,
    learned_table,
    mean_interval,
    mode_table,
    outcome_table,
)
from goalreach_lab.reproduction.driving_study import DrivenPath


def driven(
    outcome: str = 'goal', duration_s: float = 10.0, *, number: int = 0, step_deg: float = 2.0
) -> DrivenPath:
    return DrivenPath(
        number=number,
        outcome=outcome,
        duration_s=duration_s,
        length_m=3.0,
        turning_deg=90.0,
        step_deg=step_deg,
        shortest_m=2.0,
        error_rms_m=0.0254,
    )


def test_intervals_by_hand() -> None:
    # mean 2, standard deviation 1, 1.96 / sqrt(3)
    assert mean_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0, 1.13159), abs=1e-5)
    # Newcombe (1998), table II, row (a), method 10: 56/70 - 48/80
    expected = (0.2, 0.0524, 0.3339)
    assert difference_of_shares((56, 70), (48, 80)) == pytest.approx(expected, abs=1e-4)


def test_tables_by_hand() -> None:
    paths = {('nominal', 'fuzzy', 'random'): [driven()] * 9 + [driven('bump')]}
    text = outcome_table(paths)
    assert '| 10 | 90.00 % [59.58, 98.21] | 1 | 0 | 0 | 0.0254 m (1.00 in) |' in text
    lost = {
        ('nominal', 'fuzzy', 'random'): [driven(), replace(driven('timeout'), error_rms_m=None)]
    }
    assert '0.0254 m (1.00 in)' in outcome_table(lost)
    line = mode_table(paths).splitlines()[-1]
    assert line == '| fuzzy | 9 | 10 ± 0 | 90 ± 0 | 3 ± 0 | 1.5 ± 0 | 2.0 | 2.0 |'
    compared = learned_table([driven()] * 4, [driven(duration_s=9.0)] * 4)
    assert '| time, s, mean | 10.000 | 9.000 | -1.000 [-1.000, -1.000] |' in compared
    values = driving_values(paths)
    assert values['nominal'] == '90.00 % [59.58, 98.21] of 10 paths'
    assert values['harsh'] == 'not measured of 0 paths'


def test_modes_are_compared_on_the_starts_that_all_have_driven() -> None:
    first = [driven(number=number, duration_s=10.0 + number) for number in range(4)]
    second = [path for path in first if path.number != 1]
    assert [[path.number for path in some] for some in from_same_starts([first, second])] == [
        [0, 2, 3],
        [0, 2, 3],
    ]
    text = mode_table(
        {('nominal', 'fuzzy', 'random'): first, ('nominal', 'crisp', 'random'): second}
    )
    fuzzy, crisp = (line.split('|')[2:] for line in text.splitlines()[2:])
    assert fuzzy == crisp


def test_heading_steps_are_those_of_the_paths_to_the_goal() -> None:
    paths = [driven(), driven('timeout', number=1, step_deg=164.4)]
    line = mode_table({('nominal', 'fuzzy', 'random'): paths}).splitlines()[-1]
    assert line.endswith('| 2.0 | 2.0 |')
