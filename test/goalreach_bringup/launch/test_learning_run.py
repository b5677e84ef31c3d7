"""Learning over the live graph: where it begins, goes on, and ends."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from goalreach_bringup.launch.learning_run import LearningRun
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import FileFormatError
import graphs

ARENA = Arena()


def test_a_new_file_begins_with_nothing_known(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    learning = LearningRun.begin(path, ARENA, trials=20)
    assert (learning.first_path, learning.trials, learning.total(22)) == (0, 20, 440)
    assert learning.remaining(0, 22) == 440
    assert not read_policy(path).visits.any()
    assert LearningRun.begin(path, ARENA, trials=20) is not None


def test_an_unfinished_file_goes_on_where_it_was_left(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    policy = train(ARENA, rng=np.random.default_rng(1)).policy
    write_policy(path, replace(policy, learning={**policy.learning, 'paths_driven': 430}))
    learning = LearningRun.begin(path, ARENA, trials=20)
    assert learning.first_path == 430
    assert learning.remaining(0, 22) == 10
    assert learning.remaining(4, 22) == 4
    assert learning.announcement(22) == 'continuing with path 431 of 440'
    assert np.array_equal(learning.policy.q, policy.q)


def test_a_policy_that_was_not_learned_so_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    policy = train(ARENA, rng=np.random.default_rng(1)).policy
    write_policy(path, policy)
    before = path.read_text()
    with pytest.raises(FileFormatError, match='paths_driven'):
        LearningRun.begin(path, ARENA, trials=20)
    assert path.read_text() == before


@pytest.mark.parametrize('driven', [True, -1, 4.0, 'many'])
def test_a_number_of_paths_that_is_none_is_refused(driven: object, tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    write_policy(path, replace(Policy.unlearned(ARENA.regions), learning={'paths_driven': driven}))
    with pytest.raises(FileFormatError, match=f'paths_driven = {driven!r}: must be the number'):
        LearningRun.begin(path, ARENA, trials=20)


@pytest.mark.parametrize(('driven', 'left'), [(0, 44), (43, 1), (44, 0), (50, 0)])
def test_what_was_driven_is_not_driven_again(driven: int, left: int, tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    write_policy(path, replace(Policy.unlearned(ARENA.regions), learning={'paths_driven': driven}))
    learning = LearningRun.begin(path, ARENA, trials=2)
    assert (learning.remaining(0, 22), learning.remaining(50, 22)) == (left, left)
    first = f'continuing with path {driven + 1} of 44' if driven else '2 trials of 22 paths'
    assert learning.announcement(22).endswith(first)
    verdict = f'{path}: after {driven} paths the best actions lead to the goal from 0 of 22 starts'
    assert LearningRun.verdict(path, ARENA) == verdict


def test_a_learner_that_is_not_there_or_another_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    with pytest.raises(FileFormatError, match=r'policy\.json: '):
        LearningRun.begin(path, ARENA, trials=2, learner='nobody')
    assert not path.exists()
    assert LearningRun.begin(path, ARENA, trials=2).learner == 'paper'


@pytest.mark.graph
def test_learning_over_the_graph_survives_the_end_of_a_run(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    arguments = ['run', '--learn', '--policy', str(path), '--clock', 'lockstep', '--composed']
    arguments += ['--start', '1.1,3.0,-90', '--start', '2.4,3.0,-90', '--paths', '2']
    for first_path in (0, 2):
        with graphs.goalreach(arguments, domain=graphs.fresh_domain(), home=tmp_path) as run:
            output, _ = run.communicate(timeout=100.0)
            assert run.returncode == 0, output
        policy = read_policy(path)
        assert policy.learning['paths_driven'] == first_path + 2
        assert int(policy.visits.sum()) >= first_path + 2
        assert f'after {first_path + 2} paths' in output
    assert 'continuing with path 3 of 40' in output
