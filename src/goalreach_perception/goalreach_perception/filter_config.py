"""Process noise and gates of the pose filter."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.units import deg

__all__ = ['FilterConfig']


@dataclass(frozen=True, kw_only=True)
class FilterConfig:
    """Process noise and gates of the filter."""

    slip_m_per_sqrt_m: float = parameter(
        0.0002,
        'Random part of the odometry, m per square root of a metre (1 sigma; chosen: small beside '
        'the errors of scale and drift, which are states; with five times as much the covariance '
        'was a tenth too large)',
        minimum=0.0,
        maximum=1.0,
    )
    heading_walk_rad_per_sqrt_m: float = parameter(
        deg(0.004),
        'Random part of the heading, rad per square root of a metre (1 sigma; chosen as above)',
        minimum=0.0,
        maximum=1.0,
    )
    memory_s: float = parameter(
        1e5,
        'How long biases and calibration are remembered, s (time constant; chosen: about a day; '
        'then small errors that repeat from image to image do not add up to false certainty)',
        minimum=1.0,
        maximum=1e9,
    )
    led_gate: float = parameter(
        16.0, 'Largest squared distance of one LED from its prediction, 2 dof', minimum=1.0
    )
    joint_gate: float = parameter(
        32.0, 'Largest squared distance of all LEDs of an image together (p = 2e-5)', minimum=1.0
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)
