"""What learners need until the policy leads to the goal from every start."""

import pytest

from goalreach_evaluation.sweep import CurveCase, learn_case
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel, noise_preset


def case(
    learner: str, seed: int, noise: NoiseModel | None = None, limit: int = 200, after: int = 5
) -> CurveCase:
    return CurveCase(
        learner=learner, arena_name='paper', arena=Arena(), noise_name='some', noise=noise,
        limit=limit, after=after, seed=seed,
    )  # fmt: skip


@pytest.mark.parametrize('seed', range(3))
def test_the_planner_needs_few_paths_and_bumps_with_images(seed: int) -> None:
    found = learn_case(case('planner', seed, noise_preset('nominal')))
    assert found['learned']
    assert found['paths'] <= 40
    assert found['bumps'] <= 5
    assert found['lost'] == 0
    assert found['time_s'] > 10.0


def test_the_planner_needs_fewer_than_the_paper() -> None:
    planner, paper = (learn_case(case(name, 1)) for name in ('planner', 'paper'))
    assert planner['learned']
    assert paper['learned']
    assert planner['paths'] < paper['paths']
    assert planner['bumps'] < paper['bumps']
    assert planner['time_s'] == 0.0


def test_a_case_is_repeatable_and_ends_at_its_limit() -> None:
    first, second = (learn_case(case('paper', 2, limit=4)) for _ in range(2))
    assert first == second
    assert (first['learned'], first['paths'], first['lost']) == (False, 4, 0)
    assert first['seed'] == 2
