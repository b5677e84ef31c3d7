"""The same random drives for the simulators that are compared: ours and IR-SIM, from pip."""

from collections.abc import Callable
import contextlib
from dataclasses import dataclass
import importlib.util
import io
import math
from pathlib import Path
import tempfile
import time
from typing import Any

import numpy as np
import yaml

from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.simulator_config import DriveConfig

STEP_S = 0.04
"""One camera period."""
STEPS = 125
_HOLD = 25
"""Steps of a drive, five seconds, and of each of its commands; chosen."""

_CLEARANCE_M = 0.05


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
    def draw(cls, count: int, arena: Arena, rng: np.random.Generator) -> 'RandomDrives':
        """Draw drives that start on the free floor and use all of the robot's speed.

        Args:
            count: Number of drives.
            arena: Arena to drive in.
            rng: Source of randomness.
        """
        config, inset_m = DriveConfig(), BODY_RADIUS_M + _CLEARANCE_M
        low = np.array([[inset_m], [inset_m], [-np.pi]])
        high = np.array([[arena.width_m - inset_m], [arena.length_m - inset_m], [np.pi]])
        top = np.array([config.translation_speed_m_per_s, config.steering_speed_rad_per_s])
        commands = rng.uniform(-1.0, 1.0, (STEPS // _HOLD, 2, count)) * top[:, None]
        return cls(starts=rng.uniform(low, high, (3, count)), commands=commands)

    def command(self, step: int) -> FloatArray:
        """Return the command of every drive in a step, (2, n)."""
        command: FloatArray = self.commands[step // _HOLD]
        return command


def is_irsim_installed() -> bool:
    """Return whether IR-SIM can be imported; it is in the extra `bench`."""
    return importlib.util.find_spec('irsim') is not None


def make_irsim(world: dict[str, Any]) -> Any:
    """Return an environment of IR-SIM without a display."""
    # It prints on import which displays it could not open.
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:
        import irsim

        path = Path(folder) / 'world.yaml'
        path.write_text(yaml.safe_dump(world))
        return irsim.make(str(path), display=False, disable_all_plot=True, log_level='ERROR')


class IrSimDrives:
    """IR-SIM with one robot of the same size and limits in the same arena, without a display.

    Its robot stops for good where it touches a wall (its default, `collision_mode: stop`).

    Args:
        arena: Arena to drive in.
        step_s: Length of a step, seconds.
        lidar_rays: Rays of a lidar that looks all around at every step; 0 for none.
    """

    def __init__(self, arena: Arena, *, step_s: float = STEP_S, lidar_rays: int = 0) -> None:
        self._environment = make_irsim(_world(arena, step_s, lidar_rays))

    def place(self, drives: RandomDrives, index: int) -> None:
        """Put the robot at the start of a drive."""
        start = drives.starts[:, index].tolist()
        self._environment.robot.set_state(start, init=True)
        self._environment.reset()

    def drive(self, drives: RandomDrives, index: int) -> FloatArray:
        """Drive one of the drives from its start; return where it ends, (3,)."""
        step = self._environment.step
        for number in range(STEPS):
            step(drives.command(number)[:, index : index + 1])
        end: FloatArray = np.array(self._environment.robot.state, dtype=np.float64).ravel()[:3]
        return end

    def time(
        self, drives: RandomDrives, chosen: range, clock: Callable[[], float] = time.perf_counter
    ) -> float:
        """Return the time of the steps of some drives, s, without placing the robot."""
        took_s = 0.0
        for index in chosen:
            self.place(drives, index)
            began_s = clock()
            self.drive(drives, index)
            took_s += clock() - began_s
        return took_s


def _world(arena: Arena, step_s: float, lidar_rays: int) -> dict[str, Any]:
    width, length = arena.width_m, arena.length_m
    lidar = {
        'name': 'lidar2d',
        'number': lidar_rays,
        'angle_range': math.tau,
        'range_max': math.hypot(width, length),
    }
    corners = [[0.0, 0.0], [width, 0.0], [width, length], [0.0, length], [0.0, 0.0]]
    middle, sensors = [width / 2, length / 2, 0.0], [lidar] if lidar_rays else []
    return {
        **irsim_robot(arena, step_s, state=middle, sensors=sensors),
        'obstacle': [irsim_line(corners)],
    }


def irsim_robot(arena: Arena, step_s: float, **robot: object) -> dict[str, Any]:
    """Return an empty world of IR-SIM with a robot of the shape and the limits of ours.

    Args:
        arena: Has the size.
        step_s: Time of a step.
        robot: Further entries of the robot.
    """
    config = DriveConfig()
    top = [config.translation_speed_m_per_s, config.steering_speed_rad_per_s]
    gain = [config.translation_acceleration_m_per_s2, config.steering_acceleration_rad_per_s2]
    return {
        'world': {
            'width': arena.width_m,
            'height': arena.length_m,
            'step_time': step_s,
            'sample_time': step_s,
            'collision_mode': 'stop',
        },
        'robot': [
            {
                'kinematics': {'name': 'diff'},
                'shape': {'name': 'circle', 'radius': BODY_RADIUS_M},
                'vel_max': top,
                'vel_min': [-value for value in top],
                'acce': gain,
                **robot,
            }
        ],
    }


def irsim_line(points_m: list[list[float]]) -> dict[str, Any]:
    """Return a wall of IR-SIM along points."""
    return {'shape': {'name': 'linestring', 'vertices': points_m}, 'state': [0.0, 0.0, 0.0]}
