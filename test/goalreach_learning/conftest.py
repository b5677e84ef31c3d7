"""A robot without a camera: its estimate is the true pose plus noise."""

from collections.abc import Callable
from dataclasses import dataclass
import math

import numpy as np
import pytest

from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.values import FloatArray, PathOutcome, Pose2, PoseEstimate, RegionState
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.robot import Robot
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import Walls

TICK_S = 0.04


@dataclass
class Drive:
    outcome: PathOutcome
    truth: Pose2
    clearance_m: float
    heading_step_rad: float
    seconds: float


@dataclass
class ClosedLoop:
    """Drives one path; noise in multiples of 0.5 in and 0.2 degrees."""

    arena: Arena
    policy: Policy
    noise: float = 1.0

    def drive(self, start: Pose2, seed: int, **config: object) -> Drive:
        rng = np.random.default_rng(seed)
        controller = GoalReachingController(
            build_config(ControllerConfig, config), self.policy, rng
        )
        robot = self._robot()
        robot.place(start)
        controller.begin_path(start=start, path=0, trial=0)
        bias = rng.normal(0.0, 1.0, 3)
        result = Drive(PathOutcome.TIMEOUT, start, math.inf, 0.0, 0.0)
        last: float | None = None
        for tick in range(2000):
            truth = robot.truth.pose
            state = self.see(truth, 0.7 * bias + 0.7 * rng.normal(0.0, 1.0, 3))
            step = controller.step(
                time_ns=round(tick * TICK_S * 1e9), state=state, bumped=any(robot.bumpers)
            )
            result.clearance_m = min(
                result.clearance_m, robot.walls.clearance_m(truth.x_m, truth.y_m)
            )
            if last is not None and step.heading_rad is not None:
                change = abs(angle_difference(step.heading_rad, last))
                result.heading_step_rad = max(result.heading_step_rad, change)
            last = step.heading_rad
            if step.transition is not None and step.transition.outcome is not None:
                result.outcome, result.truth = step.transition.outcome, truth
                result.seconds = tick * TICK_S
                return result
            robot.drive(step.command)
            robot.advance(TICK_S)
        return result

    def _robot(self) -> Robot:
        walls = Walls(
            width_m=self.arena.width_m,
            length_m=self.arena.length_m,
            body_radius_m=BODY_RADIUS_M,
        )
        return Robot(DriveConfig(), walls, watchdog_s=0.5)

    def see(self, truth: Pose2, error: FloatArray) -> RegionState:
        sigma_m, sigma_rad = self.noise * 0.0127, self.noise * math.radians(0.2)
        pose = Pose2(
            x_m=truth.x_m + sigma_m * error[0],
            y_m=truth.y_m + sigma_m * error[1],
            heading_rad=wrap_angle(truth.heading_rad + sigma_rad * error[2]),
        )
        variances = [sigma_m**2 + 1e-10, sigma_m**2 + 1e-10, sigma_rad**2 + 1e-10]
        regions = self.arena.regions
        estimator = StateEstimator(
            StateEstimatorConfig(x_knots_m=regions.x_knots_m, y_knots_m=regions.y_knots_m)
        )
        return estimator.estimate(PoseEstimate(pose=pose, covariance=np.diag(variances)))


@pytest.fixture
def closed_loop(arena: Arena, learned: Policy) -> Callable[..., ClosedLoop]:
    def build(noise: float = 1.0, policy: Policy | None = None) -> ClosedLoop:
        return ClosedLoop(arena, policy or learned, noise)

    return build


def policy_of(arena: Arena, actions: dict[tuple[int, int], int]) -> Policy:
    q = np.zeros((3, 3, 8))
    visits = np.zeros((3, 3, 8), dtype=np.int64)
    for region, action in actions.items():
        q[region][action] = 1.0
        visits[region][action] = 1
    return Policy(q=q, visits=visits, regions=arena.regions)


@pytest.fixture
def make_policy(arena: Arena) -> Callable[[dict[tuple[int, int], int]], Policy]:
    return lambda actions: policy_of(arena, actions)
