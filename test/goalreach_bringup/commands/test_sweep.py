"""Which cases `sweep` makes, and what it prints of those that are done."""

from dataclasses import replace
import functools
import json
from pathlib import Path
from typing import Any

import pytest

from goalreach_bringup.cli import main
from goalreach_bringup.commands import sweep
from goalreach_evaluation.evaluation import processes
from goalreach_evaluation.sweep import dask_workers

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


def test_other_cases_of_the_file_are_not_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, rows = tmp_path / 'sweep.jsonl', [{**FUZZY, 'seed': k} for k in range(5)]
    rows.append({**FUZZY, 'arena': 'large', 'seed': 0})
    told(path, [{**row, 'outcomes': {'goal': 4}} for row in rows], '--drives 4')
    cells = [word for word in capsys.readouterr().out.split() if word[0].isdigit()]
    assert cells[-5:-2] == ['2', '8', '100.00']


def test_where_no_path_reached_the_goal_the_share_is_zero(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [{**FUZZY, 'seed': seed, 'outcomes': {'bump': 4}} for seed in range(2)]
    told(tmp_path / 'sweep.jsonl', rows, '--drives 4')
    cells = [word for word in capsys.readouterr().out.split() if word[0].isdigit()]
    assert cells[-5:-1] == ['2', '8', '0.00', '0.00']


def test_learners_are_compared_with_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = {'paper': ((10, True, 0), (30, True, 0)), 'planner': ((20, True, 1), (440, False, 0))}
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
    # Of four pairs of runs the planner needed fewer paths in one.
    assert lines[10].startswith('  probability of fewer paths than paper: 0.25 [')


def keys(path: Path, *fields: str) -> list[tuple[Any, ...]]:
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return [tuple(row[field] for field in fields) for row in rows]


def test_each_seed_of_each_room_is_driven_and_added(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'sweep.jsonl'
    options = '--drives 1 --seeds 2 --seed 5 --mode crisp --noise none'
    words = ['sweep', *options.split(), '--results', str(path)]
    assert main(words) == 0
    assert keys(path, 'arena', 'noise', 'mode', 'drives', 'seed') == [
        ('paper', 'none', 'crisp', 1, 5),
        ('paper', 'none', 'crisp', 1, 6),
    ]
    assert main(words) == 0
    told = capsys.readouterr().out
    assert told.startswith('0 of 2 cases are done\n')
    assert '\n2 of 2 cases are done\n' in told


def test_learners_without_images_have_one_noise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'sweep.jsonl'
    options = '--learners paper --no-images --seeds 1 --seed 3 --limit 2 --after 0'
    options += ' --arenas paper narrow --noise none harsh'
    words = ['sweep', *options.split(), '--results', str(path)]
    assert main(words) == 0
    assert keys(path, 'learner', 'arena', 'noise', 'limit', 'after', 'seed') == [
        ('paper', arena, 'without images', 2, 0, 3) for arena in ('paper', 'narrow')
    ]
    assert 'paper: 0 of 2 runs learned; 0 lost it later' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('changes', 'opens', 'arguments'),
    [
        ({}, processes, (2,)),
        ({'engine': 'dask'}, dask_workers, (2, None)),
        ({'scheduler': 'tcp://far'}, dask_workers, (2, 'tcp://far')),
    ],
)
def test_a_scheduler_needs_no_engine(
    changes: dict[str, Any], opens: object, arguments: tuple[object, ...]
) -> None:
    opener = sweep._executor(sweep.Options(results=Path('x'), jobs=2, **changes))
    assert isinstance(opener, functools.partial)
    assert (opener.func, opener.args) == (opens, arguments)


def test_noise_of_learners_with_images_is_each_that_is_named() -> None:
    options = sweep.Options(
        results=Path('x'), learners=('paper',), noise=('none', 'harsh'), seeds=1, arenas=('paper',)
    )
    cases = sweep._cases(options)
    assert [case.noise_name for case in cases] == ['none', 'harsh']
    assert all(case.noise is not None for case in cases)
    blind = sweep._cases(replace(options, no_images=True))
    assert [case.noise for case in blind] == [None]
    drives = sweep._cases(replace(options, learners=(), no_images=True))
    assert [case.noise_name for case in drives] == ['none', 'harsh']
