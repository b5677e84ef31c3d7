"""Posts that hide LEDs: upright cylinders on the floor."""

from __future__ import annotations

from collections.abc import Sequence
import math

__all__ = ['Post', 'is_hidden', 'posts_from_flat']

Post = tuple[float, float, float, float]
"""x and y of its axis in `map`, radius, height: metres."""


def posts_from_flat(values: Sequence[float]) -> tuple[Post, ...]:
    """Return the posts of a flat sequence x, y, radius, height, x, y, ..."""
    numbers = iter(values)
    return tuple(zip(numbers, numbers, numbers, numbers, strict=True))


def is_hidden(camera_m: Sequence[float], led_m: Sequence[float], posts: Sequence[Post]) -> bool:
    """Return whether a post stands in the line of sight from the camera to an LED.

    Args:
        camera_m: Optical centre x, y, z in `map`.
        led_m: LED x, y, z in `map`.
        posts: The posts.
    """
    x_m, y_m, z_m = camera_m
    dx_m, dy_m, dz_m = (led_m[k] - camera_m[k] for k in range(3))
    square = dx_m * dx_m + dy_m * dy_m
    if square == 0.0:
        return False
    for post_x_m, post_y_m, radius_m, height_m in posts:
        nearest = ((post_x_m - x_m) * dx_m + (post_y_m - y_m) * dy_m) / square
        gap_x_m = x_m + nearest * dx_m - post_x_m
        gap_y_m = y_m + nearest * dy_m - post_y_m
        chord = radius_m * radius_m - gap_x_m * gap_x_m - gap_y_m * gap_y_m
        if chord <= 0.0:
            continue
        half = math.sqrt(chord / square)
        enter, leave = max(nearest - half, 0.0), min(nearest + half, 1.0)
        if enter < leave and z_m + min(enter * dz_m, leave * dz_m) <= height_m:
            return True
    return False
