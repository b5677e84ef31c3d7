from collections.abc import Callable
import math

import numpy as np
import pytest

from goalreach_learning.actor import Actor, Option
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.learner import Situation
from goalreach_learning.policy import Policy
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.regions import RegionMap, memberships
from goalreach_msgs_py.values import Confidence, Pose2, Region, RegionState

PolicyMaker = Callable[[dict[Region, int]], Policy]
REGIONS = RegionMap()
X1, X2, Y1, Y2 = 1.1811, 2.3749, 1.6891, 3.3909


def state_at(x_m: float, y_m: float) -> RegionState:
    return RegionState(
        region=REGIONS.region_at(x_m, y_m),
        mu_x=memberships(x_m, REGIONS.x_knots_m),
        mu_y=memberships(y_m, REGIONS.y_knots_m),
        pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=0.0),
        goal_probability=0.0,
        confidence=Confidence.OK,
    )


def actor(policy: Policy, **config: object) -> Actor:
    return Actor(build_config(ControllerConfig, config), policy, np.random.default_rng(0))


def option(region: Region, action: int) -> Option:
    return Option(Situation(region=region, x_m=0.0, y_m=0.0), action)


def chosen(option: Option | None) -> tuple[Region, int] | None:
    return (option.begin.region, option.action) if option else None


@pytest.mark.parametrize(
    ('begun', 'x_m', 'y_m', 'expected'),
    [
        ((0, 1), X1 + 0.03, 3.0, None),  # three centimetres past the border: it may be jitter
        ((0, 1), X1 + 0.05, 3.0, (1, 1)),
        ((0, 1), X1 - 0.3, 3.0, None),
        ((0, 1), X1 - 0.3, Y1 - 0.03, None),
        ((0, 1), X1 - 0.3, Y1 - 0.05, (0, 0)),
        ((0, 1), X1 + 0.03, Y1 - 0.05, (1, 0)),
        ((1, 1), X1 - 0.03, 3.0, None),
        ((1, 1), X1 - 0.05, 3.0, (0, 1)),
        ((1, 1), 1.8, Y2 + 0.03, None),
        ((1, 1), 1.8, Y2 + 0.05, (1, 2)),
    ],
)
def test_a_region_counts_as_left_past_the_margin(
    begun: Region, x_m: float, y_m: float, expected: Region | None
) -> None:
    driver = actor(Policy.unlearned(RegionMap(goal=(2, 2))), region_margin_m=0.04)
    assert driver.region_after(option(begun, 0), state_at(x_m, y_m)) == expected


def test_an_option_ends_where_its_region_is_left(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(0, 1): 0}), mode='crisp')
    going = option((0, 1), 0)
    assert driver.region_after(going, state_at(X1 - 0.2, 3.0)) is None
    assert driver.region_after(going, state_at(X1 + 0.2, 3.0)) == (1, 1)


def test_an_option_continues_in_the_goal(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(0, 0): 0}), mode='crisp')
    assert driver.region_after(option((0, 0), 0), state_at(X1 + 0.3, 1.0)) is None


def test_chooses_the_learned_action(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(0, 1): 7}), mode='crisp')
    assert chosen(driver.choose(state_at(0.5, 2.5), 3)) == ((0, 1), 7)


def test_starting_in_the_undeclared_goal_takes_the_neighbours_action(
    make_policy: PolicyMaker,
) -> None:
    driver = actor(make_policy({(0, 0): 0, (1, 1): 6}), mode='crisp')
    assert chosen(driver.choose(state_at(X1 + 0.01, 1.0), 0)) == ((1, 0), 0)
    assert chosen(driver.choose(state_at(1.8, Y1 - 0.01), 0)) == ((1, 0), 6)
    assert driver.choose(state_at(1.8, 0.8), 0) is None


def test_along_the_edge_of_the_goal_it_turns_further_in(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(2, 0): 4, (1, 1): 6}), mode='crisp')
    coming_down = option((1, 1), 6)
    x_edge = X2 - 0.05
    above = driver.heading(coming_down, state_at(x_edge, Y1 + 0.3))
    assert above == pytest.approx(-math.pi / 2)
    inside = driver.heading(coming_down, state_at(x_edge, 1.0))
    assert inside == pytest.approx(math.pi)
    deep = driver.heading(coming_down, state_at(1.8, 1.0))
    assert deep is None  # nobody to ask: the last heading stays


def test_a_learner_keeps_to_its_action_in_the_goal(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(2, 0): 4}), learn=True)
    inside = driver.heading(option((1, 1), 6), state_at(X2 - 0.05, 1.0))
    assert inside == pytest.approx(-math.pi / 2)


def test_learns_only_if_configured(make_policy: PolicyMaker) -> None:
    policy = make_policy({})
    began = Option(Situation(region=(0, 0), x_m=0.5, y_m=1.6, trial=3, path=7), 2, 1.0)
    for settings, learns, expected in (
        ({'mode': 'crisp'}, True, False),
        ({'learn': True}, False, False),
        ({'learn': True}, True, True),
    ):
        driver = actor(policy, **settings)
        after = state_at(0.5, 1.75)
        transition, changed = driver.finish(began, after, (0, 1), learns=learns)
        assert (transition.state, transition.action, transition.next_state) == ((0, 0), 2, (0, 1))
        assert (transition.trial, transition.path, transition.temperature) == (3, 7, 1.0)
        assert (transition.reward, transition.outcome) == (0.0, None)
        assert changed is expected
        assert driver.policy.visits[0, 0, 2] == int(expected)


def test_explores_with_the_temperature_of_the_trial(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(0, 1): 7}), learn=True)
    config = driver.config.learning
    first, last = (driver.choose(state_at(0.5, 2.5), trial) for trial in (0, 19))
    assert first is not None
    assert last is not None
    assert first.temperature == config.temperature_start
    assert last.temperature == pytest.approx(config.temperature_end)
    tried = {driver.choose(state_at(0.5, 2.5), 0).action for _ in range(200)}  # type: ignore[union-attr]
    assert len(tried) == 8


def test_fuzzy_heading_is_the_blend(make_policy: PolicyMaker) -> None:
    driver = actor(make_policy({(0, 1): 0, (1, 1): 6}), mode='fuzzy')
    heading = driver.heading(None, state_at(X1, 2.5))  # half and half
    assert heading == pytest.approx(-math.pi / 4)
