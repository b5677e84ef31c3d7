"""What the robot's motors can do."""

from __future__ import annotations

from dataclasses import dataclass

from goalreach_msgs_py.angles import deg, inches
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import check_fields, parameter


@dataclass(frozen=True, kw_only=True)
class DriveConfig:
    """Limits of the three motor axes: translation, steering, turret."""

    translation_speed_m_per_s: float = parameter(
        inches(20),
        'Top translation speed, m/s; laboratories report 20 and 24 in/s, the latter is the limit',
        minimum=0.01,
        maximum=inches(24),
    )
    steering_speed_rad_per_s: float = parameter(
        deg(60),
        'Top steering rate, rad/s; 60 deg/s by two laboratories',
        minimum=0.01,
        maximum=deg(360),
    )
    turret_speed_rad_per_s: float = parameter(
        deg(90),
        'Top turret rate, rad/s; 90 deg/s by two laboratories',
        minimum=0.01,
        maximum=deg(360),
    )
    translation_acceleration_m_per_s2: float = parameter(
        inches(30),
        "Translation acceleration, m/s^2; 30 in/s^2 is the Player driver's default",
        minimum=0.01,
        maximum=10.0,
    )
    steering_acceleration_rad_per_s2: float = parameter(
        deg(30),
        "Steering acceleration, rad/s^2; 30 deg/s^2 is the Player driver's default",
        minimum=0.01,
        maximum=100.0,
    )
    turret_acceleration_rad_per_s2: float = parameter(
        deg(30),
        "Turret acceleration, rad/s^2; 30 deg/s^2 is the Player driver's default",
        minimum=0.01,
        maximum=100.0,
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)


@dataclass(frozen=True, kw_only=True)
class HeadConfig:
    """Limits of the pan/tilt head; the paper gives ranges of 174 and 70 degrees, no rates."""

    pan_minimum_rad: float = parameter(
        deg(-87), 'Lower end of pan, rad; the paper: a range of 174 deg', minimum=-3.2, maximum=0.0
    )
    pan_maximum_rad: float = parameter(
        deg(87), 'Upper end of pan, rad; the paper: a range of 174 deg', minimum=0.0, maximum=3.2
    )
    tilt_minimum_rad: float = parameter(
        deg(-20), 'Lower end of tilt, rad; the paper: a range of 70 deg', minimum=-1.5, maximum=0.0
    )
    tilt_maximum_rad: float = parameter(
        deg(50), 'Upper end of tilt, rad; the paper: a range of 70 deg', minimum=0.0, maximum=1.5
    )
    rate_rad_per_s: float = parameter(
        deg(90),
        'Rate of the pan and tilt servos, rad/s; chosen, not from a source',
        minimum=0.01,
        maximum=deg(720),
    )
    encoder_resolution_rad: float = parameter(
        0.0,
        'Step of the pan and tilt encoders, rad; 0 for none. Chosen, not from a source',
        minimum=0.0,
        maximum=0.1,
    )

    def __post_init__(self) -> None:
        """Check every field, and that the ranges are not empty."""
        check_fields(self)
        for axis in ('pan', 'tilt'):
            low, high = getattr(self, f'{axis}_minimum_rad'), getattr(self, f'{axis}_maximum_rad')
            if low >= high:
                raise ConfigurationError(f'{axis}_maximum_rad', high, f'more than {low:g}')
