"""The measurement model for the few LEDs of one image, in plain numbers.

`measurement_model` serves thousands of cameras at once. For one camera and three LEDs most of its
time goes into the handling of small arrays; here it takes a third of it. A test holds the two
against each other.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import LEDS, MINIMUM_DEPTH_M, Lens

__all__ = ['predict_leds']


def predict_leds(
    offsets_m: Sequence[Sequence[float]],
    *,
    azimuth_rad: float,
    tilt_rad: float,
    lens: Lens,
    focal_error: float,
) -> tuple[FloatArray, list[float], FloatArray]:
    """Project LEDs and differentiate by the whole state vector.

    The equations are those of `project` and `state_jacobian`.

    Args:
        offsets_m: n LEDs minus the optical centre in `map`, metres.
        azimuth_rad: Azimuth of the optical axis in `map`.
        tilt_rad: Its tilt, upward.
        lens: The nominal lens.
        focal_error: Its relative error, as believed.

    Returns:
        (n, 2) pixels, n depths of at least 0.05 m, and the (2 n, 9 + 3 n) derivative with rows
        u_0, v_0, u_1, v_1, ...
    """
    ca, sa = math.cos(azimuth_rad), math.sin(azimuth_rad)
    ct, st = math.cos(tilt_rad), math.sin(tilt_rad)
    fx, fy, cx, cy = lens.numbers
    fx, fy = fx * (1.0 + focal_error), fy * (1.0 + focal_error)
    pixels: list[tuple[float, float]] = []
    depths: list[float] = []
    rows: list[list[float]] = []
    others = 3 * len(offsets_m)
    for led, (dx, dy, dz) in enumerate(offsets_m):
        forward = ca * dx + sa * dy
        depth = max(ct * forward + st * dz, MINIMUM_DEPTH_M)
        su, sv = (sa * dx - ca * dy) / depth, (st * forward - ct * dz) / depth
        ku, kv, rise = fx / depth, fy / depth, st - sv * ct
        ux, uy, uz = ku * (sa - su * ca * ct), -ku * (ca + su * sa * ct), -ku * su * st
        vx, vy, vz = kv * ca * rise, kv * sa * rise, -kv * (ct + sv * st)
        ray_u, ray_v = fx * su, fy * sv
        turn_u, turn_v = ux * dy - uy * dx, vx * dy - vy * dx
        row_u = [-ux, -uy, turn_u, turn_u, ray_u * sv, 0.0, 0.0, -uz, ray_u] + [0.0] * others
        row_v = [-vx, -vy, turn_v, turn_v, ray_v * sv + fy, 0.0, 0.0, -vz, ray_v] + [0.0] * others
        place = LEDS + 3 * led
        row_u[place : place + 3] = ux, uy, uz
        row_v[place : place + 3] = vx, vy, vz
        pixels.append((cx + ray_u, cy + ray_v))
        depths.append(depth)
        rows += (row_u, row_v)
    return np.array(pixels), depths, np.array(rows)
