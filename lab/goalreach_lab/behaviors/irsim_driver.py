"""IR-SIM's own avoidance (velocity obstacles) in an arena of ours.

It knows every obstacle and its velocity, and its own pose, exactly; it has no camera, no sonar and
no noise. Its robot has the shape and the limits of ours, and stops for good where it collides.
"""

import itertools
import math
from typing import Any, Final

import numpy as np

from goalreach_lab.rigs.random_drives import irsim_line, irsim_robot, make_irsim
from goalreach_lab.study import Result
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Pose2
from goalreach_sim.simulator_config import DriveConfig

_STEP_S: Final = 0.1
"""IR-SIM's usual step."""
_INSET_M: Final = 0.1
"""The centre is that far inside the goal region, where the goal counts as reached."""


def drive_irsim(arena: Arena, start: Pose2, timeout_s: float) -> Result:
    """Drive one path from a start; return what `drive_arena` returns of it.

    Args:
        arena: The arena with its obstacles.
        start: Where the robot begins.
        timeout_s: Time after which the path ends.
    """
    environment = make_irsim(_world(arena, start))
    robot, moving = environment.robot, [one for one in arena.obstacles if one.track_m]
    bodies = environment.obstacle_list[-len(moving) :] if moving else []
    x0_m, y0_m, x1_m, y1_m = arena.regions.bounds(arena.regions.goal)
    trace, outcome, time_s = [[start.x_m, start.y_m]], 'timeout', 0.0
    while time_s < timeout_s and outcome == 'timeout':
        for one, body in zip(moving, bodies, strict=True):
            _place(body, one, time_s)
        environment.step()
        time_s += _STEP_S
        x_m, y_m = np.asarray(robot.state, float).ravel()[:2].tolist()
        trace.append([x_m, y_m])
        if robot.collision:
            outcome = 'bump'
        elif x0_m + _INSET_M < x_m < x1_m - _INSET_M and y0_m < y_m < y1_m - _INSET_M:
            outcome = 'goal'
    return {
        'outcome': outcome,
        'bumps': int(outcome == 'bump'),
        'ends_pressed': outcome == 'bump',
        'duration_s': time_s,
        'length_m': math.fsum(itertools.starmap(math.dist, itertools.pairwise(trace))),
        'trace': trace,
    }


def _place(body: Any, one: Obstacle, time_s: float) -> None:
    """Put a moving obstacle where it is at a time, with its velocity."""
    here, there = (one.after(one.speed_m_per_s * t) for t in (time_s, time_s + _STEP_S))
    body.set_state([here.x_m, here.y_m, one.heading_rad])
    velocity = ((there.x_m - here.x_m) / _STEP_S, (there.y_m - here.y_m) / _STEP_S)
    body.set_velocity(np.array(velocity)[:, None])


def _world(arena: Arena, start: Pose2) -> dict[str, Any]:
    config, (width_m, length_m) = DriveConfig(), (arena.width_m, arena.length_m)
    room = Obstacle(x_m=width_m / 2, y_m=length_m / 2, length_m=width_m, width_m=length_m)
    boxes = [one for one in arena.obstacles if one.length_m and not one.track_m]
    bodies = [one for one in arena.obstacles if one.radius_m and not one.track_m]
    bodies += [one for one in arena.obstacles if one.track_m]
    top_m_per_s = config.translation_speed_m_per_s
    rvo = {'name': 'rvo', 'mode': 'vo', 'vxmax': top_m_per_s, 'vymax': top_m_per_s}
    rvo['acce'] = config.translation_acceleration_m_per_s2
    state, goal = [start.x_m, start.y_m, start.heading_rad], [*_goal(arena), 0.0]
    return {
        **irsim_robot(arena, _STEP_S, state=state, goal=goal, behavior=rvo),
        'obstacle': [*(irsim_line(_corners(box)) for box in (room, *boxes)), *map(_body, bodies)],
    }


def _body(one: Obstacle) -> dict[str, Any]:
    shape = (
        {'name': 'circle', 'radius': one.radius_m}
        if one.radius_m
        else {'name': 'rectangle', 'length': one.length_m, 'width': one.width_m}
    )
    body: dict[str, Any] = {'shape': shape, 'state': [one.x_m, one.y_m, one.heading_rad]}
    return body | ({'kinematics': {'name': 'omni'}} if one.track_m else {})


def _corners(box: Obstacle) -> list[list[float]]:
    """Return the outline of a box, closed."""
    cosine, sine = math.cos(box.heading_rad), math.sin(box.heading_rad)
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))
    halves = [(0.5 * box.length_m * i, 0.5 * box.width_m * j) for i, j in signs]
    return [
        [box.x_m + cosine * x_m - sine * y_m, box.y_m + sine * x_m + cosine * y_m]
        for x_m, y_m in halves
    ]


def _goal(arena: Arena) -> tuple[float, float]:
    """Return the point of the goal region that is furthest from what stands."""
    x0_m, y0_m, x1_m, y1_m = arena.regions.bounds(arena.regions.goal)
    standing = [one for one in arena.obstacles if not one.track_m]
    points = itertools.product(
        np.linspace(x0_m + 2 * _INSET_M, x1_m - 2 * _INSET_M, 9).tolist(),
        np.linspace(y0_m + BODY_RADIUS_M + _INSET_M, y1_m - 2 * _INSET_M, 9).tolist(),
    )
    return max(points, key=lambda at: min((one.contact(*at)[0] for one in standing), default=0.0))
