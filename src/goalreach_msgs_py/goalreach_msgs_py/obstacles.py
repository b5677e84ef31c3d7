"""Obstacles of an arena: cylinders and boxes, standing or on closed tracks."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
import itertools
import math

from goalreach_msgs_py.errors import ConfigurationError

_LARGEST_M = 100.0
_FASTEST_M_PER_S = 2.0
_FIELDS = 8
"""Numbers of an obstacle before those of its track: see `obstacles_to_flat`."""


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """An upright cylinder (a radius) or box (a length and a width) on the floor.

    Attributes:
        x_m: Centre in `map`.
        y_m: Centre in `map`.
        length_m: Size of a box along its own x axis; 0 for a cylinder.
        width_m: Size of a box along its own y axis; 0 for a cylinder.
        radius_m: Radius of a cylinder; 0 for a box.
        heading_rad: Direction of a box's own x axis in `map`.
        height_m: Height above the floor.
        speed_m_per_s: Speed along its track.
        track_m: Points (x, y) that it visits in turn before it returns to its first place, and
            begins again; empty if it stands. One point: it goes to and fro.

    Raises:
        ConfigurationError: A size or a speed that no obstacle has; the field is named.
    """

    x_m: float
    y_m: float
    length_m: float = 0.0
    width_m: float = 0.0
    radius_m: float = 0.0
    heading_rad: float = 0.0
    height_m: float = 0.6
    speed_m_per_s: float = 0.0
    track_m: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        box = self.length_m > 0.0 and self.width_m > 0.0
        if box == (self.radius_m > 0.0):
            sizes = (self.length_m, self.width_m, self.radius_m)
            raise ConfigurationError('radius_m', sizes, 'a radius, or else a length and a width')
        for name in ('length_m', 'width_m', 'radius_m', 'height_m'):
            if not 0.0 <= getattr(self, name) <= _LARGEST_M:
                raise ConfigurationError(name, getattr(self, name), f'in [0, {_LARGEST_M:g}] m')
        if not 0.0 <= self.speed_m_per_s <= _FASTEST_M_PER_S:
            allowed = f'in [0, {_FASTEST_M_PER_S:g}] m/s'
            raise ConfigurationError('speed_m_per_s', self.speed_m_per_s, allowed)
        if (self.speed_m_per_s > 0.0) != (self._lap_m > 0.0):
            raise ConfigurationError('track_m', self.track_m, 'given together with a speed')

    @property
    def _corners_m(self) -> tuple[tuple[float, float], ...]:
        start_m = (self.x_m, self.y_m)
        return (start_m, *self.track_m, start_m)

    @property
    def _lap_m(self) -> float:
        return sum(itertools.starmap(math.dist, itertools.pairwise(self._corners_m)))

    def after(self, driven_m: float) -> 'Obstacle':
        """Return the obstacle as it stands after a distance along its track, without a track."""
        if not self.track_m:
            return self
        left_m = driven_m % self._lap_m
        for (x0_m, y0_m), (x1_m, y1_m) in itertools.pairwise(self._corners_m):
            length_m = math.hypot(x1_m - x0_m, y1_m - y0_m)
            if left_m < length_m:
                break
            left_m -= length_m
        share = min(left_m / length_m, 1.0) if length_m else 0.0
        x_m, y_m = x0_m + share * (x1_m - x0_m), y0_m + share * (y1_m - y0_m)
        return replace(self, x_m=x_m, y_m=y_m, track_m=(), speed_m_per_s=0.0)

    def contact(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the distance of a point in `map` from the surface, and the azimuth of the way in.

        Returns:
            Metres, negative inside; radians in `map`.
        """
        dx_m, dy_m = x_m - self.x_m, y_m - self.y_m
        if self.radius_m:
            return math.hypot(dx_m, dy_m) - self.radius_m, math.atan2(-dy_m, -dx_m)
        along, across = self._own(dx_m, dy_m)
        out_x_m, out_y_m = abs(along) - 0.5 * self.length_m, abs(across) - 0.5 * self.width_m
        if max(out_x_m, out_y_m) <= 0.0:
            inner_x_m, inner_y_m = float(out_x_m >= out_y_m), float(out_x_m < out_y_m)
        else:
            inner_x_m, inner_y_m = max(out_x_m, 0.0), max(out_y_m, 0.0)
        distance_m = math.hypot(max(out_x_m, 0.0), max(out_y_m, 0.0))
        azimuth_rad = math.atan2(
            -math.copysign(inner_y_m, across), -math.copysign(inner_x_m, along)
        )
        return distance_m + min(max(out_x_m, out_y_m), 0.0), azimuth_rad + self.heading_rad

    def chord(
        self, x_m: float, y_m: float, dx_m: float, dy_m: float
    ) -> tuple[float, float] | None:
        """Return where a line seen from above enters and leaves, or None where it does not.

        The line leads from a point in `map` along a vector, which is not zero.

        Returns:
            Fractions of the vector, which may lie outside [0, 1].
        """
        x_m, y_m = x_m - self.x_m, y_m - self.y_m
        if self.radius_m:
            square = dx_m * dx_m + dy_m * dy_m
            nearest = -(x_m * dx_m + y_m * dy_m) / square
            gap_x_m, gap_y_m = x_m + nearest * dx_m, y_m + nearest * dy_m
            chord = self.radius_m * self.radius_m - gap_x_m * gap_x_m - gap_y_m * gap_y_m
            half = math.sqrt(chord / square) if chord > 0.0 else 0.0
            return (nearest - half, nearest + half) if half else None
        enter, leave = -math.inf, math.inf
        sizes = (0.5 * self.length_m, 0.5 * self.width_m)
        for at, step, size in zip(self._own(x_m, y_m), self._own(dx_m, dy_m), sizes, strict=True):
            if step == 0.0:
                if abs(at) >= size:
                    return None
                continue
            near, far = sorted(((-size - at) / step, (size - at) / step))
            enter, leave = max(enter, near), min(leave, far)
        return (enter, leave) if enter < leave else None

    def _own(self, dx_m: float, dy_m: float) -> tuple[float, float]:
        """Return a vector in the axes of a box."""
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return cosine * dx_m + sine * dy_m, cosine * dy_m - sine * dx_m


