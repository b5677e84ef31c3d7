"""Many robots at once, each moving exactly as one `Robot` does, to compare simulators.

A batch translates and steers by velocity commands, with walls and the watchdog, on a floor without
slip. It has no turret, odometry or sensors. The robots do not collide with each other.
"""

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
from goalreach_sim.robot import NOTHING_S, TOUCH_M, Walls
from goalreach_sim.simulator_config import DriveConfig

# Rows of the state, one column per robot: SI units.
X, Y, HEADING, TURN, SPEED, TURN_TARGET, SPEED_TARGET, WATCHDOG = range(8)
_ROWS: Final = 8


class RobotBatch:
    """A number of synchro-drive robots, each alone in the same arena.

    Args:
        config: Limits of the axes.
        walls: The walls.
        count: Number of robots.
        watchdog_s: Time after the last command at which a robot ramps to rest.
    """

    def __init__(
        self, config: DriveConfig, walls: Walls, count: int, *, watchdog_s: float
    ) -> None:
        self._watchdog_s = watchdog_s
        self._config = config
        self._walls = BatchWalls(walls)
        self._state = np.zeros((_ROWS, count))
        self._state[WATCHDOG] = math.inf

    def place(self, x_m: ArrayLike, y_m: ArrayLike, heading_rad: ArrayLike) -> None:
        """Place the robots at rest at poses in `map`.

        Raises:
            ConfigurationError: A body would overlap a wall, or a heading is not finite.
        """
        state = self._state
        state[X], state[Y], state[HEADING] = x_m, y_m, heading_rad
        clear = self._walls.clearances_m(state[X], state[Y]) >= -TOUCH_M
        good = clear & np.isfinite(state[HEADING])
        if not good.all():
            bad = int(np.argmin(good))
            pose = tuple(state[: HEADING + 1, bad].tolist())
            raise ConfigurationError(f'robot {bad}', pose, 'a finite pose on the free floor')
        state[X], state[Y] = self._walls.clamp(state[X], state[Y])
        state[TURN : SPEED_TARGET + 1] = 0.0
        state[WATCHDOG] = math.inf

    def drive(self, linear_m_per_s: ArrayLike, steering_rad_per_s: ArrayLike) -> None:
        """Command velocities, clipped to the limits, for all or for each; resets the watchdogs.

        Raises:
            ValueError: One is not finite.
        """
        if not (np.isfinite(linear_m_per_s).all() and np.isfinite(steering_rad_per_s).all()):
            raise ValueError('a velocity is not finite')
        top, turn = self._config.translation_speed_m_per_s, self._config.steering_speed_rad_per_s
        self._state[SPEED_TARGET] = np.clip(linear_m_per_s, -top, top)
        self._state[TURN_TARGET] = np.clip(steering_rad_per_s, -turn, turn)
        self._state[WATCHDOG] = self._watchdog_s

    @property
    def poses(self) -> FloatArray:
        """True x (m), y (m) and drive heading (rad, not wrapped) in `map`, (3, count)."""
        return self._state[: HEADING + 1].copy()

    @property
    def velocities(self) -> FloatArray:
        """True speed (m/s) and steering rate (rad/s), (2, count)."""
        return self._state[[SPEED, TURN]]

    def advance(self, dt_s: float) -> None:
        """Advance all robots by a time."""
        left_s = self._advance_piece(self._state, np.full(self._state.shape[1], dt_s))
        late = np.flatnonzero(left_s > NOTHING_S)
        left_s = left_s[late]
        while late.size:
            part = self._state[:, late]
            left_s = self._advance_piece(part, left_s)
            self._state[:, late] = part
            more = left_s > NOTHING_S
            late, left_s = late[more], left_s[more]

    def _advance_piece(self, state: FloatArray, left_s: FloatArray) -> FloatArray:
        """Advance each while its accelerations are constant; return the time left to each."""
        config, speed = self._config, state[SPEED]
        turn_end, turn_piece_s, turn_change = ramp_piece(
            state[TURN], state[TURN_TARGET], config.steering_acceleration_rad_per_s2
        )
        end, piece_s, acceleration = ramp_piece(
            speed, state[SPEED_TARGET], config.translation_acceleration_m_per_s2
        )
        limit_s = np.minimum(np.minimum(left_s, state[WATCHDOG]), turn_piece_s)
        step_s = np.minimum(limit_s, piece_s)
        motion = BatchMotion(state[HEADING], state[TURN], turn_change, speed, acceleration)
        reach_m = np.abs(speed + 0.5 * acceleration * step_s) * step_s
        moving = (speed != 0.0) | (acceleration != 0.0)
        near = moving & (self._walls.clearances_m(state[X], state[Y]) <= reach_m)
        stalled = np.flatnonzero(near)
        if stalled.size:
            step_s[stalled], rolls, stalls = self._near_wall(
                state[:, stalled], motion.of(stalled), limit_s[stalled], step_s[stalled]
            )
            motion.speed_m_per_s[stalled] *= rolls
            motion.acceleration_m_per_s2[stalled] *= rolls
            stalled = stalled[stalls]
        dx_m, dy_m = displacements(motion, step_s)
        state[X], state[Y] = self._walls.clamp(state[X] + dx_m, state[Y] + dy_m)
        state[HEADING] += (state[TURN] + 0.5 * turn_change * step_s) * step_s
        follow_ramp(state[TURN], turn_change, step_s, turn_end, turn_piece_s)
        follow_ramp(state[SPEED], acceleration, step_s, end, piece_s)
        state[SPEED, stalled] = 0.0
        _watch(state, step_s)
        later_s: FloatArray = left_s - step_s
        return later_s

    def _near_wall(
        self, state: FloatArray, motion: BatchMotion, limit_s: FloatArray, step_s: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
        """Find the next wall, change of quadrant or end of the piece, as `Robot` does.

        Returns:
            Time until then, which robots move on meanwhile, and which then stand against a wall.
        """
        walls, x_m, y_m = self._walls, state[X], state[Y]
        step_s = quarter_turn_times(motion, step_s)
        middle_s = 0.5 * step_s
        turn = motion.turn_rad_per_s + 0.5 * motion.turn_rad_per_s2 * middle_s
        middle_rad = motion.heading_rad + turn * middle_s
        speed, acceleration = motion.speed_m_per_s, motion.acceleration_m_per_s2
        sign = np.copysign(1.0, np.where(speed != 0.0, speed, acceleration))
        blocked = walls.block(x_m, y_m, sign * np.cos(middle_rad), sign * np.sin(middle_rad))
        free = ~blocked & (walls.gaps_m(x_m, y_m, motion, step_s) >= -TOUCH_M).all(axis=0)
        rolls = free.copy()
        hits = np.flatnonzero(~blocked & ~free)
        if hits.size:
            touch_s = walls.crossing_times(x_m[hits], y_m[hits], motion.of(hits), step_s[hits])
            later = touch_s > NOTHING_S
            rolls[hits[later]] = True
            step_s[hits[later]] = touch_s[later]
        step_s = np.where(rolls, step_s, quarter_turn_times(motion, limit_s))
        return step_s, rolls, ~free


def _watch(state: FloatArray, step_s: FloatArray) -> None:
    """Count the watchdogs down; a robot whose watchdog expires is to stop."""
    state[WATCHDOG] -= step_s
    ended = np.flatnonzero(state[WATCHDOG] <= NOTHING_S)
    state[WATCHDOG, ended] = math.inf
    state[TURN_TARGET : SPEED_TARGET + 1, ended] = 0.0
