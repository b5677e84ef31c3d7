"""Parameters of the simulated robot: arena, camera, motors, clock and faults."""

from dataclasses import dataclass, field, replace
import math

from goalreach_msgs_py.angles import deg, inches
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena, ArenaConfig
from goalreach_msgs_py.camera import DISTORTION_TERMS, PLUMB_BOB, PinholeCamera
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.obstacles import Obstacle, obstacles_from_flat, obstacles_to_flat
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import Pose2
from goalreach_sim.camera_view import OpticsConfig
from goalreach_sim.sensors import BUMPER_COUNT


@dataclass(frozen=True, kw_only=True)
class DriveConfig(Configuration):
    """Limits of the three motor axes: translation, steering, turret."""

    translation_speed_m_per_s: float = parameter(
        inches(20),
        'Top translation speed, m/s; laboratories report 20 and 24 in/s, the latter is the limit',
        within=(0.01, inches(24)),
    )
    steering_speed_rad_per_s: float = parameter(
        deg(60), 'Top steering rate, rad/s; 60 deg/s by two laboratories', within=(0.01, deg(360))
    )
    turret_speed_rad_per_s: float = parameter(
        deg(90), 'Top turret rate, rad/s; 90 deg/s by two laboratories', within=(0.01, deg(360))
    )
    translation_acceleration_m_per_s2: float = parameter(
        inches(30), 'Acceleration, m/s^2; 30 in/s^2 by the Player driver', within=(0.01, 10.0)
    )
    steering_acceleration_rad_per_s2: float = parameter(
        deg(30), 'Acceleration, rad/s^2; 30 deg/s^2 by the Player driver', within=(0.01, 100.0)
    )
    turret_acceleration_rad_per_s2: float = parameter(
        deg(30), 'Acceleration, rad/s^2; 30 deg/s^2 by the Player driver', within=(0.01, 100.0)
    )


@dataclass(frozen=True, kw_only=True)
class HeadConfig(Configuration):
    """Limits of the pan/tilt head; the paper gives ranges of 174 and 70 degrees, no rates."""

    pan_minimum_rad: float = parameter(
        deg(-87), 'Lower end of pan, rad; the paper: a range of 174 deg', within=(-3.2, 0.0)
    )
    pan_maximum_rad: float = parameter(
        deg(87), 'Upper end of pan, rad; the paper: a range of 174 deg', within=(0.0, 3.2)
    )
    tilt_minimum_rad: float = parameter(
        deg(-20), 'Lower end of tilt, rad; the paper: a range of 70 deg', within=(-1.5, 0.0)
    )
    tilt_maximum_rad: float = parameter(
        deg(50), 'Upper end of tilt, rad; the paper: a range of 70 deg', within=(0.0, 1.5)
    )
    rate_rad_per_s: float = parameter(
        deg(90), 'Rate of the pan and tilt servos, rad/s; chosen', within=(0.01, deg(720))
    )

    def __post_init__(self) -> None:
        """Check every field, and that no range is empty."""
        super().__post_init__()
        for axis in ('pan', 'tilt'):
            low, high = getattr(self, f'{axis}_minimum_rad'), getattr(self, f'{axis}_maximum_rad')
            if low >= high:
                raise ConfigurationError(f'{axis}_maximum_rad', high, f'more than {low:g}')


