"""Behaviours as proposals, and how they are combined: `first(escape, blend(avoid, goal))`.

A behaviour looks at the senses and proposes a direction with a weight and a speed limit, or
nothing. `blend` averages directions as the fuzzy regions do with their votes; `first` is the
subsumption of R. A. Brooks ("A robust layered control system for a mobile robot", IEEE J. Robotics
and Automation 2, 1986): the first that proposes anything suppresses the rest.
"""

import ast
import cmath
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from pkgutil import resolve_name
import re
from typing import Final, NamedTuple

from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.local_map import LocalMap
from goalreach_learning.steering import HeadingFollower
from goalreach_msgs_py.alignment import moved_on
from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Confidence, Pose2, RegionState, Scan, Twist2

GOAL: Final = 'goal'
BEHAVIORS: Final = {
    GOAL: f'{__name__}:goal_reaching',
    'avoid': 'goalreach_learning.avoidance:Avoid',
    'escape': 'goalreach_learning.avoidance:Escape',
    'patience': 'goalreach_learning.avoidance:Patience',
}
"""The project's own behaviours, by name."""
_OPPOSED: Final = 1e-6
_PERIOD_NS: Final = 100_000_000
"""Time from one decision to the next, of every third image; a bumper is heeded at once. Chosen:
the robot drives at most 6 cm meanwhile."""
_SILENCE: Final = Scan(first_rad=0.0, step_rad=1.0, ranges_m=())


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """What a behaviour asks for.

    Attributes:
        heading_rad: Direction to drive in `map`, radians; None to limit the speed alone.
        weight: Its weight in a blend; that of goal-reaching is 1.
        limit_m_per_s: Largest speed.
        either_way: Whether the robot may drive backwards there, if that is the shorter turn.
    """

    heading_rad: float | None = None
    weight: float = 1.0
    limit_m_per_s: float = math.inf
    either_way: bool = False

    @property
    def vote(self) -> complex:
        """The direction as a vector as long as the weight; 0 without a direction."""
        return 0j if self.heading_rad is None else cmath.rect(self.weight, self.heading_rad)


@dataclass(frozen=True, kw_only=True)
class Senses:
    """What behaviours look at.

    Attributes:
        time_s: Time of the robot's clock, seconds.
        pose: Estimated pose in `map`.
        sure: Whether its covariance is small; otherwise the pose is that of dead reckoning.
        goal: What goal-reaching proposes; nothing while it waits.
        map: What the sonar and the bumpers have found so far.
        regions: The regions, whose outer borders are the walls, and the goal.
        touched_rad: Azimuths in `map` of what the bumpers touch.
        speed_m_per_s: Speed commanded last.
    """

    time_s: float
    pose: Pose2
    sure: bool = True
    goal: Proposal | None = None
    map: LocalMap
    regions: RegionMap
    touched_rad: Sequence[float] = ()
    speed_m_per_s: float = 0.0

    @property
    def gap_m(self) -> float:
        """Gap between the body and the nearest obstacle in the map, metres."""
        return float(self.map.obstacles_m[self.map.cells(self.pose)])


class Opinion(NamedTuple):
    """What one behaviour proposed, and whether it was heard."""

    name: str
    proposal: Proposal | None
    heard: bool


def blend(proposals: Sequence[Proposal]) -> Proposal | None:
    """Return the weighted mean of the directions, with the smallest limit; one alone as it is.

    Directions that cancel out leave that of the largest weight.
    """
    if len(proposals) < 2:  # noqa: PLR2004 - nothing to blend
        return first(proposals)
    limit = min(one.limit_m_per_s for one in proposals)
    votes = [one.vote for one in proposals]
    mixed, total = sum(votes), sum(map(abs, votes))
    strongest = replace(max(proposals, key=lambda one: abs(one.vote)), limit_m_per_s=limit)
    if abs(mixed) <= _OPPOSED * total:
        return strongest
    return replace(strongest, heading_rad=cmath.phase(mixed), weight=total)


def first(proposals: Sequence[Proposal]) -> Proposal | None:
    """Return the first proposal."""
    return proposals[0] if proposals else None


def goal_reaching(senses: Senses) -> Proposal | None:
    """Propose what goal-reaching does."""
    return senses.goal


Answer = tuple[Proposal | None, tuple[Opinion, ...]]
"""What is proposed, and the opinion of each behaviour."""
Ask = Callable[[Senses], Answer]


def read_behaviors(text: str) -> Ask:
    """Return what asks a combination of behaviours: names, `blend(...)`, `first(...)`.

    A name is one of `BEHAVIORS` or `module:attribute`, a function of `Senses` or a class
    without arguments whose objects are called like one. `3*avoid` multiplies its weights.

    Raises:
        ConfigurationError: It cannot be read, or a behaviour cannot be found.
    """
    try:
        # module:attribute is no expression of Python; as a text it is.
        quoted = re.sub(r'[\w.]+:[\w.]+', r'"\g<0>"', text.strip())
        return _part(ast.parse(quoted, mode='eval').body, 1.0)
    except Exception as error:  # noqa: BLE001 - a module of the user's may raise anything
        allowed = f'{", ".join(BEHAVIORS)} or module:attribute in first(...) and blend(...)'
        raise ConfigurationError('behaviors', text, f'{allowed}: {error!r}') from None


def _part(node: ast.expr, weight: float) -> Ask:
    """Return what asks a part of the text, and multiplies the weights of its proposals."""
    match node:
        case ast.Name(id=name) | ast.Constant(value=str(name)):
            return _one(name, weight)
        case ast.BinOp(left=ast.Constant(value=int(w) | float(w)), op=ast.Mult(), right=right):
            return _part(right, weight * w)
        case ast.Call(func=ast.Name(id='blend' | 'first' as name), args=args, keywords=[]):
            return _several(name, [_part(part, weight) for part in args])
    raise ValueError(f'{ast.unparse(node)} is none')


