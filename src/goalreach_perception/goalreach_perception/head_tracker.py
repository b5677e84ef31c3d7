"""Control of turret, pan and tilt: centre the landmarks, or search for them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
import math

from goalreach_msgs_py.angles import deg, wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.tags import CORNERS
from goalreach_msgs_py.topics import HEAD_JOINTS
from goalreach_msgs_py.values import HeadAngles
from goalreach_perception.measurement_model import HEADING, PAN_BIAS, TILT_BIAS, Lens
from goalreach_perception.pose_filter import PoseFilter

_RIGHT_ANGLE = math.pi / 2


@dataclass(frozen=True, kw_only=True)
class HeadConfig(Configuration):
    """Ranges of the head and parameters of its tracker."""

    pan_limit_rad: float = parameter(
        deg(87.0), 'Pan range to each side, rad (the paper: 174 deg in all)', within=(0.0, math.pi)
    )
    tilt_minimum_rad: float = parameter(
        deg(-20.0),
        'Lower end of the tilt range, rad (the paper: 70 deg in all; its place is chosen)',
        within=(-_RIGHT_ANGLE, _RIGHT_ANGLE),
    )
    tilt_maximum_rad: float = parameter(
        deg(50.0),
        'Upper end of the tilt range, rad (the paper: 70 deg in all; its place is chosen)',
        within=(-_RIGHT_ANGLE, _RIGHT_ANGLE),
    )
    view_margin_px: float = parameter(
        24.0,
        'An LED nearer than this to the border of the image is not in view, px (chosen)',
        within=(0.0, 1000.0),
    )
    search_tilt_rad: float = parameter(
        deg(20.0),
        'Tilt while searching, rad (chosen: LEDs rise 3.5 deg and more)',
        within=(-_RIGHT_ANGLE, _RIGHT_ANGLE),
    )
    search_high_tilt_rad: float = parameter(
        deg(40.0),
        'Tilt in every other turn of the search, rad (chosen: LEDs that are near)',
        within=(-_RIGHT_ANGLE, _RIGHT_ANGLE),
    )
    search_turn_rad: float = parameter(
        deg(400.0),
        'How far the turret turns before the search changes its tilt, rad (chosen: more than a '
        'full circle at each tilt)',
        within=(0.1, 20.0),
    )
    search_lead_rad: float = parameter(
        deg(150.0),
        'How far ahead of itself the turret is sent while searching, rad (chosen: beyond its '
        'braking distance at 90 deg/s)',
        within=(0.0, 3.0),
    )

    def __post_init__(self) -> None:
        """Check every field, and that the tilt range is one."""
        super().__post_init__()
        if self.tilt_minimum_rad > self.tilt_maximum_rad:
            raise ConfigurationError(
                'tilt_minimum_rad', self.tilt_minimum_rad, f'at most {self.tilt_maximum_rad:g}'
            )

    def clip_tilt(self, tilt_rad: float) -> float:
        """Return the nearest tilt within the range."""
        return min(max(tilt_rad, self.tilt_minimum_rad), self.tilt_maximum_rad)


_AT_END_RAD = math.radians(4.0)
_SLOW_LEAD_RAD = math.radians(5.0)
"""How far ahead the turret is sent after a fruitless turn at each tilt. Chosen: it then turns at
20 to 40 deg/s, and an exposure of 20 ms draws a spot out to 4 to 8 pixels."""


class HeadSearch:
    """Scans with the head until LEDs are found.

    The turret turns in one direction. Pan first moves to its end against that direction, then to
    its end in it, and stays there: with the motors of a Nomad 200 all azimuths are scanned within
    three seconds, and again with every turn of the turret. After a little more than a turn the
    tilt alternates between low and high; high is for near LEDs. After both, the turret slows down.
    """

    def __init__(self, config: HeadConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Restart with the next call of `step`."""
        self._turret_sign = 0.0
        self._towards_end = False
        self._last_turret_rad = 0.0
        self._turned_rad = 0.0

    def step(self, joints: HeadAngles) -> HeadAngles:
        """Return the next joint targets of the scan."""
        config = self._config
        limit = config.pan_limit_rad
        if self._turret_sign == 0.0:
            self._turret_sign = -1.0 if joints.pan_rad > 0.0 else 1.0
            self._last_turret_rad = joints.turret_rad
        if joints.pan_rad * self._turret_sign < -limit + _AT_END_RAD:
            self._towards_end = True
        turned = math.remainder(joints.turret_rad - self._last_turret_rad, math.tau)
        self._turned_rad += abs(turned)
        self._last_turret_rad = joints.turret_rad
        high = self._turned_rad % (2.0 * config.search_turn_rad) > config.search_turn_rad
        slow = self._turned_rad > 2.0 * config.search_turn_rad
        lead_rad = _SLOW_LEAD_RAD if slow else config.search_lead_rad
        return HeadAngles(
            turret_rad=joints.turret_rad + self._turret_sign * lead_rad,
            pan_rad=(1.0 if self._towards_end else -1.0) * self._turret_sign * limit,
            tilt_rad=config.clip_tilt(
                config.search_high_tilt_rad if high else config.search_tilt_rad
            ),
        )


