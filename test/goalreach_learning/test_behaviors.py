from dataclasses import replace
import math

import numpy as np
import pytest

from goalreach_learning.avoidance import Avoid, Escape, Patience
from goalreach_learning.behaviors import (
    BehaviorStack,
    Proposal,
    Senses,
    Surroundings,
    blend,
    first,
    read_behaviors,
)
from goalreach_learning.controller import ControlStep, GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.local_map import LocalMap
from goalreach_learning.policy_file import read_policy
from goalreach_learning.steering import HeadingFollower
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Confidence, Pose2, RegionState, Scan, Twist2

REGIONS = RegionMap()
ALL = 'first(escape, blend(avoid, patience, goal))'
DOWN = -math.pi / 2


def at(x_m: float, y_m: float, heading_rad: float = DOWN) -> Pose2:
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def senses(**fields: object) -> Senses:
    given = {
        'time_s': 0.0,
        'pose': at(1.8, 3.0),
        'goal': Proposal(heading_rad=DOWN),
        'map': LocalMap(REGIONS, 0.225),
        'regions': REGIONS,
    }
    return Senses(**{**given, **fields})  # type: ignore[arg-type]


def scan_of(ranges_m: dict[int, float]) -> Scan:
    """Return a sonar ring that hears only what is given by sensor."""
    found = tuple(ranges_m.get(sensor, math.inf) for sensor in range(16))
    return Scan(first_rad=0.0, step_rad=math.tau / 16, ranges_m=found)


def gap_m(local: LocalMap, x_m: float, y_m: float) -> float:
    return float(local.obstacles_m[local.cells(at(x_m, y_m))])


def state_at(pose: Pose2, confidence: Confidence = Confidence.OK) -> RegionState:
    mu_x, mu_y = REGIONS.memberships_at(pose.x_m, pose.y_m)
    return RegionState(
        region=REGIONS.region_at(pose.x_m, pose.y_m),
        mu_x=mu_x,
        mu_y=mu_y,
        pose=pose,
        goal_probability=0.0,
        confidence=confidence,
    )


def step(
    controller: GoalReachingController, tick: int, pose: Pose2, around: Surroundings
) -> ControlStep:
    bumped = any(around.pressed)
    return controller.step(
        time_ns=tick * 40_000_000, state=state_at(pose), bumped=bumped, around=around
    )


def make_controller(behaviors: str, start: Pose2) -> GoalReachingController:
    config = ControllerConfig(behaviors=behaviors)
    controller = GoalReachingController(config, read_policy('paper'), np.random.default_rng(1))
    controller.begin_path(start=start, path=0, trial=0)
    return controller


def test_a_blend_averages_unit_vectors_and_keeps_the_smallest_limit() -> None:
    # 3 along x and 4 along y: atan(4 / 3).
    mixed = blend(
        [
            Proposal(heading_rad=0.0, weight=3.0, limit_m_per_s=0.4),
            Proposal(heading_rad=math.pi / 2, weight=4.0),
            Proposal(limit_m_per_s=0.2),
        ]
    )
    assert mixed is not None
    assert mixed.heading_rad == pytest.approx(math.atan2(4.0, 3.0))
    assert (mixed.weight, mixed.limit_m_per_s) == (7.0, 0.2)


def test_directions_that_cancel_out_leave_the_strongest() -> None:
    strong = Proposal(heading_rad=0.0, weight=1.0, limit_m_per_s=0.3)
    assert blend([strong, Proposal(heading_rad=math.pi)]) == strong


def test_one_proposal_is_heard_as_it_is() -> None:
    only = Proposal(heading_rad=0.3)
    assert blend([only]) is only
    assert first([only, Proposal()]) is only
    assert blend([]) is first([]) is None


def turn_left(senses: Senses) -> Proposal:
    return Proposal(heading_rad=senses.pose.heading_rad + 0.5, weight=3.0)


def slow(_senses: Senses) -> Proposal:
    return Proposal(limit_m_per_s=0.1)


def nothing(_senses: Senses) -> None:
    return None


def test_who_proposed_and_who_was_heard() -> None:
    ask = read_behaviors(f'first({__name__}:nothing, 2*{__name__}:turn_left, blend(avoid, goal))')
    heard, opinions = ask(senses())
    assert heard == Proposal(heading_rad=DOWN + 0.5, weight=6.0)
    found = [(one.name.rpartition(':')[2], one.heard) for one in opinions]
    assert found == [('nothing', False), ('turn_left', True), ('avoid', False), ('goal', False)]


@pytest.mark.parametrize(
    'text', ['', 'first(', 'goal, avoid', 'swim', 'no.module:thing', 'max(goal)', 'blend(goal=1)']
)
def test_a_combination_that_cannot_be_read_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match='behaviors'):
        read_behaviors(text)


def test_without_obstacles_the_others_change_no_bit() -> None:
    alone, among = (make_controller(text, at(1.0, 4.0)) for text in ('goal', ALL))
    rng = np.random.default_rng(2)
    for tick in range(200):
        pose = at(1.0 + 0.004 * tick, 4.0 - 0.01 * tick, DOWN + 0.2 * math.sin(tick))
        # Walls all around, heard with errors.
        walls = {0: pose.y_m, 4: 3.556 - pose.x_m, 8: 5.08 - pose.y_m, 12: pose.x_m}
        heard = scan_of({k: m * (1 + 0.01 * rng.standard_normal()) for k, m in walls.items()})
        around = Surroundings(scan=heard, odometry=pose, pressed=(False,) * 20)
        assert step(alone, tick, pose, around) == step(among, tick, pose, around)


