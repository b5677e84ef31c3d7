"""The same random drives for every simulator that is compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from goalreach_lab.batch.robot_batch import RobotBatch
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import FloatArray, Pose2, Twist2
from goalreach_sim.contact import Walls
from goalreach_sim.drive_config import DriveConfig
from goalreach_sim.robot import Robot

STEP_S = 0.04
"""One camera period."""
STEPS = 125
_HOLD = 25
"""Steps of a drive, five seconds, and of each of its commands; chosen."""

_WATCHDOG_S = 0.5
_ROOM_M = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class RandomDrives:
    """Drives from random poses with random velocities, a new one each second.

    Attributes:
        starts: x (m), y (m) and heading (rad) of each drive, (3, n).
        commands: Speed (m/s) and steering rate (rad/s) by command and drive, (5, 2, n).
    """

    starts: FloatArray
    commands: FloatArray

    @classmethod
    def draw(cls, count: int, arena: Arena, rng: np.random.Generator) -> RandomDrives:
        """Draw drives that start on the free floor and use all of the robot's speed.

        Args:
            count: How many.
            arena: Where.
            rng: Source of randomness.
        """
        config, inset_m = DriveConfig(), BODY_RADIUS_M + _ROOM_M
        low = np.array([[inset_m], [inset_m], [-np.pi]])
        high = np.array([[arena.width_m - inset_m], [arena.length_m - inset_m], [np.pi]])
        top = np.array([config.translation_speed_m_per_s, config.steering_speed_rad_per_s])
        commands = rng.uniform(-1.0, 1.0, (STEPS // _HOLD, 2, count)) * top[:, None]
        return cls(starts=rng.uniform(low, high, (3, count)), commands=commands)

    def command(self, step: int) -> FloatArray:
        """Return the command of every drive in a step, (2, n)."""
        command: FloatArray = self.commands[step // _HOLD]
        return command


def drive_batch(drives: RandomDrives, arena: Arena) -> FloatArray:
    """Drive all at once; return where they end, (3, n)."""
    count = drives.starts.shape[1]
    batch = RobotBatch(DriveConfig(), _walls(arena), count, watchdog_s=_WATCHDOG_S)
    batch.place(*drives.starts)
    for step in range(STEPS):
        batch.drive(*drives.command(step))
        batch.advance(STEP_S)
    return batch.poses


def drive_one(drives: RandomDrives, index: int, arena: Arena) -> None:
    """Drive a single one of them."""
    robot = Robot(DriveConfig(), _walls(arena), watchdog_s=_WATCHDOG_S)
    x_m, y_m, heading_rad = drives.starts[:, index].tolist()
    robot.place(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    for step in range(STEPS):
        speed, turn = drives.command(step)[:, index].tolist()
        robot.drive(Twist2(linear_m_per_s=speed, steering_rad_per_s=turn))
        robot.advance(STEP_S)


def _walls(arena: Arena) -> Walls:
    return Walls(width_m=arena.width_m, length_m=arena.length_m, body_radius_m=BODY_RADIUS_M)
