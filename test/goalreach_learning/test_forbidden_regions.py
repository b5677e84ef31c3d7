"""A forbidden region: where it is given, and that learning and driving keep out of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from goalreach_evaluation.choices import choose_arena, choose_policy
from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
from goalreach_learning.kinematic_drive import crisp_track, greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.values import PathOutcome

TASK: Mapping[str, Any] = {
    'labels': {'x': ['west', 'centre', 'east'], 'y': ['door', 'table', 'window']},
    'goal': 'centre/door',
    'forbidden': ['centre/table'],
    'rewards': {'goal': 10, 'bump': -0.5},
}


def room(folder: Path, **changes: object) -> Path:
    document = {
        'name': 'room',
        'width_m': 3.6,
        'length_m': 5.1,
        'leds_m': [[0.9, 0.0, 1.4], [1.8, 0.5, 1.8], [2.7, 0.0, 1.6]],
        'regions': {
            'x_borders_m': [1.2, 2.4],
            'y_borders_m': [1.7, 3.4],
            'transition_width_m': 0.4,
            **TASK,
            **changes,
        },
        'starts': {'border': 22},
    }
    path = folder / 'room.yaml'
    path.write_text(yaml.safe_dump(document))
    return path


@pytest.fixture
def arena(tmp_path: Path) -> Arena:
    return read_arena(room(tmp_path))


def test_a_file_gives_labels_forbidden_regions_and_rewards(arena: Arena) -> None:
    regions = arena.regions
    assert (regions.goal, regions.forbidden) == ((1, 0), ((1, 1),))
    assert regions.name((2, 1)) == 'east/table'
    assert regions.rewards.of(PathOutcome.GOAL) == 10.0
    assert regions.rewards.of(PathOutcome.BUMP) == -0.5
    assert regions.ends == {(1, 0): PathOutcome.GOAL, (1, 1): PathOutcome.FORBIDDEN}


@pytest.mark.parametrize(
    ('name', 'value', 'line'),
    [
        ('forbidden', ['centre/door'], 'regions.forbidden = '),
        ('forbidden', ['centre/cellar'], "regions.forbidden = 'centre/cellar'"),
        ('forbidden', 'centre/table', 'regions.forbidden = '),
        ('labels', {'x': ['a', 'a', 'b'], 'y': ['d', 'e', 'f']}, 'regions.labels = '),
        ('labels', {'x': ['a', 'b']}, 'regions.labels.y is missing'),
        ('labels', {'x': ['a', 'b', 'c,d'], 'y': ['d', 'e', 'f']}, 'regions.labels = '),
        ('rewards', {'goal': -1}, r'regions.rewards.goal = -1'),
        ('rewards', {'sofa': 1}, 'regions.rewards = '),
    ],
)
def test_a_bad_task_is_refused_by_name(
    tmp_path: Path, name: str, value: object, line: str
) -> None:
    changes: dict[str, object] = {name: value}
    if name == 'labels':
        changes |= {'goal': 'b/d', 'forbidden': []}
    with pytest.raises(FileFormatError, match=line):
        read_arena(room(tmp_path, **changes))


def test_parameters_carry_regions_and_labels(arena: Arena) -> None:
    carried = RegionConfig.for_map(arena.regions)
    assert (carried.forbidden_regions, carried.goal_region) == ('FRONT/MEDIUM', 'FRONT/NEAR')
    assert carried.labels == 'west,centre,east/door,table,window'
    assert carried.region_map.own_labels == arena.regions.own_labels
    assert carried.region_map.forbidden == arena.regions.forbidden


@pytest.mark.parametrize('learner', ['paper', 'planner', 'dyna-q'])
def test_learners_keep_out_of_it_and_are_paid_by_the_file(arena: Arena, learner: str) -> None:
    config, rng = (
        LearningConfig(temperature_start=5.0, temperature_end=0.1),
        np.random.default_rng(5),
    )
    agent = Agent(learner, arena.regions, config, rng)
    policy = train(arena, config, rng=rng, agent=agent).policy
    assert all(greedy_successes(arena, policy))
    for start in arena.starts:
        for x_m, y_m in crisp_track(arena, policy, start).points_m[:-1]:
            assert arena.regions.region_at(x_m, y_m) != (1, 1)
    assert 5.0 < policy.q.max() <= 10.0


def test_a_robot_that_enters_it_ends_its_path(arena: Arena) -> None:
    policy = train(Arena(), rng=np.random.default_rng(0)).policy
    through = type(policy)(q=policy.q, visits=policy.visits, regions=arena.regions)
    above = next(s for s in arena.starts if arena.regions.region_at(s.x_m, s.y_m) == (1, 2))
    assert crisp_track(arena, through, above).outcome is PathOutcome.FORBIDDEN
    found = evaluate(EvaluationRequest(policy=through, arena=arena, starts=[above], mode='crisp'))
    assert [path.outcome for path in found.paths] == ['forbidden']


def test_a_policy_keeps_its_task_and_fits_no_other(arena: Arena, tmp_path: Path) -> None:
    policy = train(arena, rng=np.random.default_rng(1)).policy
    path = tmp_path / 'policy.json'
    write_policy(path, policy)
    again = read_policy(path).regions
    assert (again.forbidden, again.rewards) == (policy.regions.forbidden, policy.regions.rewards)
    assert choose_policy(path, arena).regions.forbidden == ((1, 1),)
    with pytest.raises(FileFormatError, match=r'regions\.'):
        choose_policy(path, choose_arena('paper'))
