"""The mobile base among walls: three axes, a synchro drive, bumpers, encoders, a watchdog.

In a synchro drive all wheels steer together: steering turns the drive heading, not the base, and
thus neither the bumpers nor the turret. Angles of axes are measured against the base:

    heading = base_yaw + steering.position          (base_link)
    turret axis = base_yaw + turret.position        (turret_link)

so the turret's joint, seen from base_link, is turret.position - steering.position. Wheel slip
turns the base slowly while the robot drives; the encoders do not see it.
"""

from dataclasses import KW_ONLY, dataclass
import math

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Odometry, Pose2, Twist2
from goalreach_sim.axis import DONE_S, Axis
from goalreach_sim.path_integral import Motion, displacement, quarter_turn_time
from goalreach_sim.sensors import WheelOdometry, pressed_bumpers
from goalreach_sim.simulator_config import DriveConfig
from goalreach_sim.walls import TOUCH_M, Walls, first_crossing


@dataclass(eq=False)
class Robot:
    """A synchro-drive robot among walls; its motion is exact for any step length.

    The robot stops at once where its body first touches a wall. Its wheels stay blocked while the
    drive heading (or its reverse, in backward motion) has a component into the wall.

    Attributes:
        watchdog_s: Time after the last drive command at which all axes ramp to rest.
        watchdog_braking_m_per_s2: Its deceleration, or None for the usual ramp.
        odometry_scale: Distance measured by the encoders over distance driven.
        drift_rad_per_m: Rotation of the base per metre driven, forwards or backwards.
        translation: Axis whose position is the distance driven, metres.
        steering: Axis of the wheels, measured against the base, radians.
        turret: Axis of the turret, measured against the base, radians.
        base_yaw_rad: Orientation of the base and its bumpers in `map`.
        x_m: True centre in `map`.
        y_m: True centre in `map`.
    """

    config: DriveConfig
    walls: Walls
    _: KW_ONLY
    watchdog_s: float
    watchdog_braking_m_per_s2: float | None = None
    odometry_scale: float = 1.0
    drift_rad_per_m: float = 0.0
    base_yaw_rad: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0

    def __post_init__(self) -> None:
        config = self.config
        limits = (
            (config.translation_speed_m_per_s, config.translation_acceleration_m_per_s2),
            (config.steering_speed_rad_per_s, config.steering_acceleration_rad_per_s2),
            (config.turret_speed_rad_per_s, config.turret_acceleration_rad_per_s2),
        )
        self.translation, self.steering, self.turret = (
            Axis(max_speed=speed, acceleration=acceleration) for speed, acceleration in limits
        )
        self._odometry = WheelOdometry(self.odometry_scale)
        self._watchdog_left_s = math.inf

    def place(self, start: Pose2, *, steering_rad: float = 0.0, turret_rad: float = 0.0) -> None:
        """Put the robot at a pose, at rest, its axes at given angles; odometry starts there.

        Raises:
            ConfigurationError: The body would overlap a wall.
        """
        clearance_m = self.walls.clearance_m(start.x_m, start.y_m)
        if not clearance_m >= -TOUCH_M or not math.isfinite(start.heading_rad):
            point = (start.x_m, start.y_m, start.heading_rad)
            raise ConfigurationError('start_pose', point, 'a finite pose on the free floor')
        self.translation.place(0.0)
        self.steering.place(steering_rad)
        self.turret.place(turret_rad)
        self._watchdog_left_s = math.inf
        self.x_m, self.y_m = self.walls.clamp(start.x_m, start.y_m)
        self.base_yaw_rad = start.heading_rad - steering_rad
        self.define_odometry(start)

    @property
    def axes(self) -> tuple[Axis, Axis, Axis]:
        """Translation, steering and turret."""
        return self.translation, self.steering, self.turret

    def define_odometry(self, pose: Pose2) -> None:
        """Set the pose from which the encoders count; the robot does not move."""
        self._odometry.define(pose, self.steering.position)

    def feed_watchdog(self, age_s: float = 0.0) -> None:
        """Restart the watchdog for a command given now or some time ago."""
        self._watchdog_left_s = max(self.watchdog_s - age_s, 0.0)

    def stop(self) -> None:
        """Ramp all axes to rest."""
        for axis in self.axes:
            axis.go(0.0)

    def drive(self, command: Twist2, age_s: float = 0.0) -> None:
        """Set the velocities, clipped to the limits, and feed the watchdog."""
        self.feed_watchdog(age_s)
        self.translation.go(float(command.linear_m_per_s))
        self.steering.go(float(command.steering_rad_per_s))

    @property
    def heading_rad(self) -> float:
        """True drive heading in `map`, not wrapped."""
        return self.base_yaw_rad + self.steering.position

    @property
    def turret_joint_rad(self) -> float:
        """Angle of the turret in base_link (from the drive heading), in (-pi, pi]."""
        return wrap_angle(self.turret.position - self.steering.position)

    @property
    def truth(self) -> Odometry:
        """True pose and velocity, in `map`."""
        pose = Pose2(x_m=self.x_m, y_m=self.y_m, heading_rad=wrap_angle(self.heading_rad))
        return Odometry(pose=pose, twist=self._twist(1.0))

    @property
    def odometry(self) -> Odometry:
        """Pose and velocity measured by the encoders, in `odom`."""
        pose = self._odometry.pose(self.steering.position)
        return Odometry(pose=pose, twist=self._twist(self._odometry.scale))

    def _twist(self, scale: float) -> Twist2:
        speed, rate = self.translation.velocity, self.steering.velocity
        return Twist2(linear_m_per_s=scale * speed, steering_rad_per_s=rate)

    @property
    def bumpers(self) -> tuple[bool, ...]:
        """The 20 tactile sensors; sensor i sits at 18 i degrees on the base."""
        touched_rad = self.walls.touch_directions_rad(self.x_m, self.y_m)
        return pressed_bumpers(touched_rad, self.base_yaw_rad)

    def advance(self, dt_s: float) -> None:
        """Simulate a time."""
        left_s = dt_s
        while left_s > DONE_S:
            step_s = self._advance_piece(min(left_s, self._watchdog_left_s))
            self.turret.advance(step_s)
            left_s -= step_s
            self._watchdog_left_s -= step_s
            if self._watchdog_left_s <= DONE_S:
                self._watchdog_left_s = math.inf
                self.stop()
                usual_m_per_s2 = self.config.translation_acceleration_m_per_s2
                self.translation.brake(self.watchdog_braking_m_per_s2 or usual_m_per_s2)

    def _advance_piece(self, limit_s: float) -> float:
        """Advance while all accelerations are constant; return the time advanced."""
        limit_s = min(limit_s, self.steering.piece_s)
        translation = self.translation
        speed, acceleration = translation.velocity, translation.piece_acceleration
        if speed == 0.0 and acceleration == 0.0:
            self.steering.advance_piece(limit_s)
            return limit_s
        step_s = min(limit_s, translation.piece_s)
        reach_m = abs(speed + 0.5 * acceleration * step_s) * step_s
        if self.walls.clearance_m(self.x_m, self.y_m) > reach_m:
            self._roll(step_s)
            return step_s
        return self._advance_near_wall(limit_s, step_s)

    def _advance_near_wall(self, limit_s: float, step_s: float) -> float:
        """Advance to a wall, a change of quadrant or the end of the piece."""
        motion = self._true_motion()
        step_s = self._monotonic_s(motion, step_s)
        if not self._is_blocked(motion, step_s):
            passed = self.walls.passed(*self._position(motion, step_s))
            if not passed:
                self._roll(step_s)
                return step_s
            touch_s = first_crossing(lambda t: self._gap_m(passed, motion, t), step_s)
            if touch_s > DONE_S:
                self._roll(touch_s)
                self.translation.stall()
                return touch_s
        self.translation.stall()
        turning = self._wheel_motion()._replace(heading_rad=self.heading_rad)
        step_s = self._monotonic_s(turning, limit_s)
        self.steering.advance_piece(step_s)
        return step_s

    def _monotonic_s(self, motion: Motion, limit_s: float) -> float:
        """Return until when every gap only shrinks or only grows, at most `limit_s`."""
        limit_s = quarter_turn_time(motion, limit_s)
        return self.walls.monotonic_s(lambda t: self._position(motion, t), motion, limit_s)

    def _is_blocked(self, motion: Motion, step_s: float) -> bool:
        """Return whether a touched wall blocks the motion, evaluated at the piece's middle."""
        middle_s = 0.5 * step_s
        turn_rad_per_s = motion.turn_rad_per_s + 0.5 * motion.turn_rad_per_s2 * middle_s
        middle_rad = motion.heading_rad + turn_rad_per_s * middle_s
        sign = math.copysign(1.0, motion.speed_m_per_s or motion.acceleration_m_per_s2)
        along_x, along_y = sign * math.cos(middle_rad), sign * math.sin(middle_rad)
        return self.walls.blocks(self.x_m, self.y_m, along_x, along_y)

    def _gap_m(self, walls: tuple[int, ...], motion: Motion, dt_s: float) -> float:
        """Return the smallest gap to the given walls after a time."""
        gaps_m = self.walls.gaps_m(*self._position(motion, dt_s))
        return min(gaps_m[wall] for wall in walls)

    def _position(self, motion: Motion, dt_s: float) -> tuple[float, float]:
        dx_m, dy_m = displacement(motion, dt_s)
        return self.x_m + dx_m, self.y_m + dy_m

    def _wheel_motion(self) -> Motion:
        """Return the present piece of motion relative to the base."""
        steering, translation = self.steering, self.translation
        turn, turn_change = steering.velocity, steering.piece_acceleration
        speed, acceleration = translation.velocity, translation.piece_acceleration
        return Motion(steering.position, turn, turn_change, speed, acceleration)

    def _true_motion(self) -> Motion:
        """Return the present piece of motion in `map`, where slip adds to the turning rate."""
        steering_rad, turn, turn_change, speed, acceleration = self._wheel_motion()
        slip = math.copysign(1.0, speed or acceleration) * self.drift_rad_per_m
        turn, turn_change = turn + slip * speed, turn_change + slip * acceleration
        return Motion(self.base_yaw_rad + steering_rad, turn, turn_change, speed, acceleration)

    def _roll(self, dt_s: float) -> None:
        """Advance without contact within a piece, and update the encoders."""
        motion = self._true_motion()
        self.x_m, self.y_m = self.walls.clamp(*self._position(motion, dt_s))
        self._odometry.count(self._wheel_motion(), dt_s)
        mean_m_per_s = motion.speed_m_per_s + 0.5 * motion.acceleration_m_per_s2 * dt_s
        self.base_yaw_rad += self.drift_rad_per_m * abs(mean_m_per_s) * dt_s
        self.translation.advance_piece(dt_s)
        self.steering.advance_piece(dt_s)
