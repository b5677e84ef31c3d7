"""Closed-form first guesses of a pose from what one image shows of LEDs at known places.

Both work in the plane with complex numbers, on many labellings at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray

ComplexArray = NDArray[np.complex128]

_TINY = 1e-12


def level_points(slopes: FloatArray, rise_m: FloatArray, tilt_rad: FloatArray) -> ComplexArray:
    """Return where LEDs of known height stand in the levelled frame of the camera.

    A ray (s_u, s_v, 1) of a camera tilted by T runs cos T + sin T s_v forward, s_u to the right
    and sin T - cos T s_v up; it is followed until it has risen to the height of the LED.

    Args:
        slopes: (..., 2) of (pixel - centre) / focal length.
        rise_m: (...) height of the LED above the optical centre, metres.
        tilt_rad: (...) tilt, upward.

    Returns:
        (...) forward + left * 1j, metres; NaN where the ray never gets to that height.
    """
    forward = np.cos(tilt_rad) + np.sin(tilt_rad) * slopes[..., 1]
    up = np.sin(tilt_rad) - np.cos(tilt_rad) * slopes[..., 1]
    with np.errstate(divide='ignore', invalid='ignore'):
        stretch = rise_m / up
    stretch = np.where(stretch > 0.0, stretch, np.nan)
    return np.asarray(stretch * (forward - 1j * slopes[..., 0]), dtype=np.complex128)


def align(places_m: ComplexArray, seen_m: ComplexArray) -> FloatArray:
    """Return the pose that moves what is seen onto the map: least squares, closed form.

    Args:
        places_m: (m, k) LEDs in `map`, x + y * 1j.
        seen_m: (m, k) the same in the levelled camera frame, forward + left * 1j; k >= 2.

    Returns:
        (m, 3) of x, y, azimuth.
    """
    middle_m, seen_middle_m = places_m.mean(axis=1), seen_m.mean(axis=1)
    turn: ComplexArray = (
        (places_m - middle_m[:, None]) * np.conj(seen_m - seen_middle_m[:, None])
    ).sum(axis=1)
    with np.errstate(invalid='ignore'):
        turn /= np.maximum(np.abs(turn), _TINY)
    position_m = middle_m - turn * seen_middle_m
    return np.stack([position_m.real, position_m.imag, np.angle(turn)], axis=1)


def triangulate(places_m: ComplexArray, rays: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the pose from the directions to three LEDs alone, heights not used.

    Three-object triangulation by intersecting circles, as in Pierlot and Van Droogenbroeck,
    "A New Three Object Triangulation Algorithm for Mobile Robot Positioning" (IEEE T-RO 2014),
    derived anew: with the second LED as origin, the places R that see LEDs 1 and 2 under the
    directed angle a are the circle sin(a) |R|^2 = Re(conj(R) (-i) B1 exp(i a)), and those that
    see 2 and 3 under b are sin(b) |R|^2 = Re(conj(R) i B3 exp(-i b)). Both circles pass through
    the origin; the line through their other meeting point is square to
    n = sin(b) (-i) B1 exp(i a) - sin(a) i B3 exp(-i b). When the two circles are one
    (the danger circle), n is zero.

    Args:
        places_m: (m, 3) LEDs in `map`, x + y * 1j.
        rays: (m, 3) unit directions in the levelled camera frame, forward + left * 1j.

    Returns:
        (m, 3) of x, y, azimuth, and (m,) the quality |n| / (|B1| + |B3|): zero where the
        geometry is singular, at most one.
    """
    origin_m = places_m[:, 1]
    first_m, third_m = places_m[:, 0] - origin_m, places_m[:, 2] - origin_m
    turn_12 = rays[:, 1] * np.conj(rays[:, 0])
    turn_23 = rays[:, 2] * np.conj(rays[:, 1])
    circle_12 = -1j * first_m * turn_12
    circle_23 = 1j * third_m * np.conj(turn_23)
    normal = turn_23.imag * circle_12 - turn_12.imag * circle_23
    across = 1j * normal
    length2 = np.maximum(np.abs(normal) ** 2, _TINY**2)
    use_first = np.abs(turn_12.imag) >= np.abs(turn_23.imag)
    circle = np.where(use_first, circle_12, circle_23)
    sine = np.where(use_first, turn_12.imag, turn_23.imag)
    sine = np.where(np.abs(sine) < _TINY, _TINY, sine)
    offset_m = across * (np.conj(across) * circle).real / (sine * length2)
    azimuth = np.angle(-(offset_m * np.conj(rays[:, 1])))
    position_m = origin_m + offset_m
    pose = np.stack([position_m.real, position_m.imag, azimuth], axis=1)
    quality = np.abs(normal) / np.maximum(np.abs(first_m) + np.abs(third_m), _TINY)
    return pose, quality
