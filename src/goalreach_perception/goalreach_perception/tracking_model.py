"""The measurement model for the few LEDs of one image, in plain numbers.

`measurement_model` serves thousands of cameras at once. For one camera and three LEDs most of its
time goes into the handling of small arrays; here it takes a third of it. A test holds the two
against each other.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import LEDS, MINIMUM_DEPTH_M, Lens


class View(NamedTuple):
    """Where a camera looks, and its lens.

    Attributes:
        azimuth_rad: Azimuth of the optical axis in `map`.
        tilt_rad: Its tilt, upward.
        lens: The nominal lens.
        focal_error: Its relative error, as believed.
    """

    azimuth_rad: float
    tilt_rad: float
    lens: Lens
    focal_error: float

    @property
    def turns(self) -> tuple[float, float, float, float]:
        """Cosine and sine of the azimuth, cosine and sine of the tilt."""
        azimuth, tilt = self.azimuth_rad, self.tilt_rad
        return math.cos(azimuth), math.sin(azimuth), math.cos(tilt), math.sin(tilt)

    @property
    def focal_px(self) -> tuple[float, float]:
        """The believed focal lengths along u and v."""
        fx, fy, _, _ = self.lens.numbers
        return fx * (1.0 + self.focal_error), fy * (1.0 + self.focal_error)


def offsets_from(
    places_m: Sequence[float], x_m: float, y_m: float, z_m: float
) -> list[tuple[float, float, float]]:
    """Return places, given one after the other as x, y, z, x, ..., relative to one of them."""
    xyz = zip(places_m[::3], places_m[1::3], places_m[2::3], strict=True)
    return [(x - x_m, y - y_m, z - z_m) for x, y, z in xyz]


class ExpectedLeds(NamedTuple):
    """Where n LEDs should be, and how that depends on the state.

    Attributes:
        pixels_px: (n, 2) pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        by_state: (2 n, 9 + 3 n) derivative by the state, rows u_0, v_0, u_1, v_1, ...
        by_head: (2 n, 2) true derivative by pan and tilt.
    """

    pixels_px: FloatArray
    depth_m: list[float]
    by_state: FloatArray
    by_head: FloatArray


def expect_leds(
    offsets_m: Sequence[Sequence[float]], view: View, first_m: Sequence[Sequence[float]]
) -> ExpectedLeds:
    """Project LEDs and differentiate by the whole state vector.

    The equations are those of `measurement_model.project` and `state_jacobian`, but for two
    things, see `PoseFilter`: the columns of heading and pan bias are those of an LED at `first_m`,
    and that of the odometry's scale is not zero, but what `first_m` lacks to be on the ray.

    Args:
        offsets_m: n LEDs minus the optical centre in `map`, metres.
        view: The camera.
        first_m: The same by the first estimates.
    """
    ca, sa, ct, st = view.turns
    fx, fy = view.focal_px
    _, _, cx, cy = view.lens.numbers
    pixels, rows, by_head = array('d'), array('d'), array('d')
    depths: list[float] = []
    others = [0.0] * (3 * len(offsets_m))
    places = range(LEDS, LEDS + len(others), 3)
    for place, (dx, dy, dz), (tx, ty, tz) in zip(places, offsets_m, first_m, strict=True):
        forward = ca * dx + sa * dy
        depth = max(ct * forward + st * dz, MINIMUM_DEPTH_M)
        su, sv = (sa * dx - ca * dy) / depth, (st * forward - ct * dz) / depth
        ku, kv, rise = fx / depth, fy / depth, st - sv * ct
        ux, uy, uz = ku * (sa - su * ca * ct), -ku * (ca + su * sa * ct), -ku * su * st
        vx, vy, vz = kv * ca * rise, kv * sa * rise, -kv * (ct + sv * st)
        ray_u, ray_v = fx * su, fy * sv
        tilt_u, tilt_v = ray_u * sv, ray_v * sv + fy
        turn_u, turn_v = ux * ty - uy * tx, vx * ty - vy * tx
        off_u, off_v = -(ux * tx + uy * ty + uz * tz), -(vx * tx + vy * ty + vz * tz)
        row_u = [-ux, -uy, turn_u, turn_u, tilt_u, off_u, 0.0, -uz, ray_u, *others]
        row_v = [-vx, -vy, turn_v, turn_v, tilt_v, off_v, 0.0, -vz, ray_v, *others]
        row_u[place : place + 3] = ux, uy, uz
        row_v[place : place + 3] = vx, vy, vz
        rows.extend(row_u + row_v)
        by_head.extend((ux * dy - uy * dx, tilt_u, vx * dy - vy * dx, tilt_v))
        pixels.extend((cx + ray_u, cy + ray_v))
        depths.append(depth)
    by_state = np.frombuffer(rows).reshape(2 * len(depths), -1)
    return ExpectedLeds(
        np.frombuffer(pixels).reshape(-1, 2),
        depths,
        by_state,
        np.frombuffer(by_head).reshape(-1, 2),
    )
