"""One motor axis with a trapezoidal velocity profile, exact for any step length.

A command becomes a sequence of pieces of constant acceleration, within which position and velocity
are polynomials of time: a second in one step or in a thousand steps gives the same state.
Units are those of the axis: metres or radians.
"""

import math

_Piece = tuple[float, float, float]
"""Duration (s), acceleration, velocity at the end."""

DONE_S = 1e-12
"""Shorter times count as zero; absorbs the rounding of sums of steps."""

_REST = 1e-9
"""Slower velocities, per second, are rest. Chosen: no motor holds them."""


class Axis:
    """An axis that follows velocity commands and relative moves within its limits.

    Attributes:
        position: Metres or radians, without wrapping.
        velocity: Per second.
        max_speed: Limit of every velocity command.
        speed: Cruising speed of relative moves.
        acceleration: Of every ramp; a change takes effect with the next command.
    """

    def __init__(self, *, max_speed: float, acceleration: float) -> None:
        self.max_speed = self.speed = max_speed
        self.acceleration = acceleration
        self.place(0.0)

    @property
    def piece_s(self) -> float:
        """Time until the acceleration changes next, seconds; infinite in steady motion."""
        return self._plan[-1][0] if self._plan else math.inf

    @property
    def piece_acceleration(self) -> float:
        """Acceleration of the present piece, within which the velocity keeps its sign."""
        return self._plan[-1][1] if self._plan else 0.0

    @property
    def is_moving(self) -> bool:
        """Whether the axis moves or has a motion planned."""
        return self.velocity != 0.0 or bool(self._plan)

    def place(self, position: float) -> None:
        """Set the position, at rest."""
        self.position = position
        self.velocity = self._target = 0.0
        self._goal: float | None = None
        self._plan: list[_Piece] = []

    def go(self, velocity: float) -> None:
        """Ramp to a velocity, clipped to `max_speed`, and hold it.

        Raises:
            ValueError: The velocity is not finite.
        """
        if not math.isfinite(velocity):
            raise ValueError(f'velocity {velocity!r} is not finite')
        target = min(max(velocity, -self.max_speed), self.max_speed)
        target = 0.0 if abs(target) < _REST else target  # else a ramp cannot tell its sign
        if target != self._target or self._goal is not None:
            self._ramp_to(target, self.acceleration)

    def brake(self, deceleration: float) -> None:
        """Ramp to rest with a deceleration that may exceed that of the axis."""
        self._ramp_to(0.0, deceleration)

    def _ramp_to(self, target: float, acceleration: float) -> None:
        self._target, self._goal = target, None
        self._plan = _ramp(self.velocity, target, acceleration)

    def move_by(self, distance: float) -> None:
        """Move by a distance in the shortest time and stop; stop now if `speed` is 0.

        Raises:
            ValueError: The distance is not finite.
        """
        if not math.isfinite(distance):
            raise ValueError(f'distance {distance!r} is not finite')
        if self.speed <= 0.0:
            self.go(0.0)
            return
        self._goal, self._target = self.position + distance, 0.0
        self._plan_move(distance)

    def stall(self) -> None:
        """Stop at once, as against a wall; the command stays in force and starts again."""
        self.velocity = 0.0
        if self._goal is None:
            self._plan = _ramp(0.0, self._target, self.acceleration)
        else:
            self._plan_move(self._goal - self.position)

    def _plan_move(self, distance: float) -> None:
        self._plan = _trapezoid(distance, self.velocity, self.speed, self.acceleration)
        if not self._plan:
            self.velocity, self._goal = 0.0, None

    def advance_piece(self, dt_s: float) -> None:
        """Advance by a time that is not longer than `piece_s`."""
        if not self._plan:
            self.position += self.velocity * dt_s
            return
        duration_s, acceleration, end_velocity = self._plan[-1]
        self.position += (self.velocity + 0.5 * acceleration * dt_s) * dt_s
        left_s = duration_s - dt_s
        if left_s > DONE_S:
            self.velocity += acceleration * dt_s
            self._plan[-1] = (left_s, acceleration, end_velocity)
            return
        self.velocity = end_velocity
        self._plan.pop()
        if not self._plan and self._goal is not None:
            self.position, self._goal = self._goal, None

    def advance(self, dt_s: float) -> None:
        """Advance by any time."""
        if self.velocity == 0.0 and not self._plan:
            return
        while dt_s > DONE_S:
            step_s = min(dt_s, self.piece_s)
            self.advance_piece(step_s)
            dt_s -= step_s


def _ramp(velocity: float, target: float, acceleration: float) -> list[_Piece]:
    """Return the pieces, last first, that lead from one velocity to another."""
    pieces: list[_Piece] = []
    if velocity * target < 0.0:
        pieces = [(abs(target) / acceleration, math.copysign(acceleration, target), target)]
        target = 0.0
    if velocity != target:
        change = target - velocity
        pieces.append((abs(change) / acceleration, math.copysign(acceleration, change), target))
    return pieces


def _trapezoid(
    distance: float, velocity: float, speed: float, acceleration: float
) -> list[_Piece]:
    """Return the pieces, last first, of the fastest move over a distance that ends at rest."""
    stopping = velocity * abs(velocity) / (2.0 * acceleration)
    sign = math.copysign(1.0, distance - stopping)
    pieces: list[_Piece] = []
    if sign * velocity < 0.0:
        pieces.append((abs(velocity) / acceleration, sign * acceleration, 0.0))
        distance, velocity = distance - stopping, 0.0
    distance, velocity = sign * distance, sign * velocity
    if velocity > speed:
        pieces.append(((velocity - speed) / acceleration, -sign * acceleration, sign * speed))
        distance -= (velocity * velocity - speed * speed) / (2.0 * acceleration)
        velocity = speed
    peak = min(speed, math.sqrt(max(acceleration * distance + velocity * velocity / 2.0, 0.0)))
    if peak > 0.0:
        ramps = (2.0 * peak * peak - velocity * velocity) / (2.0 * acceleration)
        pieces.append(((peak - velocity) / acceleration, sign * acceleration, sign * peak))
        pieces.append(((distance - ramps) / peak, 0.0, sign * peak))
        pieces.append((peak / acceleration, -sign * acceleration, 0.0))
    return [piece for piece in reversed(pieces) if piece[0] > DONE_S]
