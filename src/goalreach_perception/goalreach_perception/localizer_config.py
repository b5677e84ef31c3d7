"""The configuration of the localizer as one value."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from goalreach_msgs_py.angles import deg, inches
from goalreach_msgs_py.arena import DEFAULT_LANDMARKS_M, LENGTH_M, WIDTH_M, Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.association import AssociationConfig
from goalreach_perception.detection import DetectionConfig, SpotDetector
from goalreach_perception.head_tracker import HeadConfig
from goalreach_perception.pose_filter import FilterConfig
from goalreach_perception.pose_monitor import PoseMonitorConfig

_LEAST_COORDINATES = 9


@dataclass(frozen=True, kw_only=True)
class LocalizerConfig(Configuration):
    """Landmarks, expected errors and parameters of every part of the localizer."""

    landmarks_m: tuple[float, ...] = parameter(
        tuple(coordinate for led in DEFAULT_LANDMARKS_M for coordinate in led),
        'Surveyed positions of the LEDs in `map`: x, y, z of each, m',
        within=(-100.0, 100.0),
    )
    arena_width_m: float = parameter(
        WIDTH_M, 'Arena size along x, m (the paper: 140 in)', within=(0.5, 100.0)
    )
    arena_length_m: float = parameter(
        LENGTH_M, 'Arena size along y, m (the paper: 200 in)', within=(0.5, 100.0)
    )
    camera_height_m: float = parameter(
        1.10, 'Nominal height of the optical centre, m (chosen)', within=(0.0, 10.0)
    )
    calibrate: bool = parameter(
        True, 'Estimate LED positions, camera height and focal length while driving'
    )
    robot_speed_m_per_s: float = parameter(
        inches(24.0), 'Fastest the robot drives, m/s (Nomad 200: 24 in/s)', within=(0.01, None)
    )
    robot_turn_rad_per_s: float = parameter(
        deg(60.0), 'Fastest the robot steers, rad/s (Nomad 200: 60 deg/s)', within=(0.01, None)
    )
    noise: NoiseModel = field(default_factory=NoiseModel)
    detection: DetectionConfig = field(default_factory=DetectionConfig)
    association: AssociationConfig = field(default_factory=AssociationConfig)
    filter: FilterConfig = field(default_factory=FilterConfig)
    watch: PoseMonitorConfig = field(default_factory=PoseMonitorConfig)
    head: HeadConfig = field(default_factory=HeadConfig)

    def __post_init__(self) -> None:
        """Check every field, and that the coordinates are triples."""
        super().__post_init__()
        if len(self.landmarks_m) < _LEAST_COORDINATES or len(self.landmarks_m) % 3:
            raise ConfigurationError(
                'landmarks_m', self.landmarks_m, 'x, y, z of each of at least three LEDs'
            )

    @classmethod
    def for_arena(cls, arena: Arena, noise: NoiseModel) -> LocalizerConfig:
        """Return the configuration for an arena and its expected errors."""
        return cls(
            landmarks_m=tuple(float(c) for led in arena.landmarks_m for c in led),
            arena_width_m=arena.width_m,
            arena_length_m=arena.length_m,
            noise=noise,
        )

    @property
    def landmark_array_m(self) -> FloatArray:
        """The surveyed LEDs, (n, 3), metres."""
        return np.array(self.landmarks_m, dtype=np.float64).reshape(-1, 3)

    def spot_detector(self) -> SpotDetector:
        """Return the detector for the spots of the expected lens and read noise."""
        spot_sigma_px, read_noise_dn = self.noise.spot_sigma_px, self.noise.read_noise_dn
        return SpotDetector(
            self.detection, spot_sigma_px=spot_sigma_px, read_noise_dn=read_noise_dn
        )
