"""Everything that can be set about the simulated robot and its arena."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
import math

import numpy as np

from goalreach_msgs_py.angles import deg
from goalreach_msgs_py.arena import BODY_RADIUS_M, DEFAULT_LANDMARKS_M, LENGTH_M, WIDTH_M, Arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_sim.camera_view import OpticsConfig
from goalreach_sim.drive_config import DriveConfig, HeadConfig


def _flat(landmarks_m: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    return tuple(coordinate for led in landmarks_m for coordinate in led)


@dataclass(frozen=True, kw_only=True)
class SimulatorConfig:
    """A robot, its camera, its arena, and how wrong they may be.

    Raises:
        ConfigurationError: A value is refused; the line names it.
    """

    arena_width_m: float = parameter(
        WIDTH_M, 'Arena size along x, m; the paper: 140 in', minimum=0.5, maximum=100.0, fixed=True
    )
    arena_length_m: float = parameter(
        LENGTH_M,
        'Arena size along y, m; the paper: 200 in',
        minimum=0.5,
        maximum=100.0,
        fixed=True,
    )
    landmarks_m: tuple[float, ...] = parameter(
        _flat(DEFAULT_LANDMARKS_M),
        'Surveyed places of the LEDs in map, m: x, y, z of the first, then the next',
        fixed=True,
    )
    posts_m: tuple[float, ...] = parameter(
        (),
        'Posts that hide LEDs from the camera: x, y, radius, height of the first, then the next, '
        'm in map; the robot does not feel them. None in the paper',
        fixed=True,
    )
    body_radius_m: float = parameter(
        BODY_RADIUS_M,
        'Radius of the bumper ring, m; Player project',
        minimum=0.05,
        maximum=1.0,
        fixed=True,
    )
    camera_height_m: float = parameter(
        1.10,
        'Nominal height of the optical centre, m; chosen: 43.3 in',
        minimum=0.1,
        maximum=3.0,
        fixed=True,
    )
    image_width_px: int = parameter(
        640, 'Image width, pixels; the thesis on the robot', minimum=16, maximum=4096, fixed=True
    )
    image_height_px: int = parameter(
        480, 'Image height, pixels; the thesis on the robot', minimum=16, maximum=4096, fixed=True
    )
    horizontal_fov_rad: float = parameter(
        deg(60),
        'Calibrated horizontal field of view, rad; chosen, not from a source',
        minimum=deg(5),
        maximum=deg(150),
        fixed=True,
    )
    distortion: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'Brown-Conrady k1, k2, p1, p2, k3 of the lens, known to calibration',
        minimum=-2.0,
        maximum=2.0,
        length=5,
        fixed=True,
    )
    camera_rate_hz: float = parameter(
        25.0,
        'Images per second; the thesis on the robot',
        minimum=0.1,
        maximum=1000.0,
        fixed=True,
    )
    start_pose: tuple[float, ...] = parameter(
        (1.778, 4.5, -math.pi / 2),
        'Where a reset puts the robot: x (m), y (m), heading (rad) in map; chosen',
        length=3,
    )
    watchdog_s: float = parameter(
        0.5,
        'The drive stands when no command came for so long, s; it brakes in time; chosen',
        minimum=0.01,
        maximum=60.0,
        fixed=True,
    )
    watchdog_braking_m_per_s2: float = parameter(
        5.08,
        'How hard the watchdog brakes the drive, m/s^2; chosen: 200 in/s^2, at rest within 0.1 s '
        'from any speed, so it begins 0.4 s after the last command',
        minimum=0.01,
        maximum=100.0,
        fixed=True,
    )
    drive: DriveConfig = field(default_factory=DriveConfig)
    head: HeadConfig = field(default_factory=HeadConfig)
    optics: OpticsConfig = field(default_factory=OpticsConfig)
    noise: NoiseModel = field(default_factory=NoiseModel)

    def __post_init__(self) -> None:
        """Check every field, and what must fit together."""
        check_fields(self)
        for name in ('arena_width_m', 'arena_length_m'):
            if getattr(self, name) <= 2.0 * self.body_radius_m:
                raise ConfigurationError(name, getattr(self, name), 'wider than the robot')
        if self.brakes_after_s <= 0.0:
            allowed = 'longer than braking from full speed takes: watchdog_braking_m_per_s2'
            raise ConfigurationError('watchdog_s', self.watchdog_s, allowed)
        if len(self.landmarks_m) % 3 or not self.landmarks_m:
            raise ConfigurationError('landmarks_m', self.landmarks_m, 'x, y, z of each LED')
        if len(self.posts_m) % 4:
            raise ConfigurationError('posts_m', self.posts_m, 'x, y, radius, height of each post')
        x_m, y_m, _ = self.start_pose
        radius_m = self.body_radius_m
        if not (
            radius_m <= x_m <= self.arena_width_m - radius_m
            and radius_m <= y_m <= self.arena_length_m - radius_m
        ):
            raise ConfigurationError('start_pose', self.start_pose, 'on the free floor')

    @property
    def brakes_after_s(self) -> float:
        """Time without a command after which the watchdog begins to brake, seconds."""
        full_m_per_s = self.drive.translation_speed_m_per_s
        return self.watchdog_s - full_m_per_s / self.watchdog_braking_m_per_s2

    @classmethod
    def for_arena(cls, arena: Arena, noise: NoiseModel) -> SimulatorConfig:
        """Return the default robot in an arena, at its first start, with given errors."""
        config = cls(
            arena_width_m=arena.width_m,
            arena_length_m=arena.length_m,
            landmarks_m=_flat(arena.landmarks_m),
            start_pose=(arena.width_m / 2.0, arena.length_m / 2.0, -math.pi / 2.0),
            noise=noise,
        )
        if not arena.starts:
            return config
        start = arena.starts[0]
        return dataclasses.replace(config, start_pose=(start.x_m, start.y_m, start.heading_rad))

    @property
    def start(self) -> Pose2:
        """Where a reset puts the robot."""
        x_m, y_m, heading_rad = self.start_pose
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def landmark_array_m(self) -> FloatArray:
        """Surveyed places of the LEDs, (n, 3), metres in `map`."""
        return np.array(self.landmarks_m, dtype=np.float64).reshape(-1, 3)

    @property
    def period_ns(self) -> int:
        """Time between two images, nanoseconds."""
        return round(1e9 / self.camera_rate_hz)

    @property
    def calibrated_camera(self) -> PinholeCamera:
        """The camera as calibration knows it: what CameraInfo tells."""
        ideal = PinholeCamera.from_field_of_view(
            width_px=self.image_width_px,
            height_px=self.image_height_px,
            horizontal_fov_rad=self.horizontal_fov_rad,
        )
        k1, k2, p1, p2, k3 = self.distortion
        return dataclasses.replace(ideal, distortion=(k1, k2, p1, p2, k3))
