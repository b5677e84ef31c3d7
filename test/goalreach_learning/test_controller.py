from collections.abc import Callable
import math
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_learning.behaviors import Surroundings
from goalreach_learning.controller import ControlStep, GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.steering import STANDING
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.regions import memberships
from goalreach_msgs_py.values import Confidence, PathOutcome, Pose2, Region, RegionState

PolicyMaker = Callable[[dict[Region, int]], Policy]
ARENA = Arena()
START = Pose2(x_m=0.5, y_m=2.5, heading_rad=0.0)


class Script:
    """Passes states to a controller at 25 Hz."""

    def __init__(self, policy: Policy, **config: object) -> None:
        self.controller = GoalReachingController(
            build_config(ControllerConfig, config), policy, np.random.default_rng(0)
        )
        self.tick = 0

    def see(
        self,
        x_m: float = 0.5,
        y_m: float = 2.5,
        heading_deg: float = 0.0,
        *,
        goal: float = 0.0,
        confidence: Confidence = Confidence.OK,
        bumped: bool = False,
        **more: Any,  # noqa: ANN401 - of any type
    ) -> ControlStep:
        regions = ARENA.regions
        state = RegionState(
            region=regions.region_at(x_m, y_m),
            mu_x=memberships(x_m, regions.x_knots_m),
            mu_y=memberships(y_m, regions.y_knots_m),
            pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg)),
            goal_probability=goal,
            confidence=confidence,
        )
        self.tick += 1
        time_ns = self.tick * 40_000_000
        return self.controller.step(time_ns=time_ns, state=state, bumped=bumped, **more)


def begun(policy: Policy, **config: object) -> Script:
    script = Script(policy, **config)
    script.controller.begin_path(start=START, path=4, trial=2)
    return script


def test_stands_until_a_path_begins(make_policy: PolicyMaker) -> None:
    assert Script(make_policy({(0, 1): 0})).see() == ControlStep(command=STANDING)


def test_waits_for_a_state_near_the_start(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0}), mode='crisp')
    for x_m, y_m in ((1.5, 2.5), (0.5, 5.0)):  # from before the reset
        assert script.see(x_m, y_m, bumped=True).command == STANDING
    assert script.see(confidence=Confidence.UNCERTAIN).command == STANDING
    assert script.see().command.linear_m_per_s > 0.0


def test_drives_from_anywhere_without_a_start(make_policy: PolicyMaker) -> None:
    script = Script(make_policy({(0, 1): 0}), mode='crisp')
    script.controller.begin_path(start=None, path=0, trial=0)
    assert script.see(0.9, 3.0).command.linear_m_per_s > 0.0


def test_crisp_turns_then_drives_then_reports_the_transition(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 6}), mode='crisp')
    step = script.see(heading_deg=90.0)
    assert step.command.linear_m_per_s == 0.0
    assert step.command.steering_rad_per_s < 0.0
    assert script.see(heading_deg=0.5).command.linear_m_per_s > 0.5
    assert script.see(1.0).transition is None
    step = script.see(1.3)
    transition = step.transition
    assert transition is not None
    assert (transition.state, transition.action, transition.next_state) == ((0, 1), 0, (1, 1))
    assert (transition.reward, transition.outcome) == (0.0, None)
    assert (transition.path, transition.trial, transition.temperature) == (4, 2, 0.0)
    assert step.heading_rad == pytest.approx(-math.pi / 2)
    assert step.command.linear_m_per_s == 0.0  # it stops to turn


def test_jitter_across_a_border_ends_no_action(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 4}), mode='crisp')
    script.see()
    assert script.see(1.30).transition is not None
    for x_m in (1.17, 1.19, 1.16, 1.19):  # the border is at 1.1811
        assert script.see(x_m, heading_deg=180.0).transition is None
    assert script.see(1.12, heading_deg=180.0).transition is not None


def test_declares_the_goal_only_when_confident(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 6}))
    script.see()
    step = script.see(1.8, 1.6, -90.0, goal=0.9)
    assert step.command.linear_m_per_s > 0.0
    end = script.see(1.8, 1.5, -90.0, goal=0.99995).transition
    assert end is not None
    assert (end.outcome, end.reward, end.next_state) == (PathOutcome.GOAL, 1.0, (1, 0))
    assert script.see(1.8, 1.5, goal=1.0) == ControlStep(command=STANDING)


def test_an_uncertain_state_declares_no_goal(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0}))
    script.see()
    step = script.see(1.8, 1.0, goal=1.0, confidence=Confidence.STALE)
    assert step.transition is None
    assert step.command == STANDING


def test_stops_while_uncertain_and_resumes(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0}), mode='crisp')
    before = script.see()
    waiting = script.see(confidence=Confidence.UNCERTAIN)
    assert waiting.command == STANDING
    assert waiting.heading_rad == before.heading_rad
    assert script.see().command == before.command


def test_without_a_head_it_looks_around_after_a_second_of_uncertainty(
    make_policy: PolicyMaker,
) -> None:
    script = begun(make_policy({(0, 1): 0}), mode='crisp')
    script.see()
    script.see()
    unsure = [script.see(confidence=Confidence.UNCERTAIN, head_turns=False) for _ in range(26)]
    rates = [step.command.steering_rad_per_s for step in unsure]
    assert rates == [0.0] * 24 + [pytest.approx(math.radians(30.0))] * 2
    assert script.see(confidence=Confidence.UNCERTAIN).command == STANDING  # the head turns
    assert script.see(confidence=Confidence.STALE, head_turns=False).command == STANDING
    script.see()
    again = script.see(confidence=Confidence.UNCERTAIN, head_turns=False)
    assert again.command == STANDING


