"""Many robots at once, each moving exactly as one `Robot` does, for sweeps and studies.

A batch does what `Robot.drive` can ask for: translation and steering by velocity commands, with
walls, wheel slip, encoders and the watchdog. It has no turret, which never changes where a robot
goes, and no relative moves. The robots do not feel each other.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from goalreach_lab.batch.batch_motion import (
    BatchMotion,
    BatchWalls,
    displacements,
    follow_ramp,
    quarter_turn_times,
    ramp_piece,
)
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.contact import TOUCH_M, Walls
from goalreach_sim.robot import NOTHING_S
from goalreach_sim.sensors import BUMPER_COUNT, pressed_bumpers
from goalreach_sim.simulator_config import DriveConfig

# Rows of the state, one column per robot: SI units; `*_YAW` is the heading less the steering.
X, Y, YAW, ODOM_X, ODOM_Y, ODOM_YAW, STEERING, TURN, SPEED = range(9)
TURN_TARGET, SPEED_TARGET, WATCHDOG, SCALE, DRIFT = range(9, 14)
_ROWS: Final = 14


class RobotBatch:
    """A number of synchro-drive robots, each alone in the same arena.

    Args:
        config: Limits of the axes.
        walls: What they may run into.
        count: How many they are.
        watchdog_s: A robot ramps to rest when no command came for so long after the last.
        odometry_scale: Distance by the encoders over distance driven, for all or for each.
        drift_rad_per_m: Turn of the base per metre driven, for all or for each.
    """

    def __init__(
        self,
        config: DriveConfig,
        walls: Walls,
        count: int,
        *,
        watchdog_s: float,
        odometry_scale: ArrayLike = 1.0,
        drift_rad_per_m: ArrayLike = 0.0,
    ) -> None:
        self.count = count
        self.watchdog_s = watchdog_s
        self._config = config
        self._walls = BatchWalls(walls)
        self._state = np.zeros((_ROWS, count))
        self._state[WATCHDOG] = math.inf
        self._state[SCALE] = odometry_scale
        self._state[DRIFT] = drift_rad_per_m

    def place(self, x_m: ArrayLike, y_m: ArrayLike, heading_rad: ArrayLike) -> None:
        """Let the robots stand at poses in `map`; their odometry starts there.

        Raises:
            ConfigurationError: A body would overlap a wall, or a heading is not finite.
        """
        state = self._state
        state[X], state[Y], state[YAW] = x_m, y_m, heading_rad
        clear = self._walls.clearances_m(state[X], state[Y]) >= -TOUCH_M
        good = clear & np.isfinite(state[YAW])
        if not good.all():
            bad = int(np.argmin(good))
            pose = tuple(state[: YAW + 1, bad].tolist())
            raise ConfigurationError(f'robot {bad}', pose, 'a finite pose on the free floor')
        state[ODOM_X : ODOM_YAW + 1] = state[X : YAW + 1]
        state[X], state[Y] = self._walls.clamp(state[X], state[Y])
        state[STEERING : SPEED_TARGET + 1] = 0.0
        state[WATCHDOG] = math.inf

    def drive(self, linear_m_per_s: ArrayLike, steering_rad_per_s: ArrayLike) -> None:
        """Take velocities, clipped to the limits, for all or for each; feeds the watchdogs.

        Raises:
            ValueError: One is not finite.
        """
        if not (np.isfinite(linear_m_per_s).all() and np.isfinite(steering_rad_per_s).all()):
            raise ValueError('a velocity is not finite')
        top, turn = self._config.translation_speed_m_per_s, self._config.steering_speed_rad_per_s
        self._state[SPEED_TARGET] = np.clip(linear_m_per_s, -top, top)
        self._state[TURN_TARGET] = np.clip(steering_rad_per_s, -turn, turn)
        self._state[WATCHDOG] = self.watchdog_s

    @property
    def poses(self) -> FloatArray:
        """True x (m), y (m) and drive heading (rad, not wrapped) in `map`, (3, count)."""
        state = self._state
        return np.stack([state[X], state[Y], state[YAW] + state[STEERING]])

    @property
    def odometry(self) -> FloatArray:
        """The same by the encoders, in `odom`, (3, count)."""
        state = self._state
        return np.stack([state[ODOM_X], state[ODOM_Y], state[ODOM_YAW] + state[STEERING]])

    @property
    def velocities(self) -> FloatArray:
        """True speed (m/s) and steering rate (rad/s), (2, count)."""
        return np.stack([self._state[SPEED], self._state[TURN]])

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which bodies touch a wall, (count,)."""
        touching: NDArray[np.bool_] = (
            self._walls.clearances_m(self._state[X], self._state[Y]) <= TOUCH_M
        )
        return touching

    @property
    def bumpers(self) -> NDArray[np.bool_]:
        """The tactile sensors of each robot, (count, 20)."""
        pressed = np.zeros((self.count, BUMPER_COUNT), dtype=np.bool_)
        for robot in np.flatnonzero(self.touching).tolist():
            x_m, y_m, yaw_rad = self._state[: YAW + 1, robot].tolist()
            directions_rad = self._walls.walls.touch_directions_rad(x_m, y_m)
            pressed[robot] = pressed_bumpers(directions_rad, yaw_rad)
        return pressed

    def advance(self, dt_s: float) -> None:
        """Let time pass for all."""
        left_s = self._advance_piece(self._state, np.full(self.count, dt_s))
        late = np.flatnonzero(left_s > NOTHING_S)
        left_s = left_s[late]
        while late.size:
            part = self._state[:, late]
            left_s = self._advance_piece(part, left_s)
            self._state[:, late] = part
            more = left_s > NOTHING_S
            late, left_s = late[more], left_s[more]

    def _advance_piece(self, state: FloatArray, left_s: FloatArray) -> FloatArray:
        """Let each go on while its accelerations are constant; return the time left to each."""
        config, speed = self._config, state[SPEED]
        turn_end, turn_piece_s, turn_change = ramp_piece(
            state[TURN], state[TURN_TARGET], config.steering_acceleration_rad_per_s2
        )
        end, piece_s, acceleration = ramp_piece(
            speed, state[SPEED_TARGET], config.translation_acceleration_m_per_s2
        )
        limit_s = np.minimum(np.minimum(left_s, state[WATCHDOG]), turn_piece_s)
        step_s = np.minimum(limit_s, piece_s)
        wheels = BatchMotion(state[STEERING], state[TURN], turn_change, speed, acceleration)
        reach_m = np.abs(speed + 0.5 * acceleration * step_s) * step_s
        moving = (speed != 0.0) | (acceleration != 0.0)
        near = moving & (self._walls.clearances_m(state[X], state[Y]) <= reach_m)
        stalled = np.flatnonzero(near)
        if stalled.size:
            part = state[:, stalled]
            step_s[stalled], rolls, stalls = self._near_wall(
                part, wheels.of(stalled), limit_s[stalled], step_s[stalled]
            )
            wheels.speed_m_per_s[stalled] *= rolls
            wheels.acceleration_m_per_s2[stalled] *= rolls
            stalled = stalled[stalls]
        self._roll(state, wheels, step_s)
        follow_ramp(state[TURN], turn_change, step_s, turn_end, turn_piece_s)
        follow_ramp(state[SPEED], acceleration, step_s, end, piece_s)
        state[SPEED, stalled] = 0.0
        _watch(state, step_s)
        later_s: FloatArray = left_s - step_s
        return later_s

    def _near_wall(
        self, state: FloatArray, wheels: BatchMotion, limit_s: FloatArray, step_s: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
        """Go on until a wall, a change of quadrant or the end of the piece, as `Robot` does.

        Returns:
            For how long, who moves on meanwhile, and who then stands against a wall.
        """
        walls, x_m, y_m = self._walls, state[X], state[Y]
        motion = _true_motion(state, wheels)
        step_s = quarter_turn_times(motion, step_s)
        middle_s = 0.5 * step_s
        turn = motion.turn_rad_per_s + 0.5 * motion.turn_rad_per_s2 * middle_s
        middle_rad = motion.heading_rad + turn * middle_s
        sign = _direction(wheels)
        blocked = walls.block(x_m, y_m, sign * np.cos(middle_rad), sign * np.sin(middle_rad))
        free = ~blocked & (walls.gaps_m(x_m, y_m, motion, step_s) >= -TOUCH_M).all(axis=0)
        rolls = free.copy()
        hits = np.flatnonzero(~blocked & ~free)
        if hits.size:
            touch_s = walls.crossing_times(x_m[hits], y_m[hits], motion.of(hits), step_s[hits])
            later = touch_s > NOTHING_S
            rolls[hits[later]] = True
            step_s[hits[later]] = touch_s[later]
        turning = wheels._replace(heading_rad=state[YAW] + state[STEERING])
        step_s = np.where(rolls, step_s, quarter_turn_times(turning, limit_s))
        return step_s, rolls, ~free

    def _roll(self, state: FloatArray, wheels: BatchMotion, step_s: FloatArray) -> None:
        """Move on unhindered within a piece, and count it with the encoders."""
        dx_m, dy_m = displacements(_true_motion(state, wheels), step_s)
        state[X], state[Y] = self._walls.clamp(state[X] + dx_m, state[Y] + dy_m)
        if state[DRIFT].any():
            dx_m, dy_m = displacements(wheels, step_s)
            turn_rad = state[ODOM_YAW]
        else:
            turn_rad = state[ODOM_YAW] - state[YAW]
        cosine, sine = state[SCALE] * np.cos(turn_rad), state[SCALE] * np.sin(turn_rad)
        state[ODOM_X] += cosine * dx_m - sine * dy_m
        state[ODOM_Y] += sine * dx_m + cosine * dy_m
        mean_m_per_s = wheels.speed_m_per_s + 0.5 * wheels.acceleration_m_per_s2 * step_s
        state[YAW] += state[DRIFT] * np.abs(mean_m_per_s) * step_s
        state[STEERING] += (wheels.turn_rad_per_s + 0.5 * wheels.turn_rad_per_s2 * step_s) * step_s


def _watch(state: FloatArray, step_s: FloatArray) -> None:
    """Count the watchdogs down; where one ends, the robot is to stop."""
    state[WATCHDOG] -= step_s
    ended = np.flatnonzero(state[WATCHDOG] <= NOTHING_S)
    state[WATCHDOG, ended] = math.inf
    state[TURN_TARGET : SPEED_TARGET + 1, ended] = 0.0


def _direction(wheels: BatchMotion) -> FloatArray:
    """Return 1 for robots that drive forwards or are about to, else -1."""
    speed, acceleration = wheels.speed_m_per_s, wheels.acceleration_m_per_s2
    sign: FloatArray = np.copysign(1.0, np.where(speed != 0.0, speed, acceleration))
    return sign


def _true_motion(state: FloatArray, wheels: BatchMotion) -> BatchMotion:
    """Return the motion in `map`, where slip adds to the turning rate."""
    slip = _direction(wheels) * state[DRIFT]
    return BatchMotion(
        state[YAW] + wheels.heading_rad,
        wheels.turn_rad_per_s + slip * wheels.speed_m_per_s,
        wheels.turn_rad_per_s2 + slip * wheels.acceleration_m_per_s2,
        wheels.speed_m_per_s,
        wheels.acceleration_m_per_s2,
    )
