"""The whole loop in one process: robot, images, localizer, state and controller, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from goalreach_evaluation.path_metrics import PathMeter, PathResult
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Confidence, Pose2, RegionState
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig


@dataclass
class InProcessDrive:
    """Drives path after path as the graph does in lockstep, tick for tick.

    Attributes:
        arena: Where to drive.
        noise: How far the sensors may be wrong; the localizer expects the same.
        policy: What to drive.
        controller: Configuration of the controller.
        seed: Seed of everything random.
        simulator: Configuration of the simulator, or None for the arena's and the noise's.
        localizer: Configuration of the localizer, likewise.
        observer: Called with every frame, what the localizer made of it, and the state.
    """

    arena: Arena
    noise: NoiseModel
    policy: Policy
    controller: ControllerConfig
    seed: np.random.SeedSequence
    simulator: SimulatorConfig | None = None
    localizer: LocalizerConfig | None = None
    observer: Callable[[SensorFrame, LocalizerOutput, RegionState], None] | None = None
    frames: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Build robot, eyes, state and controller."""
        simulator_seed, controller_seed = self.seed.spawn(2)
        self._simulator = Simulator(
            self.simulator or SimulatorConfig.for_arena(self.arena, self.noise),
            np.random.default_rng(simulator_seed),
        )
        eyes = self.localizer or LocalizerConfig.for_arena(self.arena, self.noise)
        self._localizer = LandmarkLocalizer(eyes)
        self._estimator = StateEstimator(StateEstimatorConfig.for_arena(self.arena))
        self._controller = GoalReachingController(
            self.controller, self.policy, np.random.default_rng(controller_seed)
        )

    @property
    def learned(self) -> Policy:
        """What is known now: more than was given where the controller learns."""
        return self._controller.policy

    def drive(self, start: Pose2, *, path: int = 0, trial: int = 0) -> PathResult:
        """Place the robot, drive until the path ends, and judge it by the truth.

        Args:
            start: Where the robot is placed, in `map`.
            path: Number of the path.
            trial: Number of the trial.
        """
        self._simulator.reset(start)
        self._controller.begin_path(start=start, path=path, trial=trial)
        meter = PathMeter(start)
        while True:
            self._simulator.advance()
            frame = self._simulator.sense()
            seen = self._localizer.process(
                time_ns=frame.time_ns,
                image=frame.image,
                camera=frame.camera,
                joints=frame.joints,
                odometry=frame.odometry,
            )
            state = self._estimator.estimate(seen.estimate)
            if self.observer is not None:
                self.observer(frame, seen, state)
            step = self._controller.step(
                time_ns=frame.time_ns, state=state, bumped=any(frame.bumpers)
            )
            self.frames += 1
            truth = frame.truth.pose
            trusted = state.confidence is Confidence.OK
            meter.add(
                time_ns=frame.time_ns,
                truth=truth,
                estimate=state.pose if trusted else None,
                commanded_heading_rad=step.heading_rad,
            )
            if step.transition is not None and step.transition.outcome is not None:
                region = self.arena.regions.region_at(truth.x_m, truth.y_m)
                return meter.finish(
                    step.transition.outcome, in_goal=region == self.arena.regions.goal
                )
            self._simulator.command_drive(step.command)
            self._simulator.command_head(seen.head_command)