class PanSearch(HeadSearch):
    """Scans with a head without a turret: pan goes from end to end, low and high in turn."""

    def step(self, joints: HeadAngles) -> HeadAngles:
        """Return the next joint targets of the scan."""
        config, limit = self._config, self._config.pan_limit_rad
        self._turret_sign = self._turret_sign or (-1.0 if joints.pan_rad > 0.0 else 1.0)
        if joints.pan_rad * self._turret_sign > limit - _AT_END_RAD:
            self._turret_sign = -self._turret_sign
            self._towards_end = not self._towards_end
        tilt_rad = config.search_high_tilt_rad if self._towards_end else config.search_tilt_rad
        pan_rad = self._turret_sign * limit
        return HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=config.clip_tilt(tilt_rad))


_WIDER_RAD = deg(5.0)
"""Hysteresis: how much wider another set of LEDs must be to replace the current one. Chosen."""
_ENTRY_SLACK = 0.96
"""Hysteresis: another set of LEDs must fit into this fraction of the image. Chosen."""
_LEAST_DEPTH_M = 0.01


class HeadTracker:
    """Computes joint targets, one set per image.

    While tracking, the turret goes to the azimuth of the landmarks and the pan joint compensates
    for the lag of the slow turret, so that pan stays near zero. Without a turret pan does it all,
    and only LEDs within its range count.

    Args:
        config: Ranges and parameters.
        joints: Names of the joints that the head has.
        tags: Number of tags, whose corners are the last landmarks; it aims at their centres.
    """

    def __init__(
        self, config: HeadConfig, joints: Sequence[str] = HEAD_JOINTS, tags: int = 0
    ) -> None:
        self._tags = tags
        if 'tilt_joint' not in joints:
            config = replace(config, tilt_minimum_rad=0.0, tilt_maximum_rad=0.0)
        self._config = config
        self._has_turret = 'turret_joint' in joints
        self._centred_leds: tuple[int, ...] = ()
        self._search = HeadSearch(config) if self._has_turret else PanSearch(config)
        self._last_azimuth_rad: float | None = None
        self._lift_rad = 0.0

    @property
    def highest_search_rad(self) -> float:
        """The highest tilt of a search."""
        config = self._config
        return config.clip_tilt(max(config.search_tilt_rad, config.search_high_tilt_rad))

    def restart_search(self) -> None:
        """Restart the search."""
        self._search.reset()

    def search(self, joints: HeadAngles) -> HeadAngles:
        """Return joint targets of the search; see `HeadSearch`."""
        self._centred_leds = ()
        self._last_azimuth_rad = None
        return self._search.step(joints)

    def follow(
        self,
        state: PoseFilter,
        read: HeadAngles,
        joints: HeadAngles,
        lens: Lens,
        held: Sequence[int],
    ) -> HeadAngles:
        """Return joint targets by the estimate of the last image.

        At the encoder readings `read`, a head with `joints` looks as the camera does. Landmarks
        that are held are centred even if another set fits better.
        """
        offsets_m: Sequence[Sequence[float]] = state.led_offsets_m
        if self._tags:
            leds = len(offsets_m) - CORNERS * self._tags
            corners = offsets_m[leds:]
            pairs = zip(corners[::CORNERS], corners[2::CORNERS], strict=True)
            centres = [[0.5 * (a + b) for a, b in zip(*pair, strict=True)] for pair in pairs]
            offsets_m = [*offsets_m[:leds], *centres]
            held = [min(k, leds + (k - leds) // CORNERS) for k in held]
        pan_rad, self._lift_rad = joints.pan_rad - read.pan_rad, joints.tilt_rad - read.tilt_rad
        return self.track(
            read,
            heading_rad=float(state.mean[HEADING]) + pan_rad,
            offsets_m=offsets_m,
            biases_rad=(float(state.mean[PAN_BIAS]), float(state.mean[TILT_BIAS])),
            lens=lens,
            hold=tuple(dict.fromkeys(held)),
        )

    def track(
        self,
        joints: HeadAngles,
        *,
        heading_rad: float,
        offsets_m: Sequence[Sequence[float]],
        biases_rad: tuple[float, float],
        lens: Lens,
        hold: tuple[int, ...] = (),
    ) -> HeadAngles:
        """Return joint targets that keep the landmarks in view one image later.

        Args:
            joints: Encoder readings.
            heading_rad: Estimated heading.
            offsets_m: n times x, y, z: estimated LED minus the axis at the height of the lens.
            biases_rad: Estimated pan and tilt bias.
            lens: The lens.
            hold: LEDs to centre even if another set fits better; empty for the best set.
        """
        self._search.reset()
        if hold:
            self._centred_leds = hold
            azimuth, tilt, _, _ = self._centre([offsets_m[i] for i in hold])
        else:
            azimuth, tilt = self.centre_leds(offsets_m, lens, heading_rad)
        turret_azimuth = heading_rad + joints.turret_rad
        turning = 0.0
        if self._last_azimuth_rad is not None:
            turning = wrap_angle(turret_azimuth - self._last_azimuth_rad)
        self._last_azimuth_rad = turret_azimuth
        to_go = wrap_angle(azimuth - turret_azimuth)
        limit = self._config.pan_limit_rad
        return HeadAngles(
            turret_rad=joints.turret_rad + to_go,
            pan_rad=min(max(to_go - turning - biases_rad[0], -limit), limit),
            tilt_rad=self._clip(tilt - biases_rad[1]) - self._lift_rad,
        )

    def _clip(self, tilt_rad: float) -> float:
        """Return the nearest tilt of the camera that the joint reaches."""
        return self._config.clip_tilt(tilt_rad - self._lift_rad) + self._lift_rad

    def centre_leds(
        self, offsets_m: Sequence[Sequence[float]], lens: Lens, heading_rad: float = 0.0
    ) -> tuple[float, float]:
        """Return azimuth and tilt that centre all LEDs, or else the most that fit, widely apart.

        Args:
            offsets_m: (n, 3) estimated LED minus the axis at the height of the lens.
            lens: The lens.
            heading_rad: Estimated heading, from which pan counts where there is no turret.
        """
        azimuths = [math.atan2(y, x) for x, y, _ in offsets_m]
        everything = tuple(range(len(azimuths)))
        if not self._has_turret:
            turns = [abs(wrap_angle(azimuth - heading_rad)) for azimuth in azimuths]
            limit = self._config.pan_limit_rad
            everything = tuple(i for i in everything if turns[i] <= limit) or everything
        fx, fy, cx, cy = lens.intrinsics
        margin = self._config.view_margin_px
        half_u, half_v = (cx - margin) / fx, (cy - margin) / fy
        best: tuple[float, float] | None = None
        for leds in self._ordered(azimuths, everything):
            azimuth, tilt, reach_u, reach_v = self._centre([offsets_m[i] for i in leds])
            best = best or (azimuth, tilt)
            slack = 1.0 if leds == self._centred_leds else _ENTRY_SLACK
            if reach_u <= half_u * slack and reach_v <= half_v * slack:
                self._centred_leds = leds
                return azimuth, tilt
        self._centred_leds = ()
        return best or (0.0, 0.0)

    def _ordered(
        self, azimuths: Sequence[float], everything: tuple[int, ...]
    ) -> Iterator[tuple[int, ...]]:
        """Yield sets of LEDs by preference: all, then fewer neighbours, from wide to narrow."""
        yield everything
        around = sorted(everything, key=azimuths.__getitem__) * 2
        for size in range(len(everything) - 1, 1, -1):
            runs = {tuple(sorted(around[k : k + size])) for k in range(len(everything))}
            widths = {run: self._width(run, azimuths) for run in runs}
            yield from sorted(runs, key=lambda run: (widths[run], run), reverse=True)
        for i in everything:
            yield (i,)

    def _width(self, leds: tuple[int, ...], azimuths: Sequence[float]) -> float:
        """Return the largest angle between two LEDs, more for those that are centred now."""
        widths = (abs(wrap_angle(azimuths[j] - azimuths[i])) for i, j in combinations(leds, 2))
        return max(widths) + _WIDER_RAD * (leds == self._centred_leds)

    def _centre(self, places_m: Sequence[Sequence[float]]) -> tuple[float, float, float, float]:
        """Return azimuth and tilt that centre given LEDs, and their extent from the centre.

        Returns:
            Azimuth, tilt, and the largest slopes (offset / focal length) along u and v.
        """
        azimuths = [math.atan2(y, x) for x, y, _ in places_m]
        turns = [math.remainder(azimuth - azimuths[0], math.tau) for azimuth in azimuths]
        azimuth = azimuths[0] + 0.5 * (min(turns) + max(turns))
        rises = [math.atan2(z, math.hypot(x, y)) for x, y, z in places_m]
        tilt = self._clip(0.5 * (min(rises) + max(rises)))
        left, right, top, bottom = _extent(places_m, azimuth, tilt)
        azimuth -= math.atan(0.5 * (left + right) / math.cos(tilt))
        tilt = self._clip(tilt - math.atan(0.5 * (top + bottom)))
        left, right, top, bottom = _extent(places_m, azimuth, tilt)
        return azimuth, tilt, max(-left, right), max(-top, bottom)


def _extent(
    offsets_m: Sequence[Sequence[float]], azimuth: float, tilt: float
) -> tuple[float, float, float, float]:
    """Return the smallest and largest u and v of points, in focal lengths."""
    ca, sa, ct, st = math.cos(azimuth), math.sin(azimuth), math.cos(tilt), math.sin(tilt)
    across: list[float] = []
    down: list[float] = []
    for x, y, z in offsets_m:
        forward = ca * x + sa * y
        depth = max(ct * forward + st * z, _LEAST_DEPTH_M)
        across.append((sa * x - ca * y) / depth)
        down.append((st * forward - ct * z) / depth)
    return min(across), max(across), min(down), max(down)