def test_what_is_heard_is_followed() -> None:
    controller = make_controller(f'{__name__}:turn_left', at(1.8, 3.9))
    found = step(controller, 0, at(1.8, 3.9), Surroundings())
    assert found.heading_rad == pytest.approx(DOWN + 0.5)
    stack = BehaviorStack(ControllerConfig(behaviors=f'{__name__}:slow'), REGIONS)
    stack.sense(0, state_at(at(1.8, 3.9)), Surroundings(), standing=False)
    given = Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.2)
    assert stack.drive(HeadingFollower(), given) == replace(given, linear_m_per_s=0.1)


def test_what_is_ahead_bends_the_way_and_slows() -> None:
    controller = make_controller(ALL, at(1.8, 3.9))
    for tick in range(60):
        pose = at(1.8, 3.9)
        heard = {} if tick < 20 else {0: 0.7}
        around = Surroundings(scan=scan_of(heard), odometry=at(1.8, 3.9), pressed=(False,) * 20)
        blocked = step(controller, tick, pose, around)
        if tick == 19:
            straight = blocked
    assert straight.heading_rad is not None
    assert straight.heading_rad == pytest.approx(DOWN, abs=0.3)
    assert blocked.heading_rad is not None
    assert abs(blocked.heading_rad - DOWN) > 0.3
    assert blocked.command.linear_m_per_s < straight.command.linear_m_per_s


def test_a_bump_is_backed_off_from_and_remembered() -> None:
    escape, local = Escape(), LocalMap(REGIONS, 0.225)
    pose = at(1.8, 3.0)
    local.update(pose, DOWN, scan_of({}), [DOWN])
    off = escape(senses(map=local, touched_rad=[DOWN]))
    assert off is not None
    assert off.heading_rad == pytest.approx(math.pi / 2)
    assert off.either_way
    assert escape(senses(map=local, time_s=0.9)) == off
    assert escape(senses(map=local, time_s=1.1)) is None
    assert gap_m(local, 1.8, 3.0) < 0.05
    assert gap_m(local, 1.8, 3.5) > 0.4


def test_a_bump_ends_a_path_only_where_nothing_escapes() -> None:
    for text, ends in (('goal', True), ('blend(avoid, goal)', True), (ALL, False)):
        controller = make_controller(text, at(1.8, 3.9))
        pressed = (True,) + (False,) * 19
        around = Surroundings(pressed=pressed, odometry=at(1.8, 3.9))
        steps = [step(controller, tick, at(1.8, 3.9), around) for tick in range(3)]
        assert any(one.transition is not None for one in steps) is ends
    assert steps[-1].command == Twist2(linear_m_per_s=-0.25, steering_rad_per_s=0.0)


def test_a_reading_is_where_it_was_heard_and_clears_what_is_nearer() -> None:
    local = LocalMap(REGIONS, 0.225)
    pose = at(1.8, 3.0, 0.0)
    for _ in range(4):
        local.update(pose, 0.0, scan_of({0: 0.8}), ())
    assert gap_m(local, 2.6, 3.0) < 0.0 < gap_m(local, 2.2, 3.0)
    for _ in range(4, 12):
        local.update(pose, 0.0, scan_of({0: 1.1}), ())
    assert gap_m(local, 2.5, 3.0) > 0.0


def test_the_way_leads_round_a_box_and_costs_more_where_it_is_tight() -> None:
    local = LocalMap(REGIONS, 0.225)
    assert local.empty
    for _ in range(4):
        local.update(at(1.8, 3.0), DOWN, scan_of({15: 0.7, 0: 0.7, 1: 0.7}), ())
    straight_m = 3.0 - 1.2
    ways_m = local.ways_m((1.3, 0.0, 2.2, 1.2), at(1.8, 3.0))
    here, blocked, aside = (
        float(ways_m[local.cells(pose)]) for pose in (at(1.8, 3.0), at(1.8, 2.3), at(1.0, 2.3))
    )
    assert straight_m + 0.1 < here < 1.6 * straight_m
    assert blocked > aside


def test_what_comes_nearer_by_itself_is_given_way() -> None:
    local, patience = LocalMap(REGIONS, 0.225), Patience()
    answers = []
    for tick in range(18):
        time_s = 0.1 * tick
        local.update(at(1.8, 3.0), DOWN, scan_of({0: 1.0 - 0.04 * tick}), ())
        answers.append(patience(senses(map=local, time_s=time_s)))
    assert answers[0] is answers[1] is None
    last = answers[-1]
    assert last is not None
    assert last.heading_rad is not None
    assert math.cos(last.heading_rad - math.pi / 2) > 0.7


def test_a_lost_robot_goes_on_slowly_by_odometry() -> None:
    local, avoid = LocalMap(REGIONS, 0.225), Avoid()
    for _ in range(4):
        local.update(at(1.8, 4.0), DOWN, scan_of({0: 0.9}), ())
    assert avoid(senses(map=local, pose=at(0.6, 4.0))) is None
    lost = avoid(senses(map=local, time_s=1.0, pose=at(0.6, 3.5), sure=False, goal=None))
    assert lost is not None
    assert lost.heading_rad is not None
    assert math.sin(lost.heading_rad) < -0.5
    assert lost.limit_m_per_s < 0.3


def test_too_near_it_leaves_at_once_ahead_or_backwards_as_it_drives() -> None:
    local = LocalMap(REGIONS, 0.225)
    local.empty, local.obstacles_m = False, np.full_like(local.walls_m, 0.04)
    for speed_m_per_s, heading_rad in ((0.0, DOWN), (-0.1, -DOWN)):
        off = Avoid()(senses(map=local, speed_m_per_s=speed_m_per_s))
        assert off is not None
        assert off.heading_rad == pytest.approx(heading_rad)
