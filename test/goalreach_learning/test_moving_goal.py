import math

import numpy as np
import pytest

from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.kinematic_drive import blended_track
from goalreach_learning.policy_file import read_policy
from goalreach_learning.training import policy_for_goal
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import parse_region
from goalreach_msgs_py.values import Confidence, PathOutcome, Pose2, RegionState


def test_a_policy_for_every_goal_drives_there() -> None:
    paper = read_policy('paper')
    for goal in paper.regions.cells:
        policy = policy_for_goal(paper, goal, np.random.default_rng(3))
        arena = Arena(regions=policy.regions, starts=())
        assert policy.regions.goal == goal
        for region in paper.regions.cells:
            x0, y0, x1, y1 = paper.regions.bounds(region)
            start = Pose2(x_m=(x0 + x1) / 2, y_m=(y0 + y1) / 2, heading_rad=0.0)
            if region != goal:
                track = blended_track(arena, policy, start, mode='fuzzy')
                assert track.outcome is PathOutcome.GOAL, (goal, region)


def test_its_own_goal_keeps_the_policy() -> None:
    paper = read_policy('paper')
    assert policy_for_goal(paper, paper.regions.goal, np.random.default_rng(3)) is paper


def test_the_goal_moves_while_it_drives() -> None:
    paper = read_policy('paper')
    controller = GoalReachingController(ControllerConfig(), paper, np.random.default_rng(1))
    controller.begin_path(start=None, path=0, trial=0)

    def heading(tick: int) -> float:
        regions = controller.policy.regions
        mu_x, mu_y = regions.memberships_at(1.778, 2.54)
        state = RegionState(
            region=(1, 1),
            mu_x=mu_x,
            mu_y=mu_y,
            pose=Pose2(x_m=1.778, y_m=2.54, heading_rad=0.0),
            goal_probability=0.0,
            confidence=Confidence.OK,
        )
        found = controller.step(time_ns=tick, state=state, bumped=False).heading_rad
        assert found is not None
        return found

    assert heading(1) == pytest.approx(-math.pi / 2)
    controller.aim(policy_for_goal(paper, parse_region('FRONT/FAR'), np.random.default_rng(3)))
    assert heading(2) == pytest.approx(math.pi / 2)
