"""Other grids and action sets: learned, and driven with images."""

import numpy as np
import pytest

from goalreach_evaluation.evaluation import EvaluationRequest, evaluate
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import train
from goalreach_msgs_py.arena import LENGTH_M, WIDTH_M, Arena, paper_starts
from goalreach_msgs_py.regions import RegionMap


def knots(count: int, size_m: float) -> tuple[float, ...]:
    borders_m = [size_m * k / count for k in range(1, count)]
    around = [round(border_m + side, 6) for border_m in borders_m for side in (-0.15, 0.15)]
    return (0.0, *around, size_m)


@pytest.mark.parametrize('learner', ['paper', 'planner'])
@pytest.mark.parametrize(
    ('shape', 'actions', 'goal'), [((5, 7), 16, (2, 0)), ((2, 2), 4, (0, 0)), ((1, 3), 8, (0, 2))]
)
def test_a_grid_is_learned_and_driven(
    shape: tuple[int, int], actions: int, goal: tuple[int, int], learner: str
) -> None:
    regions = RegionMap(
        x_knots_m=knots(shape[0], WIDTH_M),
        y_knots_m=knots(shape[1], LENGTH_M),
        goal=goal,
        actions=actions,
    )
    arena = Arena(regions=regions, starts=paper_starts(regions))
    config = LearningConfig(trials=1 if learner == 'planner' else 60)
    rng = np.random.default_rng(2)
    agent = Agent(learner, regions, config, rng)
    policy = train(arena, config, rng=rng, agent=agent).policy
    assert all(greedy_successes(arena, policy))
    driven = evaluate(EvaluationRequest(policy=policy, arena=arena, starts='random:2', seed=3))
    assert [path.outcome for path in driven.paths] == ['goal'] * 2
