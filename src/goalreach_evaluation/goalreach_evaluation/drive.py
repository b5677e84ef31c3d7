"""The whole loop in one process: robot, images, localizer, state and controller, without ROS."""

from collections.abc import Iterator
from dataclasses import dataclass, field
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_evaluation.path_metrics import PathResult, Tick, measure_path
from goalreach_learning.behaviors import Surroundings
from goalreach_learning.controller import ControlStep, GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Confidence, FloatArray, Pose2, RegionState, Scan, Twist2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveFrame:
    """One camera period of a path: from the image to the command.

    Attributes:
        sensors: Everything measured at this moment, and the truth.
        localization: Output of the localizer.
        state: Region and memberships of the estimated pose.
        control: Output of the controller.
        result: The path's measures in its last frame, None before.
    """

    sensors: SensorFrame
    localization: LocalizerOutput
    state: RegionState
    control: ControlStep
    result: PathResult | None = None

    @property
    def time_s(self) -> float:
        """Time on the robot's clock, seconds."""
        return self.sensors.time_ns * 1e-9

    @property
    def image(self) -> NDArray[np.uint8]:
        """The camera image, (height, width) grey values."""
        return self.sensors.image

    @property
    def pose(self) -> Pose2:
        """The estimated pose in `map`; the middle of the arena while there is no estimate."""
        return self.localization.estimate.pose

    @property
    def covariance(self) -> FloatArray:
        """The covariance of the estimated pose, (3, 3) of x (m), y (m), heading (rad)."""
        return self.localization.estimate.covariance

    @property
    def true_pose(self) -> Pose2:
        """The true pose in `map`; nothing that drives the robot uses it."""
        return self.sensors.truth.pose

    @property
    def command(self) -> Twist2:
        """The velocities driven until the next frame."""
        return self.control.command


def surroundings(sensors: SensorFrame) -> Surroundings:
    """Return what a robot feels and hears."""
    ranges_m = sensors.sonar
    return Surroundings(
        pressed=sensors.bumpers,
        scan=Scan(first_rad=0.0, step_rad=math.tau / len(ranges_m), ranges_m=ranges_m)
        if ranges_m
        else None,
        odometry=sensors.odometry.pose,
    )


@dataclass
class InProcessDrive:
    """Drives path after path as the graph does in lockstep, tick for tick.

    Where sensors have clocks of their own, the localizer also reads them between images, and
    estimates the delay of the images; over topics they have the stamps of the images.

    Attributes:
        arena: The arena.
        noise: Errors of the sensors; the localizer expects the same.
        policy: The policy at the beginning.
        controller: Configuration of the controller.
        seed: Seed of every random draw.
        simulator: Configuration of the simulator, or None to derive it from arena and noise.
        localizer: Configuration of the localizer, likewise.
        frames: Number of camera frames so far.
    """

    arena: Arena
    noise: NoiseModel
    policy: Policy
    controller: ControllerConfig
    seed: np.random.SeedSequence
    simulator: SimulatorConfig | None = None
    localizer: LocalizerConfig | None = None
    frames: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        simulator_seed, controller_seed = self.seed.spawn(2)
        robot = self.simulator or SimulatorConfig.for_arena(self.arena, self.noise)
        self._simulator = Simulator(robot, np.random.default_rng(simulator_seed))
        expected = self.localizer or LocalizerConfig.for_arena(self.arena, self.noise)
        self._localizer = LandmarkLocalizer(expected)
        self._estimator = StateEstimator(StateEstimatorConfig.for_arena(self.arena))
        rng = np.random.default_rng(controller_seed)
        self._controller = GoalReachingController(self.controller, self.policy, rng)

    @property
    def learned(self) -> Policy:
        """The policy now: it differs from the first one where the controller learns."""
        return self._controller.policy

    def drive(self, start: Pose2, *, path: int = 0, trial: int = 0) -> PathResult:
        """Drive one path from a pose in `map` to its end; return its measures."""
        frames = self.drive_frames(start, path=path, trial=trial)
        return next(frame.result for frame in frames if frame.result is not None)

    def drive_frames(self, start: Pose2, *, path: int = 0, trial: int = 0) -> Iterator[DriveFrame]:
        """Drive one path from a pose in `map`; the last frame that it yields has the result."""
        self._simulator.reset(start)
        self._controller.begin_path(start=start, path=path, trial=trial)
        ticks: list[Tick] = []
        while True:
            frame = self._next_frame(start, ticks)
            yield frame
            if frame.result is not None:
                return
            self._simulator.command_drive(frame.command)
            self._simulator.command_head(self._localizer.head_command)

    def _next_frame(self, start: Pose2, ticks: list[Tick]) -> DriveFrame:
        """Simulate one camera period and compute the command for the next."""
        self._simulator.advance()
        sensors = self._simulator.sense()
        localization = self._localizer.process(
            time_ns=sensors.time_ns,
            image=sensors.image,
            camera=sensors.camera,
            joints=sensors.joints,
            odometry=sensors.odometry,
            sampled=self._simulator.sampled,
        )
        state = self._estimator.estimate(localization.estimate)
        control = self._controller.step(
            time_ns=sensors.time_ns,
            state=state,
            bumped=any(sensors.bumpers),
            around=surroundings(sensors),
        )
        self.frames += 1
        truth = sensors.truth.pose
        ticks.append(
            Tick(
                time_ns=sensors.time_ns,
                truth=truth,
                estimate=state.pose if state.confidence is Confidence.OK else None,
                commanded_heading_rad=control.heading_rad,
            )
        )
        result = None
        if control.transition is not None and control.transition.outcome is not None:
            region = self.arena.regions.region_at(truth.x_m, truth.y_m)
            in_goal = region == self.arena.regions.goal
            result = measure_path(start, ticks, control.transition.outcome, in_goal=in_goal)
        return DriveFrame(
            sensors=sensors, localization=localization, state=state, control=control, result=result
        )
