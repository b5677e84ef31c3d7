"""The configuration of the localizer as one value, and what its robot sends."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from goalreach_msgs_py.angles import deg, inches
from goalreach_msgs_py.arena import Arena, ArenaConfig
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.topics import HEAD_KINDS
from goalreach_perception.association import AssociationConfig
from goalreach_perception.detection import DetectionConfig, SpotDetector
from goalreach_perception.head_tracker import HeadConfig
from goalreach_perception.pose_monitor import PoseMonitorConfig
from goalreach_perception.process_model import FilterConfig, OdometryConfig

_LEAST_COORDINATES = 9
_LEAST_COSINE = 0.1
"""Of the pitch of a camera: one that looks along the axis of its head has no azimuth."""


@dataclass(frozen=True, kw_only=True)
class LocalizerConfig(ArenaConfig):
    """Landmarks, expected errors and parameters of every part of the localizer."""

    camera_height_m: float = parameter(
        1.10, 'Nominal height of the optical centre, m (chosen)', within=(0.0, 10.0)
    )
    camera_mount: tuple[float, ...] = parameter(
        (),
        'Optical centre in the last link of the head, m and rad: x forward, y left, z its height '
        'above the floor at tilt 0; roll, pitch, yaw of the camera there. Empty: on the vertical '
        'axis at camera_height_m, level',
        within=(-100.0, 100.0),
    )
    camera_delay_s: float = parameter(
        0.0,
        'How much later than the middle of the exposure the stamps of the images are, as far as '
        'known, s; poses are moved on to the stamp by odometry',
        within=(-1.0, 1.0),
    )
    calibrate: bool = parameter(
        True,
        'Estimate LEDs, camera height, focal length and place of the lens while driving, and the '
        'delay of the camera where odometry and joints have stamps of their own',
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
    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    watch: PoseMonitorConfig = field(default_factory=PoseMonitorConfig)
    tracking: HeadConfig = field(default_factory=HeadConfig)

    def __post_init__(self) -> None:
        """Check every field, and that there are landmarks enough."""
        super().__post_init__()
        if not self.leds and not self.tags:
            raise ConfigurationError('leds', self.leds, 'on where there are no tags')
        if len(self.landmarks_m) < _LEAST_COORDINATES and not self.tags:
            allowed = 'x, y, z of each of at least three LEDs'
            raise ConfigurationError('landmarks_m', self.landmarks_m, allowed)
        if len(self.camera_mount) not in {0, 6}:
            raise ConfigurationError('camera_mount', self.camera_mount, 'six numbers, or none')
        if abs(math.cos(self.mount[4])) < _LEAST_COSINE:
            raise ConfigurationError('camera_mount', self.camera_mount, 'a pitch below 84 degrees')
        confirmations, most = self.watch.triple_confirmations, self.watch.confirm_within_frames
        if confirmations > most:
            allowed = f'at most {most}, the images within which a pose must be confirmed'
            raise ConfigurationError('watch.triple_confirmations', confirmations, allowed)

    @property
    def mount(self) -> tuple[float, float, float, float, float, float]:
        """Place of the optical centre and attitude of the camera: x, y, z, roll, pitch, yaw."""
        x, y, z, roll, pitch, yaw = self.camera_mount or (0.0, 0.0, self.camera_height_m, 0, 0, 0)
        return x, y, z, roll, pitch, yaw

    @classmethod
    def for_arena(cls, arena: Arena, noise: NoiseModel) -> LocalizerConfig:
        """Return the configuration for an arena and its expected errors."""
        return cls(**cls.of_arena(arena), noise=noise)

    def spot_detector(self) -> SpotDetector:
        """Return the detector for the spots of the expected lens and read noise."""
        sigma_px, noise_dn = self.noise.spot_sigma_px, self.noise.read_noise_dn
        return SpotDetector(self.detection, spot_sigma_px=sigma_px, read_noise_dn=noise_dn)


@dataclass(frozen=True, kw_only=True)
class InputConfig(Configuration):
    """Form and timing of the inputs of the localizer's node."""

    head: str = parameter(
        'turret_pan_tilt',
        'Joints between base and camera; those that a robot lacks are zero',
        choices=tuple(HEAD_KINDS),
    )
    image_transport: str = parameter(
        'raw',
        'raw: sensor_msgs/Image; compressed: sensor_msgs/CompressedImage on the topic with '
        '/compressed behind its name',
        choices=('raw', 'compressed'),
    )
    image_bits: int = parameter(
        16,
        'Bits in use, from the lowest, of images with 16 bits per channel: 10 or 12 where the '
        'driver does not scale them',
        within=(8, 16),
    )
    input_wait_s: float = parameter(
        0.1,
        'How long an image waits for odometry and joint states of its time, s; then samples '
        'that are no further from it are extrapolated, or the image is dropped (chosen)',
        within=(0.0, 5.0),
    )
