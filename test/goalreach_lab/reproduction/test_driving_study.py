import numpy as np
import pytest

from goalreach_lab.reproduction.driving_study import (
    Condition,
    distance_to_goal,
    driving_study,
    image_learning_study,
    policy_conditions,
)
from goalreach_lab.study import find
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import Pose2

ARENA = Arena()
POLICY = train(ARENA, rng=np.random.default_rng(1)).policy


def condition(paths: int, name: str = 'a') -> Condition:
    return Condition(
        name=name,
        arena=ARENA,
        policy=POLICY,
        noise=noise_preset('none'),
        paths=paths,
        seed=0,
    )


def test_distance_to_goal_by_hand() -> None:
    regions = ARENA.regions  # the goal is x 1.1811 ... 2.3749, y 0 ... 1.6891

    def from_point(x_m: float, y_m: float) -> float:
        return distance_to_goal(Pose2(x_m=x_m, y_m=y_m, heading_rad=0.0), regions)

    assert from_point(0.1811, 1.0) == pytest.approx(1.0)
    assert from_point(2.0, 3.6891) == pytest.approx(2.0)
    assert from_point(2.3749 + 0.3, 1.6891 + 0.4) == pytest.approx(0.5)
    assert from_point(1.5, 1.0) == 0.0


def test_more_paths_begin_with_the_same_ones() -> None:
    few, many = (condition(paths).plan() for paths in (10, 40))
    assert (len(few.starts), len(many.starts)) == (10, 40)
    assert many.starts[:10] == few.starts
    assert few.seed == many.seed


def test_every_condition_is_driven_in_sessions_the_first_of_each_first() -> None:
    conditions = [condition(23, 'a'), condition(30, 'b')]
    study = driving_study(conditions, name='driving', seed=0, jobs=1)
    assert [(c['condition'], c['session'], c['paths']) for c in study.cases] == [
        ('a', 0, 22),
        ('b', 0, 22),
        ('a', 1, 1),
        ('b', 1, 8),
    ]


def test_findings_are_the_paths_by_condition() -> None:
    conditions = [condition(2, 'a'), condition(1, 'b')]
    found = find(driving_study(conditions, name='driving', seed=0, jobs=1))
    assert [path.outcome for path in found['a']] == ['goal', 'goal']
    assert found['b'] == found['a'][:1]


def test_a_policy_learned_with_images_drives_from_the_same_starts() -> None:
    study = image_learning_study(count=1, trials=1, seed=4, jobs=1)
    policies = find(study)
    assert policies[4].visits.sum() > 22
    without, images = policy_conditions(policies, 3)
    assert images.policy is policies[4]
    assert without.plan().starts == images.plan().starts