@dataclass(frozen=True, kw_only=True)
class SimulatorConfig(ArenaConfig):
    """The robot, its camera, its arena, and the size of their errors."""

    obstacles: tuple[float, ...] = parameter(
        (),
        'Obstacles, SI units in map: x, y, length, width, radius, heading, height, speed, number '
        'of points of the track, and x, y of each point, of each obstacle in turn',
    )
    sonar: bool = parameter(False, 'Whether the ring of 16 ultrasonic sensors is simulated')
    body_radius_m: float = parameter(
        BODY_RADIUS_M, 'Radius of the bumper ring, m; Player project', within=(0.05, 1.0)
    )
    camera_height_m: float = parameter(
        1.10, 'Nominal height of the optical centre, m; chosen: 43.3 in', within=(0.1, 3.0)
    )
    image_width_px: int = parameter(
        640, 'Image width, pixels; the thesis on the robot', within=(16, 4096)
    )
    image_height_px: int = parameter(
        480, 'Image height, pixels; the thesis on the robot', within=(16, 4096)
    )
    horizontal_fov_rad: float = parameter(
        deg(60), 'Calibrated horizontal field of view, rad; chosen', within=(deg(5), deg(150))
    )
    distortion: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'Terms of the distortion of the lens, known to calibration: 5 of plumb_bob, 8 of '
        'rational_polynomial, 4 of equidistant',
        within=(-20.0, 20.0),
    )
    distortion_model: str = parameter(
        PLUMB_BOB, 'Model of the distortion', choices=tuple(DISTORTION_TERMS)
    )
    camera_rate_hz: float = parameter(
        25.0, 'Images per second; the thesis on the robot', within=(0.1, 1000.0)
    )
    start_pose: tuple[float, ...] = parameter(
        (1.778, 4.5, -math.pi / 2),
        'Pose after a reset in map: x (m), y (m), heading (rad)',
        length=3,
    )
    watchdog_s: float = parameter(
        0.5, 'Time without a command after which the drive rests, s; chosen', within=(0.01, 60.0)
    )
    watchdog_braking_m_per_s2: float = parameter(
        5.08,
        'Deceleration by the watchdog, m/s^2; chosen: 200 in/s^2 brings the robot to rest within '
        '0.1 s from any speed, so braking begins 0.4 s after the last command',
        within=(0.01, 100.0),
    )
    drive: DriveConfig = field(default_factory=DriveConfig)
    head: HeadConfig = field(default_factory=HeadConfig)
    optics: OpticsConfig = field(default_factory=OpticsConfig)
    noise: NoiseModel = field(default_factory=NoiseModel)

    def __post_init__(self) -> None:
        """Check every field, and the fields against each other."""
        super().__post_init__()
        for name in ('arena_width_m', 'arena_length_m'):
            if getattr(self, name) <= 2.0 * self.body_radius_m:
                raise ConfigurationError(name, getattr(self, name), 'wider than the robot')
        if self.brakes_after_s <= 0.0:
            allowed = 'longer than braking from full speed takes: watchdog_braking_m_per_s2'
            raise ConfigurationError('watchdog_s', self.watchdog_s, allowed)
        self.calibrated_camera  # noqa: B018 - checks the lens
        self.obstacle_list  # noqa: B018 - checks the obstacles
        radius_m, sizes_m = self.body_radius_m, (self.arena_width_m, self.arena_length_m)
        pairs = zip(self.start_pose[:2], sizes_m, strict=True)
        if not all(radius_m <= place_m <= size_m - radius_m for place_m, size_m in pairs):
            raise ConfigurationError('start_pose', self.start_pose, 'on the free floor')

    @property
    def brakes_after_s(self) -> float:
        """Time without a command after which the watchdog begins to brake, seconds."""
        full_m_per_s = self.drive.translation_speed_m_per_s
        return self.watchdog_s - full_m_per_s / self.watchdog_braking_m_per_s2

    @classmethod
    def for_arena(cls, arena: Arena, noise: NoiseModel) -> 'SimulatorConfig':
        """Return the default robot with given errors at the first start of an arena, if any."""
        start_pose = (arena.width_m / 2.0, arena.length_m / 2.0, -math.pi / 2.0)
        if arena.starts:
            start = arena.starts[0]
            start_pose = (start.x_m, start.y_m, start.heading_rad)
        return cls(
            **cls.of_arena(arena),
            start_pose=start_pose,
            obstacles=obstacles_to_flat(arena.obstacles),
            sonar=arena.sonar or bool(arena.obstacles),
            noise=noise,
        )

    @property
    def obstacle_list(self) -> tuple[Obstacle, ...]:
        """The obstacles at the start of their tracks."""
        return obstacles_from_flat(self.obstacles)

    @property
    def start(self) -> Pose2:
        """Pose after a reset."""
        x_m, y_m, heading_rad = self.start_pose
        return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def period_ns(self) -> int:
        """Time between two images, nanoseconds."""
        return round(1e9 / self.camera_rate_hz)

    @property
    def calibrated_camera(self) -> PinholeCamera:
        """The camera as calibrated, which is what CameraInfo contains."""
        ideal = PinholeCamera.from_field_of_view(
            width_px=self.image_width_px,
            height_px=self.image_height_px,
            horizontal_fov_rad=self.horizontal_fov_rad,
        )
        return replace(ideal, distortion=self.distortion, distortion_model=self.distortion_model)


