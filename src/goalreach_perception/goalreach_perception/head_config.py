"""Ranges of the head and habits of the landmark tracker."""

from __future__ import annotations

from dataclasses import dataclass
import math

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.units import deg

__all__ = ['HeadConfig']

_RIGHT_ANGLE = math.pi / 2


@dataclass(frozen=True, kw_only=True)
class HeadConfig:
    """Ranges of the head and habits of its tracker."""

    pan_limit_rad: float = parameter(
        deg(87.0),
        'Pan range to each side, rad (the paper: 174 deg in all)',
        minimum=0.0,
        maximum=math.pi,
    )
    tilt_minimum_rad: float = parameter(
        deg(-20.0),
        'Lower end of the tilt range, rad (the paper: 70 deg in all; its place is chosen)',
        minimum=-_RIGHT_ANGLE,
        maximum=_RIGHT_ANGLE,
    )
    tilt_maximum_rad: float = parameter(
        deg(50.0),
        'Upper end of the tilt range, rad (the paper: 70 deg in all; its place is chosen)',
        minimum=-_RIGHT_ANGLE,
        maximum=_RIGHT_ANGLE,
    )
    view_margin_px: float = parameter(
        24.0,
        'An LED nearer than this to the border of the image is not in view, px (chosen)',
        minimum=0.0,
        maximum=1000.0,
    )
    search_tilt_rad: float = parameter(
        deg(20.0),
        'Tilt while searching, rad (chosen: LEDs rise 3.5 deg and more)',
        minimum=-_RIGHT_ANGLE,
        maximum=_RIGHT_ANGLE,
    )
    search_high_tilt_rad: float = parameter(
        deg(40.0),
        'Tilt in every other turn of the search, rad (chosen: LEDs that are near)',
        minimum=-_RIGHT_ANGLE,
        maximum=_RIGHT_ANGLE,
    )
    search_turn_rad: float = parameter(
        deg(400.0),
        'How far the turret turns before the search changes its tilt, rad (chosen: more than a '
        'full circle at each tilt)',
        minimum=0.1,
        maximum=20.0,
    )
    search_lead_rad: float = parameter(
        deg(150.0),
        'How far ahead of itself the turret is sent while searching, rad (chosen: beyond its '
        'braking distance at 90 deg/s)',
        minimum=0.0,
        maximum=3.0,
    )

    def __post_init__(self) -> None:
        """Check every field, and that the tilt range is one."""
        check_fields(self)
        if self.tilt_minimum_rad > self.tilt_maximum_rad:
            raise ConfigurationError(
                'tilt_minimum_rad', self.tilt_minimum_rad, f'at most {self.tilt_maximum_rad:g}'
            )

    def clip_tilt(self, tilt_rad: float) -> float:
        """Return the nearest tilt within the range."""
        return min(max(tilt_rad, self.tilt_minimum_rad), self.tilt_maximum_rad)
