"""Obstacles of the MuJoCo world, standing or on tracks, and the ring of sonars that hears them.

Metres, seconds and radians, as in the arena's file; a range counts from the robot's axis.
"""

from __future__ import annotations

from itertools import pairwise, starmap
import math
from typing import Any

import mujoco
import numpy as np

ROOM, OCCLUDERS = 0, 2  # groups of geoms: what stands in the room; the same in black before lights
INCH_M = 0.0254
NEAREST_M, FARTHEST_M = 6 * INCH_M, 255 * INCH_M  # of an echo, from the sensor
SONAR_M, SONAR_Z_M = 0.205, 0.2  # from the axis, 2 cm behind what a bumper touches; height
AXES = np.arange(16) * math.tau / 16
FAN = np.radians(np.linspace(-12.5, 12.5, 9))  # rays of a beam of 25 degrees
INCIDENCE_COS = math.cos(math.radians(15))  # met further off its normal, a surface is silent
EDGE_M = 0.05  # nearer than this to an upright edge, a box scatters sound
ERROR, LOST = 0.01, 0.02  # of a range (1 sigma); share of the echoes that are missed


def add_obstacles(spec: Any, arena: dict[str, Any]) -> None:
    """Add the obstacles of an arena's file: bodies that move on their tracks or stand."""
    for number, one in enumerate(arena.get('obstacles', [])):
        half_m, turn = one.get('height_m', 0.6) / 2, math.radians(one.get('heading_deg', 0)) / 2
        quat = [math.cos(turn), 0, 0, math.sin(turn)]
        place = {'pos': [one['x_m'], one['y_m'], half_m], 'quat': quat}
        body = spec.worldbody.add_body(name=f'obstacle{number}', mocap=True, **place)
        if 'radius_m' in one:
            kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [one['radius_m'], half_m, 0]
        else:
            kind, size = (
                mujoco.mjtGeom.mjGEOM_BOX,
                [one['length_m'] / 2, one['width_m'] / 2, half_m],
            )
        body.add_geom(spec.find_default('obstacle'), type=kind, size=size)
        body.add_geom(spec.find_default('occluder'), type=kind, size=size)


class Track:
    """A closed polygon, driven at a constant speed until something is in the way."""

    def __init__(self, one: dict[str, Any]) -> None:
        start = one['x_m'], one['y_m']
        self.corners = [start, *map(tuple, one.get('track_m', [])), start]
        self.lap_m = sum(starmap(math.dist, pairwise(self.corners)))
        self.speed, self.driven_m = float(one.get('speed_m_per_s', 0)), 0.0

    def place(self) -> tuple[Any, Any]:
        """Return where it is, and the unit vector along the track."""
        left_m = self.driven_m % self.lap_m
        for one, other in pairwise(self.corners):
            length_m = math.dist(one, other)
            if left_m < length_m:
                break
            left_m -= length_m
        along = np.subtract(other, one) / length_m
        return one + min(left_m, length_m) * along, along


