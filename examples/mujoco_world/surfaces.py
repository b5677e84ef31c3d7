"""Walls of the MuJoCo world, their texture, printed AprilTags on them, and its lights."""

from __future__ import annotations

import argparse
import math
from typing import Any

import cv2
import mujoco
import numpy as np


def add_surfaces(spec: Any, arena: dict[str, Any], rng: Any) -> None:
    """Add walls and tags."""
    add, wall = spec.worldbody.add_geom, spec.find_default('wall')
    width, length = arena['width_m'], arena['length_m']
    for y in (-0.05, length + 0.05):
        add(wall, pos=[width / 2, y, 1.5], size=[width / 2 + 0.1, 0.05, 1.5])
    for x in (-0.05, width + 0.05):
        add(wall, pos=[x, length / 2, 1.5], size=[0.05, length / 2 + 0.1, 1.5])
    for tag in arena.get('tags', []):
        hang(spec, tag, rng)


def add_lights(spec: Any, arena: dict[str, Any], options: argparse.Namespace, rng: Any) -> None:
    """Add the LEDs and what options ask for: lamps, and reflections of all in the floor."""
    add, light = spec.worldbody.add_geom, spec.find_default('light')
    width, length = arena['width_m'], arena['length_m']
    leds_m = rng.normal(arena.get('leds_m', []), 0.0025)
    lights = [(*led_m, options.led_radius / 1000, 3 / options.led_radius) for led_m in leds_m]
    if options.lamps:  # a bulb, and one that looks like an LED
        lights += [(0.3 * width, 0.05, 2.2, 0.03, 0.8), (width, 0.6 * length, 1.5, 0.005, 0.4)]
    if options.reflections:  # their mirror images in the floor
        lights += [(x, y, -z, radius, 0.15 * share) for x, y, z, radius, share in lights]
    for x, y, z, radius, share in lights:  # red: how much light; green: that there is a light
        add(light, pos=[x, y, z], size=[radius, 0, 0], rgba=[min(share, 1), 1, 0, 1])


def paint_walls(model: Any, options: argparse.Namespace, rng: Any) -> None:
    """Give walls and floor their grey value and texture."""
    grey = np.full((512, 512), options.ambient)
    for size in (4, 16, 64, 256) if options.texture else ():
        grey *= cv2.resize(rng.uniform(0.8, 1.2, (size, size)), (512, 512))
    model.tex_data[: 3 * grey.size] = np.repeat(grey.clip(0, 255), 3)


def hang(spec: Any, tag: dict[str, Any], rng: Any) -> None:
    """Hang a printed AprilTag of the family 36h11, not quite where it should be."""
    family, name = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), str(tag['id'])
    cells = np.pad(cv2.aruco.generateImageMarker(family, tag['id'], 8), 1, constant_values=255)
    page = np.kron(cells, np.full((256, 256), 0.6)) + 25
    ink = np.repeat(cv2.resize(page, (512, 512), interpolation=cv2.INTER_AREA), 3).astype(int)
    flat = mujoco.mjtTexture.mjTEXTURE_2D
    spec.add_texture(name=name, type=flat, width=512, height=512, nchannel=3, data=ink.tolist())
    spec.add_material(name=name).textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    facing = math.radians(tag['facing_deg']) + rng.normal(0, 0.01)
    out, half = np.array([math.cos(facing), math.sin(facing), 0]), facing / 2 + math.pi / 4
    wrong, side = rng.normal(0, 0.0025, 3), 0.625 * tag['size_m']
    wrong += max(0.003 - wrong @ out, 0) * out  # no paper lies inside its wall
    spec.worldbody.add_geom(
        spec.find_default('page'), size=[side, side, 1], material=name,
        pos=[tag[f'{axis}_m'] + error for axis, error in zip('xyz', wrong, strict=True)],
        quat=2 * [math.cos(half)] + 2 * [math.sin(half)],
    )  # fmt: skip
