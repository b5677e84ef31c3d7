"""Interpolation of inputs with their own clocks at the stamps of a leading input.

A camera, its base and its head each have their own stamps, rate and delay. Where all stamps are
equal, as in the simulator, the values are taken as they came, without any arithmetic.
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
import math
from typing import Any, Final

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2

Interpolation = Callable[[Any, Any, float], Any]
"""Value at a fraction of the way from one sample to the next; beyond [0, 1] it extrapolates."""
Sample = tuple[HeadAngles, Odometry]
"""Joints and odometry of one time."""
Sampled = Callable[[int], Sample]
"""Those of a time, nanoseconds."""

_NS_PER_S: Final = 1e9
_SAMPLES: Final = 256
"""Samples kept of each input: more than a second of any sensor here. Chosen."""
_RECENT: Final = 16
"""Samples that may be newer than a leading stamp without its being taken for late. Chosen."""
_LOCKSTEP_NS: Final = 5e9
"""Longer than a simulator in lockstep takes to send a lost tick again. Chosen."""
_BACK_NS: Final = 1_000_000_000
"""A sample this much older than the newest means that its clock was set back. Chosen."""


def interpolate_odometry(one: Odometry, other: Odometry, fraction: float) -> Odometry:
    """Return a pose between two samples, on a straight line, with the velocity of the second."""
    a, b = one.pose, other.pose
    x_m, y_m = a.x_m + fraction * (b.x_m - a.x_m), a.y_m + fraction * (b.y_m - a.y_m)
    turn_rad = fraction * angle_difference(b.heading_rad, a.heading_rad)
    pose = Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(a.heading_rad + turn_rad))
    return Odometry(pose=pose, twist=other.twist)


def interpolate_head(one: HeadAngles, other: HeadAngles, fraction: float) -> HeadAngles:
    """Return the joint angles between two samples, the shorter way round."""
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    turret, pan, tilt = (wrap_angle(a + fraction * angle_difference(b, a)) for a, b in pairs)
    return HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)


def moved_on(pose: Pose2, before: Pose2, after: Pose2) -> Pose2:
    """Return a pose in `map` after the motion between two poses in `odom`."""
    turn = pose.heading_rad - before.heading_rad
    cosine, sine = math.cos(turn), math.sin(turn)
    dx_m, dy_m = after.x_m - before.x_m, after.y_m - before.y_m
    x_m, y_m = pose.x_m + cosine * dx_m - sine * dy_m, pose.y_m + sine * dx_m + cosine * dy_m
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(after.heading_rad + turn))


def either_pressed(one: Sequence[bool], other: Sequence[bool], _: float) -> tuple[bool, ...]:
    """Return which bumpers are pressed in one of two samples."""
    return tuple(map(any, zip(one, other, strict=False)))


class _Series:
    """Recent samples of one input; `matched` where the last two have leading stamps."""

    def __init__(self, interpolate: Interpolation | None) -> None:
        self.interpolate = interpolate
        self.matched = False
        self.stamps: list[int] = []
        self._values: list[Any] = []

    def add(self, stamp_ns: int, value: object) -> None:
        """Append a sample; replace one that comes twice, ignore one that comes late."""
        back_ns = self.stamps[-1] - stamp_ns if self.stamps else -1
        if 0 < back_ns <= _BACK_NS:
            return
        kept = slice(1 - _SAMPLES, None if back_ns < 0 else -1) if back_ns <= 0 else slice(0)
        self.stamps = [*self.stamps[kept], stamp_ns]
        self._values = [*self._values[kept], value]

    def at(self, time_ns: int) -> tuple[int, Any]:
        """Return the time to the nearest sample, and the value.

        That is a sample as it is, or between two, or the last before where it holds.
        """
        stamps, values = self.stamps, self._values
        place = bisect_left(stamps, time_ns)
        gap_ns = min(abs(stamp - time_ns) for stamp in stamps[max(place - 1, 0) : place + 1])
        if gap_ns == 0:
            return 0, values[place]
        if self.interpolate is None or len(stamps) == 1:
            return gap_ns * (self.interpolate is not None), values[max(place - 1, 0)]
        place = min(max(place, 1), len(stamps) - 1)
        before, after = stamps[place - 1 : place + 1]
        fraction = (time_ns - before) / (after - before)
        return gap_ns, self.interpolate(values[place - 1], values[place], fraction)


class InputAligner:
    """Joins each value of a leading input, such as an image, with the others at its time.

    It is complete when every other input has a sample of its time or a later one. An input that
    has none is waited for until others are ahead by the limit, and at most the limit by the wall
    clock; 5 s where it has come with every leading stamp so far, since a simulator in lockstep
    then sends it again. Its nearest samples within the limit are then extrapolated; without any,
    the value is dropped. What holds is not waited for, unless it comes with every leading stamp.

    Args:
        leader: Name of the leading input.
        followers: How each other input is interpolated, by name; None where a value holds until
            the next.
        wait_s: The limit.
        delay_s: How much later than the truth the leading stamps are; where it is negative, later
            samples are waited for.
        depth: How many leading values may wait.

    Attributes:
        missing: How often each input made a value be dropped, since the first complete set.
        is_exact: Whether all samples of the last complete set had the leading stamp.

    >>> inputs = InputAligner('image', {'speed': lambda a, b, f: a + f * (b - a)}, wait_s=0.1)
    >>> inputs.add('speed', 10, 1.0, 0.0) + inputs.add('image', 15, 'I', 0.0)
    []
    >>> inputs.add('speed', 20, 2.0, 0.0)
    [(15, {'image': 'I', 'speed': 1.5})]
    """

    def __init__(
        self,
        leader: str,
        followers: Mapping[str, Interpolation | None],
        *,
        wait_s: float,
        delay_s: float = 0.0,
        depth: int = 16,
    ) -> None:
        self._leader = leader
        self._series = {name: _Series(how) for name, how in followers.items()}
        self._wait_ns, self._early_ns = wait_s * _NS_PER_S, round(max(-delay_s, 0.0) * _NS_PER_S)
        self._depth = depth
        self._waiting: dict[int, tuple[float, Any]] = {}
        self._newest_ns = 0
        self._last_ns: int | None = None
        self.missing = dict.fromkeys(self._series, 0)
        self.is_exact = True

    def add(
        self, name: str, stamp_ns: int, value: object, now_s: float
    ) -> list[tuple[int, dict[str, Any]]]:
        """Add a value of an input; return what is complete, in the order of the stamps.

        The present time is that of a steady clock.

        Returns:
            Leading stamps, each with the values by name. A leading stamp older than the last is
            ignored; the last one itself is completed again (a sender that repeats itself).
        """
        if not self._newest_ns - _BACK_NS <= stamp_ns <= self._newest_ns:
            self._newest_ns = stamp_ns
        if name != self._leader:
            self._series[name].add(stamp_ns, value)
        elif self._last_ns is None or stamp_ns >= self._last_ns:
            self._waiting[stamp_ns] = (now_s, value)
            if len(self._waiting) > self._depth:
                del self._waiting[next(iter(self._waiting))]
        return self.complete(now_s)

    def complete(self, now_s: float) -> list[tuple[int, dict[str, Any]]]:
        """Return what is complete by now, as `add` does."""
        sets = []
        while self._waiting:
            stamp_ns = min(self._waiting)
            since_s, value = self._waiting[stamp_ns]
            if self._must_wait(stamp_ns, (now_s - since_s) * _NS_PER_S):
                break
            del self._waiting[stamp_ns]
            followers = self._followers(stamp_ns)
            if len(followers) == len(self._series):
                sets.append((stamp_ns, {self._leader: value, **followers}))
        return sets

    @property
    def needs_clock(self) -> bool:
        """Whether a leading value waits by the wall clock: `complete` is to be called again."""
        return bool(self._waiting) and not all(one.matched for one in self._series.values())

    def has(self, name: str) -> bool:
        """Return whether an input has come yet."""
        return bool(self._series[name].stamps)

    def follower_at(self, name: str, time_ns: int) -> Any:  # noqa: ANN401 - of any input
        """Return the value of one input at any time, after the first complete set."""
        return self._series[name].at(time_ns)[1]

    def _must_wait(self, stamp_ns: int, waited_ns: float) -> bool:
        if self._newest_ns - stamp_ns > self._wait_ns:
            return False
        until_ns = stamp_ns + self._early_ns
        for series in self._series.values():
            held = series.interpolate is None and not series.matched
            limit_ns = max(self._wait_ns, _LOCKSTEP_NS) if series.matched else self._wait_ns
            if series.stamps and (held or waited_ns > limit_ns or series.stamps[-1] >= until_ns):
                continue
            return True
        return False

    def _followers(self, stamp_ns: int) -> dict[str, Any]:
        """Return the other inputs at a stamp; count those that are missing."""
        found, gaps_ns = {}, [0]
        for name, series in self._series.items():
            if series.stamps:
                gap_ns, value = series.at(stamp_ns)
                if gap_ns <= self._wait_ns:
                    found[name] = value
                    gaps_ns.append(gap_ns)
            self.missing[name] += name not in found and self._last_ns is not None
        if len(found) == len(self._series):
            for series in self._series.values():
                last = [stamp for stamp in series.stamps[-_RECENT:] if stamp <= stamp_ns][-2:]
                series.matched = last in ([self._last_ns, stamp_ns], [stamp_ns])
            self._last_ns, self.is_exact = stamp_ns, max(gaps_ns) == 0
        return found
