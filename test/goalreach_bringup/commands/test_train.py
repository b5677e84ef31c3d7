import json
from pathlib import Path

import pytest

from goalreach_bringup.cli import main
from goalreach_learning.policy_file import find_policy, policy_names, read_policy


def test_writes_a_policy_that_reaches_the_goal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, report = tmp_path / 'p.json', tmp_path / 'r.json'
    assert main(['train', '--seed', '5', '--out', str(out), '--json', str(report)]) == 0
    policy = read_policy(out)
    assert policy.learning['seed'] == 5
    assert policy.learning['trials'] == 20
    told = json.loads(report.read_text())
    assert told['trials'] == 20
    assert len(told['success_by_trial']) == 20
    assert told['greedy_success'] == [True] * 22
    assert told['seconds'] > 0
    text = capsys.readouterr().out
    assert '440 paths' in text
    shares = [line.split() for line in text.splitlines() if ' %' in line]
    assert [int(words[0]) for words in shares] == [*range(1, 21)]
    assert shares[-1][1:] == ['100.0', '%', '#' * 22]
    assert 'the best actions lead to the goal from 22 of 22 starts' in text
    assert text.splitlines()[-1] == f'policy written to {out}'


def test_shows_the_headings_with_the_goal_wall_below(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(['train', '--out', str(tmp_path / 'p.json')])
    lines = capsys.readouterr().out.splitlines()
    near = next(line.split() for line in lines if line.strip().startswith('NEAR'))
    assert near == ['NEAR', '0', 'goal', '180']
    medium = next(line.split() for line in lines if line.strip().startswith('MEDIUM'))
    assert medium[2] == '270'


def test_same_seed_same_file(tmp_path: Path) -> None:
    for name in ('a', 'b'):
        main(['train', '--seed', '2', '--out', str(tmp_path / name)])
    assert (tmp_path / 'a').read_bytes() == (tmp_path / 'b').read_bytes()


def test_the_policy_of_the_project_is_made_by_the_command(tmp_path: Path) -> None:
    assert policy_names() == ['paper']
    assert main(['train', '--seed', '7', '--out', str(tmp_path / 'p.json'), '--quiet']) == 0
    assert find_policy('paper').read_bytes() == (tmp_path / 'p.json').read_bytes()


@pytest.mark.parametrize(
    ('arguments', 'line'),
    [
        (['--trials', '0'], 'trials = 0: must be a whole number in [1, 100000]'),
        (['--seed', '-1'], '--seed = -1: must be a whole number >= 0'),
        (
            ['--out', 'nowhere/p.json'],
            'nowhere/p.json: cannot be written: nowhere is no directory',
        ),
    ],
)
def test_a_mistake_is_one_line(
    arguments: list[str],
    line: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(['train', *arguments]) == 2
    error = capsys.readouterr().err
    assert line in error
    assert error.count('\n') == 1
    assert list(tmp_path.iterdir()) == []
