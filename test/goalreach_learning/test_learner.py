"""Learners by name: found, refused in one line, and continued."""

from collections.abc import Mapping
from dataclasses import replace
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import LEARNERS, Agent, Experience, LearnerSetup, Situation
from goalreach_learning.learners.tabular import PaperLearner
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.regions import RegionMap

HERE = Situation(region=(0, 0), x_m=0.5, y_m=0.5)


def agent_of(name: str, policy: Policy | None = None) -> Agent:
    return Agent(name, RegionMap(), LearningConfig(), np.random.default_rng(0), policy)


class UpdatingLearner(PaperLearner):
    """Updates through `update`, as any learner that is not the paper's."""

    def update(self, experience: Experience) -> None:
        super().update(experience)


class WrongLearner(PaperLearner):
    """Chooses what is no action, and has a table of another size."""

    def choose(self, situation: Situation) -> int:
        return 8 + situation.path

    def policy(self) -> tuple[Any, Any]:
        return np.zeros((2, 3, 8)), np.zeros((2, 3, 8), dtype=np.int64)


class FailingLearner:
    """Has no methods."""

    def __init__(self, setup: LearnerSetup) -> None:
        self.shape = setup.shape


class RaisingLearner:
    """Cannot be made."""

    def __init__(self, setup: LearnerSetup) -> None:
        raise OSError(f'no such table: {setup.shape}')


@pytest.mark.parametrize('name', LEARNERS)
def test_every_learner_of_the_project_learns_and_continues(name: str, tmp_path: Path) -> None:
    arena, config, rng = Arena(), LearningConfig(trials=6), np.random.default_rng(3)
    agent = Agent(name, arena.regions, config, rng)
    first = train(arena, config, rng=rng, agent=agent).policy
    path = tmp_path / 'policy.json'
    write_policy(path, first)
    read = read_policy(path)
    agent = Agent(name, arena.regions, config, rng, read)
    assert np.array_equal(agent.policy.q, first.q)
    assert json.loads(json.dumps(agent.policy.learner)) == read.learner
    assert sum(greedy_successes(arena, train(arena, config, rng=rng, agent=agent).policy)) >= 20


def test_the_quick_way_of_the_paper_gives_the_same_numbers() -> None:
    arena, config, rng = Arena(), LearningConfig(), np.random.default_rng(7)
    quick = train(arena, rng=np.random.default_rng(7))
    agent = Agent(f'{__name__}:UpdatingLearner', arena.regions, config, rng)
    usual = train(arena, rng=rng, agent=agent)
    assert np.array_equal(quick.policy.q, usual.policy.q)
    assert np.array_equal(quick.policy.visits, usual.policy.visits)
    assert quick.success_by_trial == usual.success_by_trial
    assert quick.length_m == usual.length_m


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('plan', 'must be one of paper, planner, q-lambda, dyna-q'),
        ('no_such_module:Learner', "No module named 'no_such_module'"),
        (f'{__name__}:NoSuchClass', "has no attribute 'NoSuchClass'"),
        (f'{__name__}:FailingLearner', r'choose\(\) is missing'),
        (f'{__name__}:RaisingLearner', 'no such table'),
    ],
)
def test_a_wrong_learner_is_refused_in_one_line(name: str, reason: str) -> None:
    with pytest.raises(GoalreachError, match=reason) as caught:
        agent_of(name)
    assert name in str(caught.value)
    assert '\n' not in str(caught.value)


def test_what_is_no_action_or_no_table_is_refused() -> None:
    agent = agent_of(f'{__name__}:WrongLearner')
    with pytest.raises(GoalreachError, match=r'choose\(\) = 8: must be an index in 0..7'):
        agent.choose(HERE)
    with pytest.raises(GoalreachError, match='q = '):
        _ = agent.policy


def test_an_installed_package_offers_a_learner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'visiting.py').write_text(
        'from goalreach_learning.learners.tabular import PaperLearner as Visitor\n'
    )
    metadata = tmp_path / 'visiting-1.0.dist-info'
    metadata.mkdir()
    (metadata / 'METADATA').write_text('Metadata-Version: 2.1\nName: visiting\nVersion: 1.0\n')
    (metadata / 'entry_points.txt').write_text('[goalreach.learners]\nguest = visiting:Visitor\n')
    monkeypatch.syspath_prepend(str(tmp_path))
    assert isinstance(agent_of('guest').learner, PaperLearner)


def test_a_policy_continues_with_its_own_learner_only() -> None:
    policy = train(Arena(), LearningConfig(trials=1), rng=np.random.default_rng(0)).policy
    with pytest.raises(GoalreachError, match='must be paper, which'):
        agent_of('planner', policy)
    assert agent_of('planner', Policy.unlearned(RegionMap())).policy.learner['name'] == 'planner'


@pytest.mark.parametrize('state', [{}, {'spans_m': 3, 'walls': [], 'entered': []}])
def test_a_damaged_state_is_refused(state: Mapping[str, Any]) -> None:
    policy = Policy.unlearned(RegionMap())
    damaged = replace(policy, learner={'name': 'planner', 'state': state})
    with pytest.raises(GoalreachError, match=r'learner\.state = '):
        agent_of('planner', damaged)


class BareLearner(PaperLearner):
    """Returns its own table, and keeps what JSON cannot hold."""

    def policy(self) -> tuple[Any, Any]:
        return self.q, self.visits

    def save(self) -> dict[str, Any]:
        return {'last': np.float32(1.0)}


def test_a_learner_may_return_its_own_table(tmp_path: Path) -> None:
    name = f'{__name__}:BareLearner'
    agent, config = agent_of(name), LearningConfig(trials=2)
    result = train(
        Arena(), config, rng=np.random.default_rng(0), agent=agent, on_trial=lambda *_: None
    )
    assert result.policy.visits.any()
    with pytest.raises(GoalreachError, match=r'p\.json: what the learner saves: .*float32'):
        write_policy(tmp_path / 'p.json', agent.policy)
    assert not list(tmp_path.iterdir())
