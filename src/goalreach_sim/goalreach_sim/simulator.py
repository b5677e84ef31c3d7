"""The simulated Nomad 200 in its arena, one camera period at a time."""

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import HeadAngles, Pose2, Twist2
from goalreach_sim.camera_renderer import CameraRenderer, true_lens
from goalreach_sim.camera_view import CameraPose, posts_from_flat
from goalreach_sim.head import PanTiltHead
from goalreach_sim.robot import Robot, Walls
from goalreach_sim.sensors import SensorFrame, draw_run_errors
from goalreach_sim.simulator_config import SimulatedFaults, SimulatorConfig


class Simulator:
    """Robot, sensors and clock. The same seed and the same calls give the same frames.

    The systematic errors (LED positions, camera height, focal length, pan and tilt bias, odometry
    scale and drift) are drawn once for each noise model. They, the pixel noise, the dropouts and
    spurious lights, and the encoders have separate generators, so that no draw shifts another's.

    Args:
        config: Robot, arena and the size of the errors.
        rng: Parent of these four generators.

    Attributes:
        config: As given.
        robot: The mobile base, in SI units.
        head: The pan/tilt head.
        time_ns: The robot's clock, nanoseconds; a reset does not turn it back.
        period_ns: One camera period, nanoseconds.
    """

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        self._rng = rng
        self.time_ns = 0
        self.period_ns = config.period_ns
        self._faults = SimulatedFaults()
        self._last_image: NDArray[np.uint8] | None = None
        self._encoders_stood: Pose2 | None = None
        self._build(config)
        self.reset(config.start)

    def _build(self, config: SimulatorConfig) -> None:
        """Draw the errors of a run and build robot, head and camera with them."""
        run_rng, pixel_rng, event_rng, encoder_rng = self._rng.spawn(4)
        landmarks_m = config.landmark_array_m
        errors = draw_run_errors(config.noise, len(landmarks_m), run_rng)
        self.config = config
        self.robot = Robot(
            config.drive,
            Walls(
                width_m=config.arena_width_m,
                length_m=config.arena_length_m,
                body_radius_m=config.body_radius_m,
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
        self._renderer = CameraRenderer(
            true_lens(self._camera, errors.focal_scale),
            landmarks_m + errors.landmark_offsets_m,
            (config.arena_width_m, config.arena_length_m),
            optics=config.optics,
            noise=config.noise,
            posts=posts_from_flat(config.posts_m),
            rng=pixel_rng,
            event_rng=event_rng,
        )
        self._camera_height_m = config.camera_height_m + errors.camera_height_m

    def reset(self, start: Pose2) -> None:
        """Put the robot at a pose, at rest, its head straight; odometry starts there.

        The drawn errors stay and the clock goes on; frozen encoders read the new pose, too.

        Raises:
            ConfigurationError: The body would overlap a wall.
        """
        self.robot.place(start)
        self.head.place()
        if self._encoders_stood is not None:
            self._encoders_stood = self.robot.odometry.pose

    def change_noise(self, noise: NoiseModel) -> None:
        """Replace the robot by one with errors drawn from another noise model, and reset it.

        Pose, clock and faults stay.
        """
        pose = self.robot.truth.pose
        self._build(replace(self.config, noise=noise))
        self.reset(pose)
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
        dt_s = self.period_ns * 1e-9
        self.robot.advance(dt_s)
        self.head.advance(dt_s)
        self.time_ns += self.period_ns

    def sense(self) -> SensorFrame:
        """Read every sensor now."""
        robot = self.robot
        pan_rad, tilt_rad = self.head.true_angles_rad
        truth_head = HeadAngles(
            turret_rad=robot.turret_joint_rad, pan_rad=pan_rad, tilt_rad=tilt_rad
        )
        pan_reading_rad, tilt_reading_rad = self.head.read()
        joints = replace(truth_head, pan_rad=pan_reading_rad, tilt_rad=tilt_reading_rad)
        truth, odometry = robot.truth, robot.odometry
        if self._encoders_stood is not None:
            odometry = replace(odometry, pose=self._encoders_stood)
        image = self._renderer.render(self._camera_pose(truth_head))
        if self._faults.camera_frozen and self._last_image is not None:
            image = self._last_image.copy()
        self._last_image = image
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
            truth_head=truth_head,
            base_yaw_rad=math.remainder(
                odometry.pose.heading_rad - robot.steering.position, math.tau
            ),
        )

    def _camera_pose(self, head: HeadAngles) -> CameraPose:
        """Return the camera's pose and velocity; steering does not turn it."""
        robot = self.robot
        heading_rad, speed = robot.heading_rad, robot.translation.velocity
        return CameraPose(
            centre_m=np.array([robot.x_m, robot.y_m, self._camera_height_m]),
            azimuth_rad=camera_azimuth(heading_rad, head),
            tilt_rad=head.tilt_rad,
            velocity_m_per_s=np.array(
                [speed * math.cos(heading_rad), speed * math.sin(heading_rad), 0.0]
            ),
            azimuth_rad_per_s=robot.turret.velocity + self.head.pan.velocity_rad_per_s,
            tilt_rad_per_s=self.head.tilt.velocity_rad_per_s,
        )
