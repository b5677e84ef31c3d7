"""Help for the perception tests: rendered spots, and a robot driven by its true pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.values import FloatArray, Pose2, Twist2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_X_RANGE_M = (0.3, 3.25)
_Y_RANGE_M = (0.35, 4.75)


def spot_image(
    spots: list[tuple[float, float, float]],
    *,
    sigma_px: float = 1.2,
    background_dn: float = 10.0,
    noise_dn: float = 0.0,
    rng: np.random.Generator | None = None,
) -> NDArray[np.uint8]:
    """Return a 640x480 image of Gaussian spots (u, v, peak), sampled at pixel centres."""
    v, u = np.mgrid[0:480, 0:640].astype(np.float64)
    light: FloatArray = np.full((480, 640), background_dn)
    for u_px, v_px, peak_dn in spots:
        light += peak_dn * np.exp(-((u - u_px) ** 2 + (v - v_px) ** 2) / (2.0 * sigma_px**2))
    if rng is not None:
        light += noise_dn * rng.standard_normal(light.shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class Step:
    """One image of a drive: what was sensed, what came out."""

    frame: SensorFrame
    output: LocalizerOutput


def random_pose(rng: np.random.Generator) -> Pose2:
    """Return a pose anywhere on the free floor."""
    return Pose2(
        x_m=float(rng.uniform(*_X_RANGE_M)),
        y_m=float(rng.uniform(*_Y_RANGE_M)),
        heading_rad=float(rng.uniform(-math.pi, math.pi)),
    )


class Drive:
    """A simulated robot that wanders between random places by its true pose.

    Args:
        seed: Of everything random.
        noise: Preset of the errors, drawn by the simulator and expected by the localizer.
        calibrate: Whether the localizer calibrates itself.
        robot: Changes of the simulator's configuration.
    """

    def __init__(
        self,
        seed: int,
        *,
        noise: str = 'nominal',
        calibrate: bool = False,
        robot: Mapping[str, Any] | None = None,
    ) -> None:
        self._rng = np.random.default_rng([seed, 1])
        arena, model = Arena(), noise_preset(noise)
        start = random_pose(self._rng)
        config = replace(
            SimulatorConfig.for_arena(arena, model),
            start_pose=(start.x_m, start.y_m, start.heading_rad),
            **(robot or {}),
        )
        self.simulator = Simulator(config, np.random.default_rng([seed, 2]))
        self.localizer = LandmarkLocalizer(
            replace(LocalizerConfig.for_arena(arena, model), calibrate=calibrate)
        )
        self._way: Pose2 | None = None

    def kidnap(self) -> None:
        """Put the robot somewhere else."""
        self.simulator.reset(random_pose(self._rng))
        self._way = None

    def run(self, steps: int) -> Iterator[Step]:
        """Yield the images of a drive; the robot stands while its pose is not known."""
        for _ in range(steps):
            self.simulator.advance()
            frame = self.simulator.sense()
            output = self.localizer.process(
                time_ns=frame.time_ns,
                image=frame.image,
                camera=frame.camera,
                joints=frame.joints,
                odometry=frame.odometry,
            )
            self.simulator.command_head(self.localizer.head_command)
            self.simulator.command_drive(self._steer(frame.truth.pose, output.mode))
            yield Step(frame, output)

    def _steer(self, pose: Pose2, mode: str) -> Twist2:
        if mode != 'tracking':
            return Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)
        way = self._way
        if way is None or math.hypot(way.x_m - pose.x_m, way.y_m - pose.y_m) < 0.1:
            way = self._way = random_pose(self._rng)
        wanted = math.atan2(way.y_m - pose.y_m, way.x_m - pose.x_m)
        turn = angle_difference(wanted, pose.heading_rad)
        return Twist2(
            linear_m_per_s=0.5 * max(0.0, math.cos(turn)) ** 3,
            steering_rad_per_s=max(-1.0, min(1.0, 1.2 * turn)),
        )
