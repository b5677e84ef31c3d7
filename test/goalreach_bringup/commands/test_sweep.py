"""What `sweep` prints of cases that are all done."""

import json
from pathlib import Path
from typing import Any

import pytest

from goalreach_bringup.cli import main

FUZZY = {'arena': 'paper', 'noise': 'nominal', 'mode': 'fuzzy', 'drives': 4}
LEARNED = {'arena': 'paper', 'noise': 'without images', 'limit': 440, 'after': 22, 'time_s': 0.0}


def told(path: Path, rows: list[dict[str, Any]], words: str) -> None:
    path.write_text(''.join(f'{json.dumps(row)}\n' for row in rows))
    assert main(['sweep', '--results', str(path), '--seeds', '2', *words.split()]) == 0


def test_shares_have_their_interval(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outcomes = ({'goal': 3, 'bump': 1}, {'goal': 4})
    rows = [{**FUZZY, 'seed': seed, 'outcomes': one} for seed, one in enumerate(outcomes)]
    told(tmp_path / 'sweep.jsonl', rows, '--drives 4')
    cells = [word for word in capsys.readouterr().out.split() if word[0].isdigit()]
    assert cells[-5:] == ['2', '8', '87.50', '52.91', '97.76']  # Wilson's interval of 7 of 8


def test_learners_are_compared_with_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = {'paper': ((10, True, 0), (30, True, 0)), 'planner': ((4, True, 1), (440, False, 0))}
    rows = [
        {
            **LEARNED, 'learner': learner, 'seed': seed, 'learned': learned, 'lost': lost,
            'paths': paths, 'bumps': 2 * paths, 'length_m': 3.0 * paths,
        }
        for learner, all_runs in runs.items()
        for seed, (paths, learned, lost) in enumerate(all_runs)
    ]  # fmt: skip
    told(tmp_path / 'sweep.jsonl', rows, '--learners paper planner --no-images')
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == 'paper: 2 of 2 runs learned; 0 lost it later'
    assert lines[2].endswith('percentile: 20 / 29 paths, 40 / 58 bumps, 60 / 87 m')
    shares = '0 % in 5, 50 % in 10, 50 % in 15, 50 % in 20, 100 % in 40, 100 % in 80, 100 % in 160'
    assert f': {shares}, ' in lines[3]
    assert lines[4] == '  paths, interquartile mean: 20.00 [10.00, 30.00]'
    assert lines[6] == 'planner: 1 of 2 runs learned; 1 lost it later'
    # Of four pairs of runs the planner needed fewer paths in two.
    assert lines[10].startswith('  probability of fewer paths than paper: 0.50 [')
