"""An ordered search for landmarks with turret, pan and tilt."""

from __future__ import annotations

import math

from goalreach_msgs_py.values import HeadAngles
from goalreach_perception.head_config import HeadConfig

__all__ = ['HeadSearch']

_AT_END_RAD = math.radians(4.0)


class HeadSearch:
    """Turns the head until something is found.

    The turret turns one way all the time. Pan first swings to the end the turret comes from,
    then to the end it goes to, and stays there: all azimuths are seen once within three seconds
    of a Nomad 200's motors, and again with every turn of the turret. After a little more than a
    turn the tilt changes between low and high, which is for LEDs that are near.

    Args:
        config: Ranges and habits of the head.
    """

    def __init__(self, config: HeadConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Begin anew with the next call of `step`."""
        self._turret_sign = 0.0
        self._towards_end = False
        self._last_turret_rad = 0.0
        self._turned_rad = 0.0

    def step(self, joints: HeadAngles) -> HeadAngles:
        """Return joint targets that look for landmarks.

        Args:
            joints: Encoder readings.
        """
        config = self._config
        limit = config.pan_limit_rad
        if self._turret_sign == 0.0:
            self._turret_sign = -1.0 if joints.pan_rad > 0.0 else 1.0
            self._last_turret_rad = joints.turret_rad
        if joints.pan_rad * self._turret_sign < -limit + _AT_END_RAD:
            self._towards_end = True
        turned = math.remainder(joints.turret_rad - self._last_turret_rad, math.tau)
        self._turned_rad += abs(turned)
        self._last_turret_rad = joints.turret_rad
        high = self._turned_rad % (2.0 * config.search_turn_rad) > config.search_turn_rad
        return HeadAngles(
            turret_rad=joints.turret_rad + self._turret_sign * config.search_lead_rad,
            pan_rad=(1.0 if self._towards_end else -1.0) * self._turret_sign * limit,
            tilt_rad=config.clip_tilt(
                config.search_high_tilt_rad if high else config.search_tilt_rad
            ),
        )
