"""All behaviours in the world of `examples/mujoco_world`, over DDS and in lockstep."""

import math
from pathlib import Path
import tempfile
from typing import Any

import yaml

from goalreach_lab.study import Result
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.topics import CONTROLLER


def drive_mujoco(arena: Arena, behaviors: str, timeout_s: float, seed: int) -> Result:
    """Drive one path from the arena's start; return what `drive_arena` returns of it.

    Args:
        arena: The arena with its obstacles.
        behaviors: The combination of behaviours.
        timeout_s: Time after which the path ends.
        seed: Seed of the world's errors of construction and noise.
    """
    from goalreach_lab.abroad.ros_drive import drive

    told = {CONTROLLER: {'behaviors': behaviors, 'timeout_s': timeout_s}}
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        path = Path(folder) / 'arena.yaml'
        path.write_text(yaml.safe_dump(world_arena(arena)), encoding='utf-8')
        world = ('--arena', str(path), '--exposure', '0')  # one image for each stamp, not three
        (driven,) = drive(world, told, arena.starts[:1], seed=seed)
    return {name: value for name, value in driven.items() if name != 'errors'}


def world_arena(arena: Arena) -> dict[str, Any]:
    """Return what the world reads of an arena's file."""
    return {
        'width_m': arena.width_m,
        'length_m': arena.length_m,
        'leds_m': [list(led_m) for led_m in arena.landmarks_m],
        'obstacles': [_obstacle(one) for one in arena.obstacles],
    }


def _obstacle(one: Obstacle) -> dict[str, Any]:
    fields = {name: value for name, value in vars(one).items() if value}
    if 'heading_rad' in fields:
        fields['heading_deg'] = math.degrees(fields.pop('heading_rad'))
    return fields | {'track_m': [list(point_m) for point_m in one.track_m]}
