"""The ring of ultrasonic sensors among walls and obstacles."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import INCH_M, deg
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_sim.simulator_config import SimulatorConfig

SONAR_COUNT = 16
"""State entries 17 to 32 of the Nomad 200's host language (Nclient.h)."""
NEAREST_M = 6.0 * INCH_M
"""Usual blanking distance of the Polaroid transducers of that time."""
FARTHEST_M = 255.0 * INCH_M
"""The host language holds a range in whole inches, at most 255."""
_CONE_RAD = deg(25.0)
"""Width of the beam within which there are echoes. Chosen: the main lobe of such transducers."""
_RAYS = 9
"""Rays across a cone, 3.1 degrees apart. Chosen."""
_INCIDENCE_COS = math.cos(deg(15.0))
"""A surface that is met further off its normal reflects the sound away. Chosen."""
_EDGE_M = 0.05
"""Nearer than this to its edges a box scatters sound in all directions. Chosen."""
_AXES = np.arange(SONAR_COUNT) * (2.0 * math.pi / SONAR_COUNT)
_FAN = np.linspace(-0.5, 0.5, _RAYS) * _CONE_RAD
_BEARINGS_RAD = (_AXES[:, None] + _FAN).ravel()


@dataclass(frozen=True)
class SonarRing:
    """Ranges of sixteen sensors, all in each camera period; sensor i looks to 22.5 i degrees.

    Along each ray of a cone the first surface counts, and echoes unless it is met too far off its
    normal; the nearest echo of a cone is its reading. A beam reflected away does not return. The
    sensors sit on the bumper ring at a height at which every obstacle reflects.
    """

    config: SimulatorConfig
    rng: np.random.Generator

    def read(self, base: Pose2, obstacles: Sequence[Obstacle]) -> tuple[float, ...]:
        """Return the range of each sensor from the robot's axis, metres, infinite without an echo.

        The heading of `base` is the orientation of the base in `map`.
        """
        config, radius_m = self.config, self.config.body_radius_m
        bearings, axes = _BEARINGS_RAD + base.heading_rad, _AXES + base.heading_rad
        rays = (np.cos(bearings), np.sin(bearings))
        origin = (
            base.x_m + radius_m * np.repeat(np.cos(axes), _RAYS),
            base.y_m + radius_m * np.repeat(np.sin(axes), _RAYS),
        )
        range_m, echoes = _walls((config.arena_width_m, config.arena_length_m), origin, rays)
        for one in obstacles:
            hit_m, good = (_cylinder if one.radius_m else _box)(one, origin, rays)
            nearer = hit_m < range_m
            range_m, echoes = np.where(nearer, hit_m, range_m), np.where(nearer, good, echoes)
        heard_m = np.where(echoes, range_m, math.inf).reshape(SONAR_COUNT, _RAYS).min(axis=1)
        heard_m *= 1.0 + config.noise.sonar_error * self.rng.standard_normal(SONAR_COUNT)
        heard_m = np.maximum(heard_m, NEAREST_M)
        lost = self.rng.random(SONAR_COUNT) < config.noise.sonar_dropout_probability
        heard_m[lost | (heard_m > FARTHEST_M)] = math.inf
        return tuple((heard_m + radius_m).tolist())


_Rays = tuple[FloatArray, FloatArray]
_Hits = tuple[FloatArray, FloatArray]
"""Distance along each ray, infinite where it meets nothing; whether it echoes, as a bool array."""


def _walls(size_m: tuple[float, float], origin: _Rays, rays: _Rays) -> _Hits:
    along = []
    for length_m, at_m, step in zip(size_m, origin, rays, strict=True):
        step = np.where(step == 0.0, 1e-300, step)  # noqa: PLW2901 - a ray along the wall
        along.append(np.maximum(np.where(step > 0.0, length_m - at_m, -at_m) / step, 0.0))
    normal = np.abs(np.where(along[0] < along[1], rays[0], rays[1]))
    return np.minimum(*along), normal >= _INCIDENCE_COS


def _cylinder(one: Obstacle, origin: _Rays, rays: _Rays) -> _Hits:
    x_m, y_m = origin[0] - one.x_m, origin[1] - one.y_m
    nearest_m = -(x_m * rays[0] + y_m * rays[1])
    aside_m = np.abs(x_m * rays[1] - y_m * rays[0])
    cosine = np.sqrt(np.maximum(1.0 - (aside_m / one.radius_m) ** 2, 0.0))
    hit = (aside_m < one.radius_m) & (nearest_m > 0.0)
    range_m = np.maximum(nearest_m - one.radius_m * cosine, 0.0)
    return np.where(hit, range_m, math.inf), cosine >= _INCIDENCE_COS


def _box(one: Obstacle, origin: _Rays, rays: _Rays) -> _Hits:
    cosine, sine = math.cos(one.heading_rad), math.sin(one.heading_rad)
    x_m, y_m = origin[0] - one.x_m, origin[1] - one.y_m
    at = np.stack([cosine * x_m + sine * y_m, cosine * y_m - sine * x_m])
    step = np.stack([cosine * rays[0] + sine * rays[1], cosine * rays[1] - sine * rays[0]])
    step = np.where(step == 0.0, 1e-300, step)
    half = np.array([[0.5 * one.length_m], [0.5 * one.width_m]])
    near, far = (-np.copysign(half, step) - at) / step, (np.copysign(half, step) - at) / step
    enter, leave = near.max(axis=0), far.min(axis=0)
    hit = (enter < leave) & (leave > 0.0)
    enter = np.maximum(np.where(hit, enter, 0.0), 0.0)
    normal = np.abs(np.where(near[0] > near[1], step[0], step[1]))
    from_edges_m = half - np.abs(at + enter * step)
    edge = (from_edges_m < _EDGE_M).all(axis=0)
    return np.where(hit, enter, math.inf), edge | (normal >= _INCIDENCE_COS)
