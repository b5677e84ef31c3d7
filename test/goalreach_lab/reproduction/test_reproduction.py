"""The evidence: its statistics by hand, its files, and a document from very few paths."""

import argparse
from pathlib import Path

import numpy as np
import pytest

from goalreach_lab.reproduction import tables
from goalreach_lab.reproduction.equation_3 import study_blends
from goalreach_lab.reproduction.intervals import difference_of_shares, mean_interval
from goalreach_lab.reproduction.results_file import ResultsFolder
from goalreach_lab.reproduction.study import DrivenPath, Study
from goalreach_lab.reproduction.suite import configure, execute
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError

ARENA = Arena()
POLICY = train(ARENA, rng=np.random.default_rng(1)).policy


def driven(outcome: str = 'goal', duration_s: float = 10.0) -> DrivenPath:
    return DrivenPath(
        outcome=outcome,
        duration_s=duration_s,
        length_m=3.0,
        turning_deg=90.0,
        step_deg=2.0,
        shortest_m=2.0,
        error_rms_m=0.0254,
    )


def test_intervals_by_hand() -> None:
    # mean 2, standard deviation 1, 1.96 / sqrt(3)
    assert mean_interval([1.0, 2.0, 3.0]) == pytest.approx((2.0, 1.13159), abs=1e-5)
    # Newcombe (1998), table II, row (a), method 10: 56/70 - 48/80
    expected = (0.2, 0.0524, 0.3339)
    assert difference_of_shares((56, 70), (48, 80)) == pytest.approx(expected, abs=1e-4)


def test_results_survive_a_line_that_was_cut_off(tmp_path: Path) -> None:
    results = ResultsFolder(tmp_path / 'new')
    results.add_session('study', 3, [driven(), driven('bump')])
    with (tmp_path / 'new' / 'study.jsonl').open('a') as file:
        file.write('{"session": 4, "pa\n')
    results.add_session('study', 5, [driven()])
    sessions = results.sessions('study')
    assert sessions == {3: [driven(), driven('bump')], 5: [driven()]}
    assert results.read('other') is None
    results.write('other', {'a': 1})
    assert results.read('other') == {'a': 1}


def test_more_paths_begin_with_the_same_ones() -> None:
    few, many = (Study(name='', arena=ARENA, policy=POLICY, paths=n).plan() for n in (10, 40))
    assert (len(few.starts), len(many.starts)) == (22, 44)
    assert many.starts[:22] == few.starts
    assert few.seed == many.seed


def test_printed_equation_goes_astray_and_products_do_not_jump() -> None:
    found = study_blends(ARENA, POLICY, 40, 0)
    assert found['fuzzy']['goal'] == 40
    assert found['fuzzy']['jump']['deg'] < 0.01
    assert found['fuzzy-eq3']['jump']['deg'] > 10.0
    assert found['astray']['worst_deg'] > 45.0


def test_tables_by_hand() -> None:
    assert tables.table(('a', 'b'), [(1, 2)]) == '| a | b |\n| --- | --- |\n| 1 | 2 |'
    paths = {('nominal', 'fuzzy', 'random'): [driven()] * 9 + [driven('bump')]}
    text = tables.outcome_table(paths)
    assert '| 10 | 90.00 % [59.58, 98.21] | 1 | 0 | 0 | 0.0254 m (1.00 in) |' in text
    line = tables.mode_table(paths).splitlines()[-1]
    assert line == '| fuzzy | 9 | 10 ± 0 | 90 ± 0 | 3 ± 0 | 1.5 ± 0 | 2.0 | 2.0 |'
    compared = tables.learned_table([driven()] * 4, [driven(duration_s=9.0)] * 4)
    assert '| time, s, mean | 10.000 | 9.000 | -1.000 [-1.000, -1.000] |' in compared


def options(folder: Path, **changed: int) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument('--seed', type=int, default=0)
    configure(parser)
    words = ['--results', str(folder), '--out', str(folder / 'REPRODUCTION.md')]
    for name, value in changed.items():
        words += [f'--{name.replace("_", "-")}', str(value)]
    return parser.parse_args(words)


def test_the_document_is_written_from_what_is_there(tmp_path: Path) -> None:
    few = dict.fromkeys(('fuzzy', 'harsh', 'others', 'others_harsh', 'arenas', 'policy_paths'), 1)
    asked = options(
        tmp_path,
        **few,
        seeds=5,
        variation_seeds=2,
        blend_starts=2,
        image_policies=1,
        image_trials=1,
    )
    results = ResultsFolder(tmp_path)
    _pretend(results)
    rows = {row.name: row for row in execute(asked)}
    assert rows['fuzzy, nominal noise, random starts: goal reached'].met is True
    text = (tmp_path / 'REPRODUCTION.md').read_text()
    for heading in ('## Equation (3)', '## Other arenas', '## Free parameters'):
        assert heading in text
    assert '| narrow | 22 | 100.00 %' in text
    assert max(map(len, text.split('\n\n')[1].splitlines())) < 100


def _pretend(results: ResultsFolder) -> None:
    """Fill in every session, so that nothing is driven."""
    from goalreach_lab.reproduction.plans import arena_studies, mode_studies
    from goalreach_learning.policy_file import write_policy

    policy = 'images-1-trials-seed-0'
    write_policy(results.policy_path(policy), POLICY)
    studies = mode_studies(0, fuzzy=1, harsh=1, others=1, others_harsh=1) + arena_studies(0, 1)
    names = [study.name for study in studies]
    for name in [*names, 'learned-without-seed-0', 'learned-images-1-seed-0']:
        results.add_session(name, 0, [driven()] * 22)


def test_refuses_no_paths(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match='--fuzzy = 0'):
        execute(options(tmp_path, fuzzy=0))
