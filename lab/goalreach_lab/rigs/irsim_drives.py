"""IR-SIM, a Python simulator from pip, doing our random drives."""

from __future__ import annotations

import contextlib
import importlib.util
import io
from pathlib import Path
import tempfile
from typing import Any

import numpy as np
import yaml

from goalreach_lab.rigs.random_drives import STEP_S, STEPS, RandomDrives
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.drive_config import DriveConfig


def is_installed() -> bool:
    """Return whether IR-SIM can be imported; it is in the extra `bench`."""
    return importlib.util.find_spec('irsim') is not None


class IrSimDrives:
    """One robot of the same size and the same limits in the same arena, without any display.

    Its robot stops for good where it touches a wall (its default, `collision_mode: stop`).

    Args:
        arena: Where to drive.
        step_s: Length of a step, seconds.
    """

    def __init__(self, arena: Arena, *, step_s: float = STEP_S) -> None:
        # It prints on import which displays it could not open.
        with contextlib.redirect_stdout(io.StringIO()):
            import irsim

            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / 'world.yaml'
                path.write_text(yaml.safe_dump(_world(arena, step_s)))
                self._environment: Any = irsim.make(
                    str(path), display=False, disable_all_plot=True, log_level='ERROR'
                )

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


def _world(arena: Arena, step_s: float) -> dict[str, Any]:
    config, width, length = DriveConfig(), arena.width_m, arena.length_m
    top = [config.translation_speed_m_per_s, config.steering_speed_rad_per_s]
    gain = [config.translation_acceleration_m_per_s2, config.steering_acceleration_rad_per_s2]
    corners = [[0.0, 0.0], [width, 0.0], [width, length], [0.0, length], [0.0, 0.0]]
    return {
        'world': {
            'width': width,
            'height': length,
            'step_time': step_s,
            'sample_time': step_s,
            'collision_mode': 'stop',
        },
        'robot': [
            {
                'kinematics': {'name': 'diff'},
                'shape': {'name': 'circle', 'radius': BODY_RADIUS_M},
                'state': [width / 2, length / 2, 0.0],
                'vel_max': top,
                'vel_min': [-value for value in top],
                'acce': gain,
            }
        ],
        'obstacle': [
            {'shape': {'name': 'linestring', 'vertices': corners}, 'state': [0.0, 0.0, 0.0]}
        ],
    }
