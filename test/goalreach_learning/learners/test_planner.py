"""The planner: what it concludes from places, borders and bumps."""

import math

import numpy as np
import pytest

from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.learner import Agent, Experience, LearnerSetup, Situation
from goalreach_learning.learners.planner import PlanningLearner
from goalreach_learning.q_learning import LearningConfig
from goalreach_learning.training import LearningPhase
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import PathOutcome, Region


def planner(seed: int = 0) -> PlanningLearner:
    rng = np.random.default_rng(seed)
    return PlanningLearner(LearnerSetup(shape=(3, 3, 8), config=LearningConfig(), rng=rng))


def place(region: Region, x_m: float, y_m: float, *, certain: bool = True) -> Situation:
    return Situation(region=region, x_m=x_m, y_m=y_m, certain=certain)


def bump(before: Situation, action: int, after: Situation, *azimuths_deg: float) -> Experience:
    touched_rad = tuple(math.radians(azimuth) for azimuth in azimuths_deg)
    outcome = PathOutcome.BUMP
    return Experience(
        before=before, action=action, reward=-1.0, after=after, outcome=outcome,
        touched_rad=touched_rad,
    )  # fmt: skip


def goal(before: Situation, action: int, after: Situation) -> Experience:
    outcome = PathOutcome.GOAL
    return Experience(before=before, action=action, reward=1.0, after=after, outcome=outcome)


LEFT, FRONT = place((0, 0), 0.5, 0.5), place((1, 0), 1.25, 0.5)


def test_knows_nothing_at_first() -> None:
    q, visits = planner().policy()
    assert q.shape == visits.shape == (3, 3, 8)
    assert not visits.any()


def test_a_bump_shows_a_wall_of_which_it_keeps_away() -> None:
    learner = planner()
    learner.update(bump(LEFT, 4, place((0, 0), 0.225, 0.5), 189.0))  # two sensors: 9 deg off
    ((x, y, limit_m),) = learner.save()['walls']
    assert (x, y) == (-1, 0)
    assert limit_m == pytest.approx(-0.225)
    chosen = {learner.choose(place((0, 0), 0.3, 0.5)) for _ in range(40)}
    assert chosen.isdisjoint({3, 4, 5})  # 135, 180 and 225 degrees
    assert len(chosen) > 1


def test_a_wall_that_is_crossed_was_none() -> None:
    learner = planner()
    learner.update(bump(LEFT, 0, place((0, 0), 0.8, 0.5), 0.0))
    learner.choose(place((0, 0), 1.0, 0.5))
    assert learner.save()['walls'] == []


def test_an_oblique_wall_is_kept_as_felt() -> None:
    learner = planner()
    learner.update(bump(LEFT, 1, place((0, 0), 0.8, 0.8), 45.0))
    ((x, y, limit_m),) = learner.save()['walls']
    assert (x, y) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    assert limit_m == pytest.approx(0.8 * math.sqrt(2.0))


def test_an_uncertain_pose_shows_no_wall() -> None:
    learner = planner()
    learner.update(bump(LEFT, 4, place((0, 0), 0.2, 0.5, certain=False), 180.0))
    assert learner.save()['walls'] == []


def test_a_goal_once_entered_is_planned_for_from_the_next_region() -> None:
    learner = planner()
    learner.choose(LEFT)
    learner.update(goal(place((0, 0), 1.15, 0.5), 0, FRONT))
    learner.choose(place((0, 0), 1.15, 0.5))
    q, visits = learner.policy()
    assert q[0, 0, 0] == 1.0
    assert q[0, 0].argmax() == 0
    assert visits[0, 0].all()
    assert learner.choose(LEFT) == 0


@pytest.mark.parametrize('seed', range(10))
def test_four_walls_are_felt_once_each_and_the_policy_stays_good(seed: int) -> None:
    arena, rng = Arena(), np.random.default_rng(seed)
    config = LearningConfig()
    agent = Agent('planner', arena.regions, config, rng)
    phase = LearningPhase(arena, config, agent, rng)
    bumps, reached = 0, []
    for path in range(40):
        start = arena.starts[int(rng.integers(22))]
        bumps += phase.run(start, 0, path)[0] is PathOutcome.BUMP
        reached.append(all(greedy_successes(arena, agent.policy)))
    assert bumps <= 4
    assert all(reached[20:])
    assert all(reached[reached.index(True) :])
