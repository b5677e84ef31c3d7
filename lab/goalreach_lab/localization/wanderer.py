"""A robot that wanders through the arena by what it sees, without ROS and without a task."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2, Twist2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_X_RANGE_M = (0.3, 3.25)
_Y_RANGE_M = (0.35, 4.75)
_NEAR_M = 0.1
_SPEED_M_PER_S = 0.5
_STOP = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


def random_pose(rng: np.random.Generator) -> Pose2:
    """Return a pose anywhere on the free floor of the paper's arena, a hand from its walls."""
    return Pose2(
        x_m=float(rng.uniform(*_X_RANGE_M)),
        y_m=float(rng.uniform(*_Y_RANGE_M)),
        heading_rad=float(rng.uniform(-math.pi, math.pi)),
    )


@dataclass(frozen=True)
class Step:
    """One image of a drive: what was sensed, what came out."""

    frame: SensorFrame
    output: LocalizerOutput


class Wanderer:
    """A simulated robot that drives between random places by its own estimate of its pose.

    Args:
        seed: Of everything random: one or more whole numbers.
        noise: The errors, drawn by the simulator and expected by the localizer.
        calibrate: Whether the localizer calibrates itself.

    Attributes:
        simulator: The robot.
        localizer: Its eyes.
    """

    def __init__(self, seed: Sequence[int], *, noise: NoiseModel, calibrate: bool = True) -> None:
        self._rng = np.random.default_rng([*seed, 1])
        arena = Arena()
        start = random_pose(self._rng)
        config = replace(
            SimulatorConfig.for_arena(arena, noise),
            start_pose=(start.x_m, start.y_m, start.heading_rad),
        )
        self.simulator = Simulator(config, np.random.default_rng([*seed, 2]))
        self.localizer = LandmarkLocalizer(
            replace(LocalizerConfig.for_arena(arena, noise), calibrate=calibrate)
        )
        self._way: Pose2 | None = None

    def kidnap(self) -> None:
        """Put the robot somewhere else, as a reset does: its odometry starts there."""
        self.simulator.reset(random_pose(self._rng))
        self._way = None

    def carry_off(self) -> None:
        """Put the robot somewhere else without its noticing: no encoder counts, no axis moves."""
        robot = self.simulator.robot
        odometry = robot.odometry.pose
        robot.place(
            random_pose(self._rng),
            steering_rad=robot.steering.position,
            turret_rad=robot.turret.position,
        )
        robot.define_odometry(odometry)
        self._way = None

    def step(self) -> Step:
        """Let one camera period pass; the robot stands while its pose is not known."""
        self.simulator.advance()
        frame = self.simulator.sense()
        output = self.see(frame)
        self.simulator.command_head(output.head_command)
        tracking = output.mode == 'tracking'
        self.simulator.command_drive(self._steer(output.estimate.pose) if tracking else _STOP)
        return Step(frame, output)

    def see(self, frame: SensorFrame) -> LocalizerOutput:
        """Return what the localizer makes of a frame."""
        return self.localizer.process(
            time_ns=frame.time_ns,
            image=frame.image,
            camera=frame.camera,
            joints=frame.joints,
            odometry=frame.odometry,
        )

    def run(self, steps: int) -> Iterator[Step]:
        """Yield the images of a drive."""
        for _ in range(steps):
            yield self.step()

    def _steer(self, pose: Pose2) -> Twist2:
        way = self._way
        if way is None or math.hypot(way.x_m - pose.x_m, way.y_m - pose.y_m) < _NEAR_M:
            way = self._way = random_pose(self._rng)
        wanted = math.atan2(way.y_m - pose.y_m, way.x_m - pose.x_m)
        turn = angle_difference(wanted, pose.heading_rad)
        return Twist2(
            linear_m_per_s=_SPEED_M_PER_S * max(0.0, math.cos(turn)) ** 3,
            steering_rad_per_s=max(-1.0, min(1.0, 1.2 * turn)),
        )
