"""Images of AprilTags with perspective, blur and noise, drawn apart from what detects them."""

from __future__ import annotations

from collections.abc import Sequence
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.tags import Tag
from goalreach_msgs_py.values import FloatArray, Pose2

EYE_M = 1.1
CAMERA = PinholeCamera(
    width_px=640, height_px=480, fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5
)
SIX_TAGS = tuple(
    Tag(id=k, size_m=0.2, x_m=x, y_m=y, z_m=z, facing_rad=math.radians(facing))
    for k, (x, y, z, facing) in enumerate(
        [(0.8, 0.0, 1.3, 90), (2.7, 0.0, 1.2, 90), (3.556, 2.0, 1.35, 180),
         (2.6, 5.08, 1.25, -90), (0.9, 5.08, 1.3, -90), (0.0, 2.8, 1.2, 0)]
    )
)  # fmt: skip
_FINE, _CELL = 4, 16
_DICTIONARY = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def in_camera(points_m: FloatArray, pose: Pose2) -> FloatArray:
    """Return points in the frame of a level camera that looks ahead: right, down, forward."""
    away_m = points_m - np.array([pose.x_m, pose.y_m, EYE_M])
    cosine, sine = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    right, forward = away_m @ [sine, -cosine, 0.0], away_m @ [cosine, sine, 0.0]
    return np.stack([right, -away_m[:, 2], forward], axis=1)


def tag_image(
    tags: Sequence[Tag],
    pose: Pose2,
    rng: np.random.Generator,
    *,
    camera: PinholeCamera = CAMERA,
    blur_px: float = 0.8,
    noise_dn: float = 3.0,
) -> NDArray[np.uint8]:
    """Return what a camera sees of tags on a grey wall: white 200, black 40, wall 120."""
    size = camera.width_px * _FINE, camera.height_px * _FINE
    light = np.full(size[::-1], 120.0, np.float32)
    for tag in tags:
        right, up, out = tag.axes
        centre = np.array([tag.x_m, tag.y_m, tag.z_m])
        sides = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * 0.625 * tag.size_m
        paper_m = centre + sides[:, :1] * right + sides[:, 1:] * up
        seen = in_camera(paper_m, pose)
        if seen[:, 2].min() < 0.1 or out @ (np.array([pose.x_m, pose.y_m, EYE_M]) - centre) < 0:
            continue
        corners = ((camera.project(seen) + 0.5) * _FINE - 0.5).astype(np.float32)
        marker = cv2.aruco.generateImageMarker(_DICTIONARY, tag.id, 8 * _CELL)
        page = np.pad(marker, _CELL, constant_values=255)
        edges = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32) * 10 * _CELL - 0.5
        turn = cv2.getPerspectiveTransform(edges, corners)
        drawn = cv2.warpPerspective(page.astype(np.float32) / 255 * 160 + 40, turn, size)
        cover = cv2.warpPerspective(np.ones_like(page), turn, size, flags=cv2.INTER_NEAREST)
        light = np.where(cover > 0, drawn, light)
    light = cv2.GaussianBlur(light, (0, 0), blur_px * _FINE)
    pixels = light.reshape(camera.height_px, _FINE, camera.width_px, _FINE).mean((1, 3))
    pixels += rng.normal(0.0, noise_dn, pixels.shape)
    return np.asarray(np.clip(np.rint(pixels), 0, 255), np.uint8)
