"""The simulated Nomad 200 in its arena, one camera period at a time."""

import cmath
from copy import copy
from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.alignment import (
    InputAligner,
    Interpolation,
    Sampled,
    interpolate_head,
    interpolate_odometry,
)
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import camera_azimuth, optical_rotation
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2, Twist2
from goalreach_sim.camera_renderer import CameraRenderer, TagPainter, true_lens
from goalreach_sim.camera_view import CameraPose
from goalreach_sim.head import PanTiltHead
from goalreach_sim.robot import Robot
from goalreach_sim.sensors import SensorFrame, draw_run_errors
from goalreach_sim.simulator_config import SimulatedFaults, SimulatorConfig
from goalreach_sim.sonar import SonarRing
from goalreach_sim.walls import Walls

_STOOD_NS = 1_000_000_000
"""Longer than images are late: how long a robot that is placed counts as having stood there."""


class Simulator:
    """Robot, sensors and clock. The same seed and the same calls give the same frames.

    The systematic errors (LED positions, camera height, focal length, pan and tilt bias, odometry
    scale and drift) are drawn once for each noise model. They, the pixel noise, the dropouts and
    spurious lights, the encoders and the sonar have separate generators, so that no draw shifts
    another's.

    Attributes:
        config: Robot, arena and the size of the errors.
        robot: The mobile base, in SI units.
        time_ns: The robot's clock, nanoseconds; a reset does not turn it back.
        period_ns: One camera period, nanoseconds.
    """

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        self._rng = rng
        self.time_ns = self._now_ns = self._sampled_ns = 0
        self.period_ns = config.period_ns
        self._faults = SimulatedFaults()
        self._last_image: NDArray[np.uint8] | None = None
        self._encoders_stood: Pose2 | None = None
        self._frame: SensorFrame | None = None
        self._film: dict[int, NDArray[np.uint8]] = {}
        self._build(config)
        self.reset(config.start)

    def _build(self, config: SimulatorConfig) -> None:
        """Draw the errors of a run and build robot, head and camera with them."""
        run_rng, pixel_rng, event_rng, encoder_rng = self._rng.spawn(4)
        errors = draw_run_errors(config.noise, len(config.landmark_array_m), run_rng)
        self.config, self._level_rad = config, errors.level_rad
        self.robot = Robot(
            config.drive,
            Walls(
                width_m=config.arena_width_m,
                length_m=config.arena_length_m,
                body_radius_m=config.body_radius_m,
                obstacles=config.obstacle_list,
            ),
            watchdog_s=config.brakes_after_s,
            watchdog_braking_m_per_s2=config.watchdog_braking_m_per_s2,
            odometry_scale=errors.odometry_scale,
            drift_rad_per_m=errors.drift_rad_per_m,
        )
        self.head = PanTiltHead(
            config.head,
            noise_rad=config.noise.pan_tilt_noise_rad,
            pan_bias_rad=errors.pan_bias_rad,
            tilt_bias_rad=errors.tilt_bias_rad,
            rng=encoder_rng,
        )
        self._camera = config.calibrated_camera
        lens = true_lens(self._camera, errors.focal_scale)
        self._renderer = CameraRenderer(
            lens,
            config.landmark_array_m + errors.landmark_offsets_m,
            (config.arena_width_m, config.arena_length_m),
            optics=config.optics,
            noise=config.noise,
            rng=pixel_rng,
            event_rng=event_rng,
            tags=TagPainter(lens, config, run_rng) if config.tags else None,
        )
        self._sonar = SonarRing(config, self._rng.spawn(1)[0]) if config.sonar else None
        self._sample_rng = self._rng.spawn(1)[0] if config.noise.sample_rate_hz else None
        self._camera_height_m = config.camera_height_m + errors.camera_height_m

    def _standing_samples(self) -> InputAligner:
        """Return what interpolates sensors with a clock of their own, of a robot just placed."""
        sensors: dict[str, Interpolation | None]
        sensors = {'odometry': interpolate_odometry, 'joints': interpolate_head}
        samples = InputAligner('image', sensors, wait_s=math.inf)
        for at_ns in (self._now_ns - _STOOD_NS, self._now_ns):
            samples.add('odometry', at_ns, self._odometry(), 0.0)
            samples.add('joints', at_ns, self._head_angles(0.0, 0.0), 0.0)
        return samples

    def reset(self, start: Pose2) -> None:
        """Put the robot at a pose, at rest, its head straight; odometry starts there.

        The drawn errors stay and the clock goes on; frozen encoders read the new pose, too.
        Obstacles return to the start of their tracks.

        Raises:
            ConfigurationError: The body would overlap a wall or an obstacle.
        """
        before, self.robot.walls = self.robot.walls, copy(self.robot.walls)
        self.robot.walls.restart()
        try:
            self.robot.place(start)
        except ConfigurationError:
            self.robot.walls = before
            raise
        self._frame = None
        self.head.place()
        self._film.clear()
        if self._encoders_stood is not None:
            self._encoders_stood = self.robot.odometry.pose
        self._samples = self._standing_samples() if self._sample_rng else None

    def change_noise(self, noise: NoiseModel) -> None:
        """Replace the robot by one with errors drawn from another noise model, and reset it.

        Pose, clock and faults stay; the pose moves out of an obstacle that starts there.
        """
        pose = self.robot.truth.pose
        self._now_ns = self._sampled_ns = self.time_ns
        self._build(replace(self.config, noise=noise))
        x_m, y_m = self.robot.walls.clamp(pose.x_m, pose.y_m)
        self.reset(replace(pose, x_m=x_m, y_m=y_m))
        self.faults = self._faults

    @property
    def faults(self) -> SimulatedFaults:
        """Present faults; a new value takes effect at once, and may move the robot."""
        return self._faults

    @faults.setter
    def faults(self, faults: SimulatedFaults) -> None:
        robot = self.robot
        self._renderer.dark = frozenset(int(number) for number in faults.dark_leds)
        self._renderer.set_false_light(faults.extra_light_m)
        if faults.odometry_frozen != self._faults.odometry_frozen:
            stood = self._encoders_stood
            self._encoders_stood = robot.odometry.pose if faults.odometry_frozen else None
            if stood is not None:
                robot.define_odometry(stood)
        if faults.carry_to and faults.carry_to != self._faults.carry_to:
            x_m, y_m, heading_rad = faults.carry_to
            robot.x_m, robot.y_m = robot.walls.clamp(x_m, y_m)
            robot.base_yaw_rad = heading_rad - robot.steering.position
        self._faults = faults

    def command_drive(self, command: Twist2, age_s: float = 0.0) -> None:
        """Set the velocities, clipped to the limits, given some time ago; feeds the watchdog."""
        self.robot.drive(command, age_s)

    def command_head(self, target: HeadAngles) -> None:
        """Set the targets of the three joints, the turret's relative to base_link as of now.

        The turret turns the shorter way and then stays fixed to the base: it does not follow the
        steering.
        """
        robot = self.robot
        robot.turret.move_by(angle_difference(target.turret_rad, robot.turret_joint_rad))
        self.head.go_to(target.pan_rad, target.tilt_rad)

    def advance(self) -> None:
        """Simulate one camera period."""
        if self._samples is None or self._sample_rng is None:
            self._move(self.period_ns)
            self.time_ns += self.period_ns
            return
        sample_ns = 1e9 / self.config.noise.sample_rate_hz
        until_ns, now_ns, rng = self._now_ns + self.period_ns, self._now_ns, self._sample_rng
        self.time_ns = until_ns - min(round(2.0 * sample_ns), self.period_ns - 1)
        late_ns = round(self.config.noise.image_delay_s * 1e9)
        shot_ns = until_ns - (until_ns - self.time_ns + late_ns) % self.period_ns
        if not self._film:  # the first late images after a placement show it
            stamps_ns = range(self.time_ns, now_ns + late_ns + 1, self.period_ns)
            self._film = {stamp_ns: self._shoot() for stamp_ns in stamps_ns}
        times_ns = [self.time_ns]
        while self._sampled_ns <= until_ns:
            times_ns.append(self._sampled_ns)
            self._sampled_ns += round(sample_ns * rng.uniform(0.75, 1.25))
        for at_ns in sorted({*times_ns, shot_ns, until_ns}):
            self._move(at_ns - now_ns)
            now_ns = at_ns
            if at_ns in times_ns[1:]:
                self._samples.add('odometry', at_ns, self._odometry(), 0.0)
                self._samples.add('joints', at_ns, self._read_joints(), 0.0)
            if at_ns == shot_ns:
                self._film[at_ns + late_ns] = self._shoot()
            if at_ns == self.time_ns:
                self._frame = self._read(self._film.pop(at_ns))
        self._now_ns = until_ns

    def _move(self, dt_ns: int) -> None:
        """Simulate a time; in a bend the tyres slip outwards."""
        robot, dt_s = self.robot, dt_ns * 1e-9
        before = robot.translation.velocity * robot.steering.velocity
        robot.advance(dt_s)
        robot.walls.advance(dt_s, robot.x_m, robot.y_m)
        self.head.advance(dt_s)
        if slip_s := self.config.noise.side_slip_s:
            after = robot.translation.velocity * robot.steering.velocity
            slip_m, heading = 0.5 * slip_s * (before + after) * dt_s, robot.heading_rad
            x_m, y_m = slip_m * math.sin(heading), -slip_m * math.cos(heading)
            robot.x_m, robot.y_m = robot.walls.clamp(robot.x_m + x_m, robot.y_m + y_m)

    def sense(self) -> SensorFrame:
        """Read every sensor now; with clocks of their own, what lies between their samples."""
        sampled, frame = self.sampled, self._frame
        if sampled is None or frame is None:
            return self._read()
        joints, odometry = sampled(frame.time_ns)
        return replace(frame, odometry=odometry, joints=joints)

    @property
    def sampled(self) -> Sampled | None:
        """Joints and odometry at any recent time, where they have clocks of their own."""
        if (samples := self._samples) is None:
            return None
        at = samples.follower_at
        return lambda time_ns: (at('joints', time_ns), at('odometry', time_ns))

    def _odometry(self) -> Odometry:
        odometry, stood = self.robot.odometry, self._encoders_stood
        return odometry if stood is None else replace(odometry, pose=stood)

    def _read_joints(self) -> HeadAngles:
        return self._head_angles(*self.head.read())

    def _head_angles(self, pan_rad: float, tilt_rad: float) -> HeadAngles:
        turret_rad = self.robot.turret_joint_rad
        return HeadAngles(turret_rad=turret_rad, pan_rad=pan_rad, tilt_rad=tilt_rad)

    def _shoot(self) -> NDArray[np.uint8]:
        """Return the image of the camera now; a frozen one repeats its last."""
        if obstacles := self.robot.walls.obstacles:
            self._renderer.view.obstacles = obstacles
        truth_head = self._head_angles(*self.head.true_angles_rad)
        image = self._renderer.render(self._camera_pose(truth_head))
        if self._faults.camera_frozen and self._last_image is not None:
            image = self._last_image.copy()
        self._last_image = image
        return image

    def _read(self, image: NDArray[np.uint8] | None = None) -> SensorFrame:
        """Read every sensor now, the camera unless there is an image."""
        robot, joints = self.robot, self._read_joints()
        image = self._shoot() if image is None else image
        truth, odometry = robot.truth, self._odometry()
        base = Pose2(x_m=robot.x_m, y_m=robot.y_m, heading_rad=robot.base_yaw_rad)
        sonar = self._sonar.read(base, robot.walls.obstacles) if self._sonar else ()
        bumpers, stuck = robot.bumpers, self._faults.stuck_bumper
        if stuck >= 0:
            bumpers = (*bumpers[:stuck], True, *bumpers[stuck + 1 :])
        return SensorFrame(
            time_ns=self.time_ns,
            image=image,
            camera=self._camera,
            joints=joints,
            odometry=odometry,
            bumpers=bumpers,
            truth=truth,
            truth_head=self._head_angles(*self.head.true_angles_rad),
            base_yaw_rad=angle_difference(odometry.pose.heading_rad, robot.steering.position),
            sonar=sonar,
        )

    def _camera_pose(self, head: HeadAngles) -> CameraPose:
        """Return the camera's pose and velocity; steering does not turn it."""
        robot = self.robot
        heading_rad, speed = robot.heading_rad, robot.translation.velocity
        azimuth_rad = camera_azimuth(heading_rad, head)
        centre_m = np.array([robot.x_m, robot.y_m, self._camera_height_m])
        if offset_m := self.config.noise.lens_offset_m:
            centre_m += offset_m * optical_rotation(azimuth_rad, head.tilt_rad)[2]
        leans = complex(*self._level_rad) * cmath.rect(1.0, robot.base_yaw_rad)
        east, north = speed * math.cos(heading_rad), speed * math.sin(heading_rad)
        return CameraPose(
            centre_m=centre_m,
            azimuth_rad=azimuth_rad,
            tilt_rad=head.tilt_rad,
            velocity_m_per_s=np.array([east, north, 0.0]),
            azimuth_rad_per_s=robot.turret.velocity + self.head.pan.velocity_rad_per_s,
            tilt_rad_per_s=self.head.tilt.velocity_rad_per_s,
            level_rad=(leans.real, leans.imag),
        )
