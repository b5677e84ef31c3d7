"""The pan/tilt head: two servos with imperfect encoders."""

from __future__ import annotations

import numpy as np

from goalreach_sim.drive_config import HeadConfig
from goalreach_sim.servo import Servo

__all__ = ['PanTiltHead']


class PanTiltHead:
    """Pan and tilt servos, their mounting error and the noise of their encoders.

    A servo turns until its own encoder shows the target; the camera then looks away from it by
    the bias. A reading adds noise, then rounds to the encoder's step.

    Args:
        config: Ranges, rate, encoder step.
        noise_rad: Standard deviation of a reading.
        pan_bias_rad: True pan angle minus that of the encoder.
        tilt_bias_rad: True tilt angle minus that of the encoder.
        rng: Of the encoders' noise; two draws per reading.
    """

    def __init__(
        self,
        config: HeadConfig,
        *,
        noise_rad: float,
        pan_bias_rad: float,
        tilt_bias_rad: float,
        rng: np.random.Generator,
    ) -> None:
        self.pan = Servo(
            minimum_rad=config.pan_minimum_rad,
            maximum_rad=config.pan_maximum_rad,
            rate_rad_per_s=config.rate_rad_per_s,
        )
        self.tilt = Servo(
            minimum_rad=config.tilt_minimum_rad,
            maximum_rad=config.tilt_maximum_rad,
            rate_rad_per_s=config.rate_rad_per_s,
        )
        self._noise_rad = noise_rad
        self._pan_bias_rad = pan_bias_rad
        self._tilt_bias_rad = tilt_bias_rad
        self._resolution_rad = config.encoder_resolution_rad
        self._rng = rng

    def place(self) -> None:
        """Stand straight."""
        self.pan.place(0.0)
        self.tilt.place(0.0)

    def go_to(self, pan_rad: float, tilt_rad: float) -> None:
        """Take new targets, clipped to the ranges."""
        self.pan.go_to(pan_rad)
        self.tilt.go_to(tilt_rad)

    def advance(self, dt_s: float) -> None:
        """Turn for a time."""
        self.pan.advance(dt_s)
        self.tilt.advance(dt_s)

    @property
    def true_angles_rad(self) -> tuple[float, float]:
        """Where the camera really looks: pan and tilt."""
        return (
            self.pan.position_rad + self._pan_bias_rad,
            self.tilt.position_rad + self._tilt_bias_rad,
        )

    def read(self) -> tuple[float, float]:
        """Read the encoders: pan and tilt, radians."""
        pan_noise, tilt_noise = self._rng.standard_normal(2).tolist()
        return (
            self._rounded(self.pan.position_rad + self._noise_rad * pan_noise),
            self._rounded(self.tilt.position_rad + self._noise_rad * tilt_noise),
        )

    def _rounded(self, angle_rad: float) -> float:
        step_rad = self._resolution_rad
        return angle_rad if step_rad == 0.0 else round(angle_rad / step_rad) * step_rad