def test_a_bump_tells_a_learner_where_the_wall_is(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({}), learn=True, learner='planner')
    script.see()
    pressed = [number == 3 for number in range(20)]  # at 54 degrees
    script.see(0.3, bumped=True, around=Surroundings(pressed=pressed))
    ((x, y, _),) = script.controller.policy.learner['state']['walls']
    assert math.degrees(math.atan2(y, x)) == pytest.approx(54.0)


def test_a_bump_ends_the_path(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 4}), mode='crisp')
    script.see(heading_deg=180.0)
    step = script.see(0.3, heading_deg=180.0, bumped=True)
    assert step.command == STANDING
    assert step.transition is not None
    assert (step.transition.outcome, step.transition.reward) == (PathOutcome.BUMP, -1.0)
    assert step.transition.next_state == (0, 1)


def test_a_timeout_ends_the_path_without_penalty(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({}), timeout_s=1.0, learn=True)
    ends = [script.see().transition for _ in range(26)]
    assert [end for end in ends if end is not None] == [ends[25]]
    assert ends[25] is not None
    assert (ends[25].outcome, ends[25].reward) == (PathOutcome.TIMEOUT, 0.0)
    assert script.controller.policy.visits.sum() == 0  # cut off: nothing is learned from it


def test_a_timeout_counts_while_waiting_for_the_start(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({}), timeout_s=1.0)
    ends = [script.see(3.0, 4.0).transition for _ in range(26)]
    assert ends[25] is not None


def test_the_same_stamp_gets_the_same_command_and_one_update(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({}), learn=True)
    script.see()
    first = script.see(0.3, bumped=True)
    assert first.policy_changed
    script.tick -= 1
    again = script.see(0.3, bumped=True)
    assert again.command == first.command
    assert again.transition is None
    assert script.controller.policy.visits.sum() == 1


def test_the_same_stamp_drives_on_the_same(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0}))
    first = script.see(heading_deg=30.0)
    script.tick -= 1
    assert script.see(heading_deg=40.0).command == first.command


def test_learns_while_driving(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(1, 1): 6}), learn=True)  # Q(FRONT/MEDIUM, 270) = 1
    script.see()
    step = script.see(1.4)
    assert step.policy_changed
    transition = step.transition
    assert transition is not None
    q = script.controller.policy.q[transition.state]
    assert q[transition.action] == pytest.approx(0.3 * 0.9 * 1.0)  # alpha * gamma * max Q(next)


def test_fuzzy_steers_without_stopping(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 6}))
    script.see()
    step = script.see(1.1, heading_deg=0.0)
    assert step.heading_rad is not None
    assert -math.pi / 2 < step.heading_rad < 0.0
    assert step.command.linear_m_per_s > 0.0
    assert step.command.steering_rad_per_s < 0.0


def test_fuzzy_reports_transitions_too(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 6}))
    script.see()
    transition = script.see(1.4).transition
    assert transition is not None
    assert (transition.state, transition.action, transition.next_state) == ((0, 1), 0, (1, 1))


def test_an_unlearned_policy_stops(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({}))
    assert script.see().command == STANDING


def test_mode_may_change_on_the_way(make_policy: PolicyMaker) -> None:
    script = begun(make_policy({(0, 1): 0, (1, 1): 6}))
    script.see()
    blended = script.see(1.1).heading_rad
    script.controller.actor.config = ControllerConfig(mode='crisp')
    assert blended != 0.0
    assert script.see(1.1).heading_rad == 0.0


@pytest.mark.parametrize('mode', ['crisp', 'fuzzy', 'fuzzy-eq3'])
def test_reaches_the_goal_from_all_22_starts(mode: str, closed_loop: Callable[..., Any]) -> None:
    for index, start in enumerate(ARENA.starts):
        drive = closed_loop().drive(start, seed=index, mode=mode)
        assert drive.outcome is PathOutcome.GOAL
        assert ARENA.regions.region_at(drive.truth.x_m, drive.truth.y_m) == (1, 0)
        assert drive.clearance_m > 0.05  # they begin at 0.1 m


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.tuples(st.floats(0.3, 3.25), st.floats(0.3, 4.78), st.floats(-3.14, 3.14)),
    st.integers(0, 2**31),
    st.sampled_from(['crisp', 'fuzzy']),
)
def test_reaches_the_goal_from_anywhere_without_grazing(
    closed_loop: Callable[..., Any], pose: tuple[float, float, float], seed: int, mode: str
) -> None:
    start = Pose2(x_m=pose[0], y_m=pose[1], heading_rad=pose[2])
    drive = closed_loop(noise=2.0).drive(start, seed=seed, mode=mode)
    assert drive.outcome is PathOutcome.GOAL
    assert drive.clearance_m > 0.02


def test_fuzzy_headings_change_gently(closed_loop: Callable[..., Any]) -> None:
    for index in (0, 5, 9, 12, 17):
        drive = closed_loop().drive(ARENA.starts[index], seed=index, mode='fuzzy')
        assert drive.heading_step_rad < math.radians(10.0)


def test_declares_the_goal_soon_after_it_is_entered(closed_loop: Callable[..., Any]) -> None:
    drive = closed_loop(noise=0.0).drive(ARENA.starts[10], seed=0, mode='fuzzy')
    assert 0.0 < ARENA.regions.y_borders_m[1] - drive.truth.y_m < 0.05
