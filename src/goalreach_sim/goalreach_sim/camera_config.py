"""The optics of the simulated camera and its LEDs."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.units import deg

__all__ = ['OpticsConfig']


@dataclass(frozen=True, kw_only=True)
class OpticsConfig:
    """How light becomes grey values; none of these figures is in the paper."""

    dark_offset_dn: float = parameter(
        10.0, 'Mean grey value without light; chosen', minimum=0.0, maximum=100.0
    )
    led_flux_dn: float = parameter(
        18000.0,
        'Sum of the grey values of an LED 1 m away on its axis; chosen so that its peak is 75 at '
        '5 m',
        minimum=0.0,
        maximum=1e7,
    )
    led_radius_m: float = parameter(
        0.0025,
        'Radius of the glowing disc of an LED, m; a common 5 mm LED',
        minimum=0.0,
        maximum=0.1,
    )
    led_half_angle_rad: float = parameter(
        deg(60),
        'Angle from its axis at which an LED shines half as strongly, rad; chosen',
        minimum=deg(5),
        maximum=deg(175),
    )
    shot_noise: float = parameter(
        0.0,
        'Shot noise of light: standard deviation over the root of the grey value; 0 for none',
        minimum=0.0,
        maximum=10.0,
    )
    rolling_exposure_s: float = parameter(
        0.0,
        'Time from the exposure of the top row to that of the bottom row, which is at the stamp, '
        's; 0 where all rows are exposed at once, as by the CCD of the robot',
        minimum=0.0,
        maximum=1.0,
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)
