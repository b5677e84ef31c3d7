"""The pan/tilt head: two servos with noisy, biased encoders."""

from dataclasses import KW_ONLY, dataclass
import math

import numpy as np

from goalreach_sim.simulator_config import HeadConfig


@dataclass(kw_only=True)
class Servo:
    """A servo that turns to its target at a constant rate; exact for any step length.

    Its position is the angle by its own encoder, before noise.
    """

    minimum_rad: float
    maximum_rad: float
    rate_rad_per_s: float
    position_rad: float = 0.0
    _target_rad: float = 0.0

    @property
    def velocity_rad_per_s(self) -> float:
        """Present rate of rotation."""
        to_go_rad = self._target_rad - self.position_rad
        return math.copysign(self.rate_rad_per_s, to_go_rad) if to_go_rad else 0.0

    def place(self, position_rad: float) -> None:
        """Set the position, at rest."""
        self.position_rad = self._target_rad = position_rad

    def go_to(self, target_rad: float) -> None:
        """Set the target, clipped to the range.

        Raises:
            ValueError: The target is not finite.
        """
        if not math.isfinite(target_rad):
            raise ValueError(f'target {target_rad!r} is not finite')
        self._target_rad = min(max(target_rad, self.minimum_rad), self.maximum_rad)

    def advance(self, dt_s: float) -> None:
        """Simulate a time."""
        reach_rad = self.rate_rad_per_s * dt_s
        to_go_rad = self._target_rad - self.position_rad
        if abs(to_go_rad) <= reach_rad:
            self.position_rad = self._target_rad
        else:
            self.position_rad += math.copysign(reach_rad, to_go_rad)


@dataclass
class PanTiltHead:
    """Pan and tilt servos with mounting errors and encoder noise.

    A servo turns until its own encoder reads the target; the camera's true angle is that plus the
    bias. A reading adds noise: two draws.
    """

    config: HeadConfig
    _: KW_ONLY
    noise_rad: float
    pan_bias_rad: float
    tilt_bias_rad: float
    rng: np.random.Generator

    def __post_init__(self) -> None:
        config, rate = self.config, self.config.rate_rad_per_s
        ranges_rad = (
            (config.pan_minimum_rad, config.pan_maximum_rad),
            (config.tilt_minimum_rad, config.tilt_maximum_rad),
        )
        self.pan, self.tilt = (
            Servo(minimum_rad=low, maximum_rad=high, rate_rad_per_s=rate)
            for low, high in ranges_rad
        )

    def place(self) -> None:
        """Set both angles to zero, at rest."""
        self.pan.place(0.0)
        self.tilt.place(0.0)

    def go_to(self, pan_rad: float, tilt_rad: float) -> None:
        """Set the targets, clipped to the ranges."""
        self.pan.go_to(pan_rad)
        self.tilt.go_to(tilt_rad)

    def advance(self, dt_s: float) -> None:
        """Simulate a time."""
        self.pan.advance(dt_s)
        self.tilt.advance(dt_s)

    @property
    def true_angles_rad(self) -> tuple[float, float]:
        """True pan and tilt of the camera."""
        pan_rad, tilt_rad = self.pan.position_rad, self.tilt.position_rad
        return pan_rad + self.pan_bias_rad, tilt_rad + self.tilt_bias_rad

    def read(self) -> tuple[float, float]:
        """Read the encoders: pan and tilt, radians."""
        pan_noise, tilt_noise = self.rng.standard_normal(2).tolist()
        pan_rad = self.pan.position_rad + self.noise_rad * pan_noise
        return pan_rad, self.tilt.position_rad + self.noise_rad * tilt_noise
