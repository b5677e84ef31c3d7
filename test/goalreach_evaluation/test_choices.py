"""The arenas that come with the project, and the policies that fit them."""

import json
from pathlib import Path

import numpy as np
import pytest

from goalreach_bringup.cli import main
from goalreach_evaluation.choices import ARENAS, arena_names, choose_arena, choose_policy
from goalreach_evaluation.evaluation import EvaluationPlan, drive_sessions
from goalreach_evaluation.starts import random_starts
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.policy_file import write_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.noise import noise_preset

EXAMPLES = ('large', 'narrow', 'side_goal')


def test_the_paper_s_arena_is_the_default_one() -> None:
    assert choose_arena('paper') == Arena()
    assert arena_names() == sorted([*EXAMPLES, 'paper'])


def test_the_examples_differ_as_they_say() -> None:
    paper, (large, narrow, side_goal) = Arena(), map(choose_arena, EXAMPLES)
    assert large.width_m * large.length_m > 2 * paper.width_m * paper.length_m
    assert narrow.width_m < 0.7 * paper.width_m
    assert side_goal.regions.goal != paper.regions.goal
    assert [arena.name for arena in (large, narrow, side_goal)] == list(EXAMPLES)


@pytest.mark.parametrize('name', EXAMPLES)
def test_every_example_is_learned_and_driven(name: str) -> None:
    arena = choose_arena(name)
    policy = choose_policy(None, arena, 1)
    assert all(greedy_successes(arena, policy))
    plan = EvaluationPlan(
        arena=arena,
        noise=noise_preset('nominal'),
        policy=policy,
        controller=ControllerConfig(),
        starts=random_starts(arena, 4, np.random.default_rng(5)),
        seed=5,
    )
    (session,) = drive_sessions(plan)
    assert [path.outcome for path in session.paths] == ['goal'] * 4


def test_an_arena_may_be_a_file(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text((ARENAS / 'narrow.yaml').read_text().replace('name: narrow', 'name: mine'))
    assert choose_arena(str(path)).name == 'mine'


def test_neither_a_name_nor_a_file() -> None:
    with pytest.raises(FileFormatError, match='moon: is no file and none of large, narrow'):
        choose_arena('moon')


@pytest.mark.parametrize(
    ('name', 'said'), [('narrow', 'regions.x_knots_m'), ('side_goal', 'regions.goal = FRONT/NEAR')]
)
def test_a_policy_of_another_arena_is_refused(tmp_path: Path, name: str, said: str) -> None:
    path = tmp_path / 'policy.json'
    write_policy(path, choose_policy(None, Arena(), 1))
    assert choose_policy(path, Arena(), 1).regions == Arena().regions
    with pytest.raises(FileFormatError, match=r'policy\.json') as caught:
        choose_policy(path, choose_arena(name), 1)
    assert said in str(caught.value)
    assert name in str(caught.value)


def test_train_and_evaluate_in_another_arena(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    policy = str(tmp_path / 'policy.json')
    assert main(['train', '--arena', 'narrow', '--out', policy]) == 0
    options = ['--policy', policy, '--starts', 'random:1']
    assert main(['evaluate', '--arena', 'narrow', *options]) == 0
    assert main(['evaluate', *options]) == 2
    assert 'the arena paper has' in capsys.readouterr().err


def test_the_policy_of_the_project_is_chosen_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    options = ['--starts', 'random:2', '--quiet', '--json', 'r.json']
    assert main(['evaluate', '--policy', 'paper', *options]) == 0
    assert json.loads(Path('r.json').read_text())['policy'] == 'paper'
    assert main(['figures', '--policy', 'paper', '--format', 'png']) == 0
    assert main(['evaluate', '--policy', './paper', *options]) == 2
    assert main(['run', '--policy', 'paper', '--arena', 'narrow', '--paths', '1']) == 2
    wrong = capsys.readouterr().err.splitlines()
    assert 'paper: cannot be read' in wrong[-2]
    assert 'the arena narrow has' in wrong[-1]