class Obstacles:
    """The obstacles at work: their motion, and how far it is to them."""

    def __init__(self, model: Any, data: Any, arena: dict[str, Any], seed: int) -> None:
        self.model, self.data, self.rng = model, data, np.random.default_rng([seed, 2])
        self.listed, self.ring = arena.get('obstacles', []), model.geom('ring').id
        self.size = arena['width_m'], arena['length_m']
        self.sonar = bool(self.listed) or arena.get('sonar', False)
        self.bodies = [model.body(f'obstacle{n}') for n in range(len(self.listed))]
        self.restart()

    def restart(self) -> None:
        """Begin at the starts of all tracks."""
        tracks = [Track(one) for one in self.listed]
        moving = zip(self.bodies, tracks, strict=True)
        self.tracks = {body.id: track for body, track in moving if track.lap_m * track.speed}

    def leave(self, x: float, y: float) -> bool:
        """Return whether they leave room for the robot, where tracks begin, and the walls do."""
        body, gaps = self.model.geom_size[self.ring, 0], [x, y, self.size[0] - x, self.size[1] - y]
        for one in self.listed:
            turn = np.exp(-1j * math.radians(one.get('heading_deg', 0)))
            own = complex(x - one['x_m'], y - one['y_m']) * turn
            aside = max(abs(own.real) - one.get('length_m', 0) / 2, 0)
            ahead = max(abs(own.imag) - one.get('width_m', 0) / 2, 0)
            gaps.append(math.hypot(aside, ahead) - one.get('radius_m', 0))
        return bool(min(gaps) >= body)

    def touched(self) -> dict[int, Any]:
        """Return the bodies that the robot touches, with the direction from each to the robot."""
        touched = {}
        owner = self.model.geom_bodyid
        for contact in self.data.contact:
            one, other = contact.geom
            if self.ring in (one, other):
                body = owner[one] if other == self.ring else owner[other]
                touched[int(body)] = contact.frame[:2] * (1 if other == self.ring else -1)
        return touched

    def move(self, step_s: float) -> None:
        """Move what moves; who runs into the robot turns back along his track."""
        touched = self.touched() if self.tracks else {}
        for body, track in self.tracks.items():
            at, along = track.place()
            if body in touched and track.speed * along @ touched[body] > 0:
                track.speed *= -1
            track.driven_m += track.speed * step_s
            self.data.mocap_pos[self.model.body_mocapid[body], :2] = at

    def hear(self) -> list[float]:
        """Return the range of each sonar, counter-clockwise from the front of the robot's base.

        The nearest ray of a beam that is reflected counts; without one the range is infinite.
        """
        x, y, _, w, _, _, z = self.data.qpos[:7]
        heading = 2 * math.atan2(z, w)
        heard = np.full(len(AXES), math.inf)
        for number, axis in enumerate(AXES + heading):
            eye = x + SONAR_M * math.cos(axis), y + SONAR_M * math.sin(axis), SONAR_Z_M
            for range_m, echoes in self._rays(np.array(eye), axis + FAN):
                if echoes:
                    heard[number] = min(heard[number], max(range_m, NEAREST_M))
        heard *= 1 + ERROR * self.rng.standard_normal(len(heard))
        heard[self.rng.random(len(heard)) < LOST] = math.inf
        return [float(range_m) + SONAR_M for range_m in heard]

    def _rays(self, eye: Any, azimuths: Any) -> list[tuple[float, bool]]:
        """Return the length of each ray up to a surface, and whether that reflects sound."""
        count, group = len(azimuths), (np.arange(6) == ROOM).astype(np.uint8)
        rays = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(count)], axis=1)
        geoms, ranges, normals = np.zeros(count, np.int32), np.zeros(count), np.zeros(3 * count)
        scene, found = (self.model, self.data, eye, rays.ravel()), (geoms, ranges, normals)
        mujoco.mj_multiRay(*scene, group, 1, -1, *found, count, FARTHEST_M)
        straight = -(rays * normals.reshape(-1, 3)).sum(1) >= INCIDENCE_COS
        ends = zip(geoms, eye + rays * ranges[:, None], straight, strict=True)
        echoes = [
            bool(geom >= 0 and (good or self._edge(int(geom), end))) for geom, end, good in ends
        ]
        return list(zip(ranges.tolist(), echoes, strict=True))

    def _edge(self, geom: int, at: Any) -> bool:
        """Return whether a point lies near an upright edge of an obstacle that is a box."""
        is_box = self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
        if not is_box or self.model.geom_bodyid[geom] == 0:
            return False
        own = (at - self.data.geom_xpos[geom]) @ self.data.geom_xmat[geom].reshape(3, 3)
        return bool(np.all(np.abs(own[:2]) > self.model.geom_size[geom, :2] - EDGE_M))
