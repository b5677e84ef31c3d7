"""What may break while the robot drives: switched on and off by parameters of the node.

Chance errors of sound sensors are in the noise model; these are faults, for tests of what comes
after them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import check_fields, parameter

_BUMPERS = 20


@dataclass(frozen=True, kw_only=True)
class SimulatedFaults:
    """What is broken now; nothing by default."""

    dark_leds: tuple[float, ...] = parameter(
        (), 'LEDs that do not shine, by number from 0', minimum=0.0, maximum=1000.0
    )
    extra_light_m: tuple[float, ...] = parameter(
        (), 'A light that is no LED: x, y, z in map, m; empty: none', minimum=-100.0, maximum=100.0
    )
    camera_frozen: bool = parameter(False, 'Whether the camera sends its last image again')
    odometry_frozen: bool = parameter(False, 'Whether the wheel encoders stand still')
    stuck_bumper: int = parameter(
        -1, 'Tactile sensor that stays pressed, from 0; -1: none', minimum=-1, maximum=_BUMPERS - 1
    )
    carry_to: tuple[float, ...] = parameter(
        (),
        'Somebody puts the robot down there, its wheels in the air: x, y (m), heading (rad); it '
        'happens when the value changes',
        minimum=-100.0,
        maximum=100.0,
    )

    def __post_init__(self) -> None:
        """Check every field, and that points are points."""
        check_fields(self)
        for name in ('extra_light_m', 'carry_to'):
            if len(getattr(self, name)) not in (0, 3):
                raise ConfigurationError(name, getattr(self, name), 'three numbers or none')
        if any(number != int(number) for number in self.dark_leds):
            raise ConfigurationError('dark_leds', self.dark_leds, 'whole numbers')


@dataclass(frozen=True, kw_only=True)
class FaultParameters:
    """The faults under the name `faults`, as the node declares them."""

    faults: SimulatedFaults = field(default_factory=SimulatedFaults)