@dataclass(frozen=True, kw_only=True)
class TimeConfig(Configuration):
    """Clock, speed and seed of a simulation run."""

    clock: str = parameter(
        'realtime',
        'realtime: follow the wall clock; lockstep: wait for the commands of each image',
        choices=('realtime', 'lockstep'),
    )
    speed: float = parameter(
        1.0, 'Simulated seconds per wall second with clock realtime', within=(0.01, 100.0)
    )
    seed: int = parameter(0, 'Seed of everything random in the simulation', within=(0, 2**31 - 1))
    start_time_ns: int = parameter(
        0,
        'Initial time of the clock, ns, which a restart must not turn back',
        within=(0, 2 * 10**18),
    )
    answer_timeout_s: float = parameter(
        5.0, 'Wall seconds after which a node that is awaited is reported', within=(0.1, 3600.0)
    )
    consumers: str = parameter(
        '',
        'Nodes that must miss no tick, separated by commas: the first tick waits until each has '
        'registered, and in lockstep none comes while one of them is too far behind',
    )

    @property
    def consumer_names(self) -> tuple[str, ...]:
        """The names in `consumers`."""
        return tuple(filter(None, (name.strip() for name in self.consumers.split(','))))


@dataclass(frozen=True, kw_only=True)
class SimulatedFaults(Configuration):
    """Faults of the robot, none by default; live parameters of the node, for tests.

    Random errors of intact sensors belong to `NoiseModel`.
    """

    dark_leds: tuple[float, ...] = parameter(
        (), 'Numbers of the LEDs that are dark, from 0', within=(0.0, 1000.0)
    )
    extra_light_m: tuple[float, ...] = parameter(
        (), 'Position of a false light: x, y, z in map, m; empty: none', within=(-100.0, 100.0)
    )
    camera_frozen: bool = parameter(False, 'Whether the camera repeats its last image')
    odometry_frozen: bool = parameter(False, 'Whether the pose of the odometry is frozen')
    stuck_bumper: int = parameter(
        -1, 'Number of a bumper that stays pressed, or -1', within=(-1, BUMPER_COUNT - 1)
    )
    carry_to: tuple[float, ...] = parameter(
        (),
        'Pose to which it is carried unnoticed: x, y (m), heading (rad)',
        within=(-100.0, 100.0),
    )

    def __post_init__(self) -> None:
        """Check every field, and that points have three coordinates."""
        super().__post_init__()
        for name in ('extra_light_m', 'carry_to'):
            if len(getattr(self, name)) not in (0, 3):
                raise ConfigurationError(name, getattr(self, name), 'three numbers or none')
        if any(number != int(number) for number in self.dark_leds):
            raise ConfigurationError('dark_leds', self.dark_leds, 'whole numbers')


@dataclass(frozen=True, kw_only=True)
class FaultParameters:
    """The faults as the node declares them: parameters `faults.*`."""

    faults: SimulatedFaults = field(default_factory=SimulatedFaults)
