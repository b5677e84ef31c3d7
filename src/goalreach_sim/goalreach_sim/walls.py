"""Walls with obstacles between them: contact with standing and with moving ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

from goalreach_msgs_py.obstacles import Obstacle
from goalreach_sim.path_integral import Motion, quarter_turn_time

TOUCH_M = 1e-12
"""Largest gap that counts as contact; chosen, a thousand times the rounding of a coordinate."""

_GRAZE = 1e-13
"""A motion with a smaller component into the wall runs along it; chosen."""

_BISECTIONS = 60

_DIRECTIONS_RAD = (math.pi, 0.0, -math.pi / 2.0, math.pi / 2.0)
"""Azimuths in `map` of the walls, in the order of `Walls.gaps_m`."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_SECTIONS = 60
"""Golden sections of a step, which leave 1e-12 of it."""
_PUSHES = 4
"""Rounds in which a body between several obstacles is moved out of each. Chosen."""


@dataclass(kw_only=True)
class Walls:
    """The free floor for the robot's centre, between walls and obstacles.

    Robot and obstacles move in turns, one step each. A moving obstacle that runs into the robot
    turns back along its track, as people do. Obstacles do not stop one another.

    Attributes:
        obstacles: The obstacles at the start of their tracks, then as they stand now.
    """

    width_m: float
    length_m: float
    body_radius_m: float
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        self._high_x_m = self.width_m - self.body_radius_m
        self._high_y_m = self.length_m - self.body_radius_m
        self._tracks = tuple(self.obstacles)
        self.restart()

    def restart(self) -> None:
        """Put every obstacle at the start of its track."""
        self._driven_m = [0.0] * len(self._tracks)
        self._speeds_m_per_s = [track.speed_m_per_s for track in self._tracks]
        self.obstacles = tuple(one.after(0.0) for one in self._tracks)

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Return the smallest gap to a wall or obstacle, negative where the body overlaps it."""
        return min(self.gaps_m(x_m, y_m))

    def gaps_m(self, x_m: float, y_m: float) -> tuple[float, ...]:
        """Return the gap to each wall: small x, large x, small y, large y; then each obstacle."""
        radius_m = self.body_radius_m
        gaps_m = (one.contact(x_m, y_m)[0] - radius_m for one in self.obstacles)
        return x_m - radius_m, self._high_x_m - x_m, y_m - radius_m, self._high_y_m - y_m, *gaps_m

    def passed(self, x_m: float, y_m: float) -> tuple[int, ...]:
        """Return the indices (see `gaps_m`) of walls and obstacles that the body overlaps.

        A wall that is overlapped by less than rounding is one along which the robot slides.
        """
        return tuple(i for i, gap_m in enumerate(self.gaps_m(x_m, y_m)) if gap_m < -TOUCH_M)

    def blocks(self, x_m: float, y_m: float, direction_x: float, direction_y: float) -> bool:
        """Return whether a touched wall or obstacle stops motion along a unit vector."""
        return any(
            direction_x * math.cos(azimuth) + direction_y * math.sin(azimuth) > _GRAZE
            for azimuth in self.touch_directions_rad(x_m, y_m)
        )

    def touch_directions_rad(self, x_m: float, y_m: float) -> tuple[float, ...]:
        """Return the azimuths in `map` in which the body touches walls and obstacles."""
        obstacles = (one.contact(x_m, y_m)[1] for one in self.obstacles)
        pairs = zip((*_DIRECTIONS_RAD, *obstacles), self.gaps_m(x_m, y_m), strict=True)
        return tuple(azimuth for azimuth, gap_m in pairs if gap_m <= TOUCH_M)

    def clamp(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return a point of the free floor nearby; without obstacles the nearest."""
        x_m, y_m = self._between_walls(x_m, y_m)
        for _ in range(_PUSHES if self.obstacles else 0):
            for one in self.obstacles:
                distance_m, azimuth = one.contact(x_m, y_m)
                if (overlap_m := self.body_radius_m - distance_m) > TOUCH_M:
                    x_m -= overlap_m * math.cos(azimuth)
                    y_m -= overlap_m * math.sin(azimuth)
            x_m, y_m = self._between_walls(x_m, y_m)
        return x_m, y_m

    def _between_walls(self, x_m: float, y_m: float) -> tuple[float, float]:
        y_m = min(max(y_m, self.body_radius_m), self._high_y_m)
        return min(max(x_m, self.body_radius_m), self._high_x_m), y_m

    def monotonic_s(
        self, at: Callable[[float], tuple[float, float]], motion: Motion, limit_s: float
    ) -> float:
        """Return until when no gap turns from shrinking to growing, at most `limit_s`."""
        x_m, y_m = at(0.0)
        speed = abs(motion.speed_m_per_s) + abs(motion.acceleration_m_per_s2) * limit_s
        for one in self.obstacles:
            distance_m, azimuth = one.contact(x_m, y_m)
            gap_m = distance_m - self.body_radius_m
            if gap_m <= TOUCH_M:
                relative = motion._replace(heading_rad=motion.heading_rad - azimuth)
                limit_s = quarter_turn_time(relative, limit_s)
            elif gap_m < speed * limit_s:
                limit_s = _closest_s(lambda t, one=one: one.contact(*at(t))[0], limit_s)  # type: ignore[misc]
        return limit_s

    def advance(self, dt_s: float, x_m: float, y_m: float) -> None:
        """Move the obstacles for a time, each at most until it runs into the robot."""
        moved = list(self.obstacles)
        for index, track in enumerate(self._tracks):
            if track.track_m:
                before_m, step_m = self._driven_m[index], self._speeds_m_per_s[index] * dt_s

                def gap_m(share: float, track: Obstacle = track) -> float:
                    there = track.after(before_m + share * step_m)  # noqa: B023 - called at once
                    return there.contact(x_m, y_m)[0] - self.body_radius_m

                share = 1.0
                if gap_m(1.0) < min(gap_m(0.0), 0.0):
                    self._speeds_m_per_s[index] *= -1.0
                    share = first_crossing(gap_m, 1.0) if gap_m(0.0) >= 0.0 else 0.0
                self._driven_m[index] = before_m + share * step_m
                moved[index] = track.after(self._driven_m[index])
        self.obstacles = tuple(moved)


def first_crossing(gap_m: Callable[[float], float], end_s: float) -> float:
    """Return when a gap that shrinks over [0, end] reaches zero, within rounding of the crossing.

    The gap, monotonic but for rounding, is not negative at 0 nor at the time returned, and
    negative at the end.
    """
    low_s, high_s = 0.0, end_s
    for _ in range(_BISECTIONS):
        middle_s = 0.5 * (low_s + high_s)
        low_s, high_s = (low_s, middle_s) if gap_m(middle_s) < 0.0 else (middle_s, high_s)
    return low_s


def _closest_s(distance_m: Callable[[float], float], limit_s: float) -> float:
    """Return when a distance is smallest, or `limit_s` where it only shrinks or only grows."""
    low_s, high_s = 0.0, limit_s
    for _ in range(_SECTIONS):
        left_s = high_s - _GOLDEN * (high_s - low_s)
        right_s = low_s + _GOLDEN * (high_s - low_s)
        nearer = distance_m(left_s) <= distance_m(right_s)
        low_s, high_s = (low_s, right_s) if nearer else (left_s, high_s)
    least_m = distance_m(low_s)
    turns = min(distance_m(0.0), distance_m(limit_s)) - least_m > TOUCH_M
    return low_s if turns else limit_s