def obstacles_to_flat(obstacles: Iterable[Obstacle]) -> tuple[float, ...]:
    """Return obstacles as the numbers of a parameter.

    Of each in turn: x, y, length, width, radius, heading, height, speed, the number of points of
    its track, and x, y of each of them.
    """
    flat: list[float] = []
    for one in obstacles:
        *numbers, track_m = vars(one).values()
        flat += [*numbers, float(len(track_m)), *itertools.chain.from_iterable(track_m)]
    return tuple(flat)


def obstacles_from_flat(values: Sequence[float]) -> tuple[Obstacle, ...]:
    """Return the obstacles that `obstacles_to_flat` wrote.

    Raises:
        ConfigurationError: Numbers are missing, or describe no obstacle.
    """
    obstacles, rest = [], list(values)
    names = tuple(Obstacle.__dataclass_fields__)[:_FIELDS]
    while rest:
        numbers, given = rest[:_FIELDS], rest[_FIELDS] if len(rest) > _FIELDS else -1
        count = int(given)
        points, rest = rest[_FIELDS + 1 :][: 2 * count], rest[_FIELDS + 1 + 2 * count :]
        if not 0 <= given == count == len(points) / 2:
            allowed = f'{_FIELDS} numbers, a count of points, and two for each, of each obstacle'
            raise ConfigurationError('obstacles', tuple(values), allowed)
        track_m = tuple(zip(points[::2], points[1::2], strict=True))
        obstacles.append(Obstacle(**dict(zip(names, numbers, strict=True)), track_m=track_m))
    return tuple(obstacles)