def _one(name: str, weight: float) -> Ask:
    if ':' not in (reference := BEHAVIORS.get(name, name)):
        raise ValueError(f'{name} is none')
    found = resolve_name(reference)
    behavior = found() if isinstance(found, type) else found

    def ask(senses: Senses) -> Answer:
        proposal: Proposal | None = behavior(senses)
        if proposal is not None and weight != 1.0:
            proposal = replace(proposal, weight=weight * proposal.weight)
        return proposal, (Opinion(name=name, proposal=proposal, heard=proposal is not None),)

    return ask


def _several(combinator: str, parts: Sequence[Ask]) -> Ask:
    combine = first if combinator == 'first' else blend

    def ask(senses: Senses) -> Answer:
        answers = [part(senses) for part in parts]
        combined = combine([proposal for proposal, _ in answers if proposal is not None])
        return combined, tuple(
            one._replace(heard=False) if combine is first and proposal is not combined else one
            for proposal, opinions in answers
            for one in opinions
        )

    return ask


class Surroundings(NamedTuple):
    """What the robot feels and hears around it.

    Attributes:
        pressed: The bumpers, counter-clockwise from the front of the base.
        scan: Ranges, or None without a sonar.
        odometry: Pose by the wheel encoders, which tells how the base stands under the steered
            wheels, and carries on where the pose is uncertain; that pose itself if None.
    """

    pressed: Sequence[bool] = ()
    scan: Scan | None = None
    odometry: Pose2 | None = None

    def touched_rad(self, base_rad: float) -> tuple[float, ...]:
        """Return the azimuths of what the body touches: the middle of each run of pressed bumpers.

        They are in `map`, radians in (-pi, pi], as is the orientation of the base. A body that is
        pressed all around touches nothing in particular.
        """
        pressed, count, azimuths = self.pressed, len(self.pressed), []
        for first in range(count):
            if pressed[first] and not pressed[first - 1]:
                length = next(n for n in range(1, count) if not pressed[(first + n) % count])
                middle = first + (length - 1) / 2
                azimuths.append(wrap_angle(base_rad + middle * 2.0 * math.pi / count))
        return tuple(azimuths)


class BehaviorStack:
    """Asks the behaviours, and drives where the one that is heard proposes.

    Attributes:
        regions: As given; with another goal from the time it moves.
        opinions: What each behaviour proposed last.
    """

    def __init__(self, config: ControllerConfig, regions: RegionMap) -> None:
        self._config, self.regions = config, regions
        self.opinions: tuple[Opinion, ...] = ()
        self._ask = read_behaviors(config.behaviors)
        self._map = LocalMap(regions, config.body_radius_m)
        self._wheels_rad: float | None = None
        self._speed_m_per_s = 0.0
        self._decided_ns = -_PERIOD_NS
        self._last_sure: tuple[Pose2, Pose2] | None = None
        self._heard: Proposal | None = None

    def sense(
        self, time_ns: int, state: RegionState, around: Surroundings, *, standing: bool
    ) -> None:
        """Add what is around to the map.

        While the state is uncertain, odometry carries the pose on. A robot that is standing has
        not driven off: its wheels are along the base.
        """
        pose, odometry = state.pose, around.odometry or state.pose
        self._sure = state.confidence is Confidence.OK
        if self._sure:
            self._last_sure = (pose, odometry)
        elif self._last_sure is not None:
            pose = moved_on(*self._last_sure, odometry)
        if standing or self._wheels_rad is None:
            self._wheels_rad = odometry.heading_rad
        base_rad = pose.heading_rad - (odometry.heading_rad - self._wheels_rad)
        touched_rad = around.touched_rad(base_rad)
        self._senses = Senses(
            time_s=time_ns * 1e-9,
            pose=pose,
            sure=self._sure,
            map=self._map,
            regions=self.regions,
            touched_rad=touched_rad,
            speed_m_per_s=self._speed_m_per_s,
        )
        self._due = bool(touched_rad) or not 0 <= time_ns - self._decided_ns < _PERIOD_NS
        if self._due:
            self._decided_ns = time_ns
            scan = (around.scan if self._last_sure else None) or _SILENCE
            turned_rad = base_rad if scan.on_base else pose.heading_rad
            self._map.update(pose, turned_rad, scan, touched_rad if self._last_sure else ())

    def drive(self, follower: HeadingFollower, goal: Twist2) -> Twist2:
        """Return the command for the proposal that is heard; that of goal-reaching as it is."""
        if self._due:
            proposal = Proposal(heading_rad=follower.heading_rad) if self._sure else None
            heard, self.opinions = self._ask(replace(self._senses, goal=proposal))
            self._heard = None if heard is proposal else heard
        command = goal if self._heard is None else self._follow(self._heard, follower, goal)
        self._speed_m_per_s = command.linear_m_per_s
        return command

    def _follow(self, heard: Proposal, follower: HeadingFollower, goal: Twist2) -> Twist2:
        command, backwards, pose = goal, False, self._senses.pose
        if heard.heading_rad is not None:
            error_rad = angle_difference(heard.heading_rad, pose.heading_rad)
            backwards = heard.either_way and abs(error_rad) > math.pi / 2.0
            follower.steer_to(wrap_angle(heard.heading_rad + math.pi * backwards))
            command = follower.command(pose, self._config)
        speed = min(command.linear_m_per_s, heard.limit_m_per_s)
        return replace(command, linear_m_per_s=-speed if backwards else speed)
