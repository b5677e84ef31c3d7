"""A simulated robot that drives to random waypoints by its estimated pose, in one process."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any, Final

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

FRAMES_PER_S: Final = 25
"""Images per second of the default camera."""
_X_RANGE_M = (0.3, 3.25)
_Y_RANGE_M = (0.35, 4.75)
_ARRIVED_M = 0.1
_SPEED_M_PER_S = 0.5
_STOP = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


def random_pose(rng: np.random.Generator) -> Pose2:
    """Return a pose on the free floor of the paper's arena, clear of its walls."""
    return Pose2(
        x_m=float(rng.uniform(*_X_RANGE_M)),
        y_m=float(rng.uniform(*_Y_RANGE_M)),
        heading_rad=float(rng.uniform(-math.pi, math.pi)),
    )


def inputs_of(frame: SensorFrame) -> dict[str, Any]:
    """Return what the localizer processes of a frame, by the names of its arguments."""
    return {
        name: getattr(frame, name) for name in ('time_ns', 'image', 'camera', 'joints', 'odometry')
    }


@dataclass(frozen=True, kw_only=True)
class Step:
    """One camera frame of a drive and the localizer's output for it."""

    frame: SensorFrame
    output: LocalizerOutput


class WaypointRobot:
    """A simulated robot that drives to one random waypoint after the other.

    It steers by the localizer's pose and stands still while that is unknown.

    Args:
        seed: One or more whole numbers that determine everything random.
        noise: The errors, drawn by the simulator and expected by the localizer.
        calibrate: Whether the localizer calibrates itself.

    Attributes:
        simulator: The simulated robot.
        localizer: Its localizer.
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
        self._waypoint: Pose2 | None = None

    def kidnap(self) -> None:
        """Move the robot to a random pose without any encoder counting it."""
        robot = self.simulator.robot
        odometry = robot.odometry.pose
        robot.place(
            random_pose(self._rng),
            steering_rad=robot.steering.position,
            turret_rad=robot.turret.position,
        )
        robot.define_odometry(odometry)
        self._waypoint = None

    def step(self) -> Step:
        """Advance by one camera period."""
        self.simulator.advance()
        frame = self.simulator.sense()
        output = self.localize(frame)
        self.simulator.command_head(self.localizer.head_command)
        tracking = output.mode == 'tracking'
        self.simulator.command_drive(self._steer(output.estimate.pose) if tracking else _STOP)
        return Step(frame=frame, output=output)

    def localize(self, frame: SensorFrame) -> LocalizerOutput:
        """Return the localizer's output for a frame."""
        return self.localizer.process(**inputs_of(frame))

    def run(self, steps: int) -> Iterator[Step]:
        """Yield the steps of a drive."""
        for _ in range(steps):
            yield self.step()

    def _steer(self, pose: Pose2) -> Twist2:
        point = self._waypoint
        if point is None or math.hypot(point.x_m - pose.x_m, point.y_m - pose.y_m) < _ARRIVED_M:
            point = self._waypoint = random_pose(self._rng)
        wanted = math.atan2(point.y_m - pose.y_m, point.x_m - pose.x_m)
        turn = angle_difference(wanted, pose.heading_rad)
        return Twist2(
            linear_m_per_s=_SPEED_M_PER_S * max(0.0, math.cos(turn)) ** 3,
            steering_rad_per_s=max(-1.0, min(1.0, 1.2 * turn)),
        )
