"""How brightly an LED shines at the camera."""

from __future__ import annotations

import math

import numpy as np

from goalreach_msgs_py.values import FloatArray

__all__ = ['emission', 'emission_axes', 'emission_exponent']


def emission_axes(landmarks_m: FloatArray, width_m: float, length_m: float) -> FloatArray:
    """Return the direction in which each LED shines: into the arena, away from its wall.

    Args:
        landmarks_m: (n, 3) LEDs in `map`.
        width_m: Arena size along x.
        length_m: Arena size along y.

    Returns:
        (n, 3) level unit vectors, the inward normal of the nearest wall; the goal wall first
        where two are as near.
    """
    normals = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    x_m, y_m = landmarks_m[:, 0], landmarks_m[:, 1]
    gaps_m = np.stack([y_m, x_m, width_m - x_m, length_m - y_m], axis=1)
    axes: FloatArray = normals[np.argmin(gaps_m, axis=1)]
    return axes


def emission_exponent(half_angle_rad: float) -> float:
    """Return the exponent n for which cos(angle / 2)^n is one half at the half angle."""
    return math.log(0.5) / math.log(math.cos(half_angle_rad / 2.0))


def emission(cosine: float, exponent: float) -> float:
    """Return the strength of an LED off its axis, relative to that on its axis.

    A domed LED: cos(angle / 2)^n, smooth from one on the axis to nothing straight behind.

    Args:
        cosine: Cosine of the angle between its axis and the line of sight.
        exponent: As `emission_exponent` gives it.
    """
    squared = 0.5 * (1.0 + cosine)  # cos^2 of half the angle
    return float(squared ** (0.5 * exponent)) if squared > 0.0 else 0.0
