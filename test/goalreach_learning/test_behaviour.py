from collections.abc import Callable
import math

import numpy as np
import pytest

from goalreach_learning.behaviour import Behaviour, Option, settled_region
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.regions import RegionMap, memberships
from goalreach_msgs_py.values import Confidence, Pose2, Region, RegionState, Transition

PolicyMaker = Callable[[dict[Region, int]], Policy]
REGIONS = RegionMap()
X1, X2, Y1 = 1.1811, 2.3749, 1.6891


def state_at(x_m: float, y_m: float) -> RegionState:
    return RegionState(
        region=REGIONS.region_at(x_m, y_m),
        mu_x=memberships(x_m, REGIONS.x_knots_m),
        mu_y=memberships(y_m, REGIONS.y_knots_m),
        pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=0.0),
        goal_probability=0.0,
        confidence=Confidence.OK,
    )


def behaviour(policy: Policy, **config: object) -> Behaviour:
    return Behaviour(build_config(ControllerConfig, config), policy, np.random.default_rng(0))


def option(region: Region, action: int) -> Option:
    return Option(region=region, action=action, temperature=0.0)


@pytest.mark.parametrize(
    ('x_m', 'y_m', 'expected'),
    [
        (X1 + 0.03, 3.0, (0, 1)),  # three centimetres past the border: it may be jitter
        (X1 + 0.05, 3.0, (1, 1)),
        (X1 - 0.3, 3.0, (0, 1)),
        (X1 - 0.3, Y1 - 0.03, (0, 1)),
        (X1 - 0.3, Y1 - 0.05, (0, 0)),
        (X1 + 0.03, Y1 - 0.05, (1, 0)),
    ],
)
def test_a_region_counts_as_left_past_the_margin(x_m: float, y_m: float, expected: Region) -> None:
    assert settled_region((0, 1), state_at(x_m, y_m), REGIONS, 0.04) == expected


def test_an_option_ends_where_its_region_is_left(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(0, 1): 0}), mode='crisp')
    going = option((0, 1), 0)
    assert driver.region_after(going, state_at(X1 - 0.2, 3.0)) is None
    assert driver.region_after(going, state_at(X1 + 0.2, 3.0)) == (1, 1)


def test_an_option_continues_in_the_goal(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(0, 0): 0}), mode='crisp')
    assert driver.region_after(option((0, 0), 0), state_at(X1 + 0.3, 1.0)) is None


def test_chooses_the_learned_action(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(0, 1): 7}), mode='crisp')
    assert driver.choose(state_at(0.5, 2.5), 3) == option((0, 1), 7)


def test_starting_in_the_undeclared_goal_takes_the_neighbours_action(
    make_policy: PolicyMaker,
) -> None:
    driver = behaviour(make_policy({(0, 0): 0, (1, 1): 6}), mode='crisp')
    assert driver.choose(state_at(X1 + 0.01, 1.0), 0) == option((1, 0), 0)
    assert driver.choose(state_at(1.8, Y1 - 0.01), 0) == option((1, 0), 6)
    assert driver.choose(state_at(1.8, 0.8), 0) is None


def test_along_the_edge_of_the_goal_it_turns_further_in(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(2, 0): 4, (1, 1): 6}), mode='crisp')
    coming_down = option((1, 1), 6)
    x_edge = X2 - 0.05
    above = driver.heading(coming_down, state_at(x_edge, Y1 + 0.3))
    assert above == pytest.approx(-math.pi / 2)
    inside = driver.heading(coming_down, state_at(x_edge, 1.0))
    assert inside == pytest.approx(math.pi)
    deep = driver.heading(coming_down, state_at(1.8, 1.0))
    assert deep is None  # nobody to ask: the last heading stays


def test_a_learner_keeps_to_its_action_in_the_goal(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(2, 0): 4}), learn=True)
    inside = driver.heading(option((1, 1), 6), state_at(X2 - 0.05, 1.0))
    assert inside == pytest.approx(-math.pi / 2)


def test_learns_only_if_configured(make_policy: PolicyMaker) -> None:
    policy = make_policy({})
    transition = Transition(
        state=(0, 0),
        action=2,
        reward=0.0,
        next_state=(0, 1),
        temperature=1.0,
        trial=0,
        path=0,
        outcome=None,
    )
    assert not behaviour(policy, mode='crisp').learn(transition)
    learner = behaviour(policy, learn=True)
    assert learner.learn(transition)
    assert learner.policy.visits[0, 0, 2] == 1


def test_explores_with_the_temperature_of_the_trial(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(0, 1): 7}), learn=True)
    config = driver.config.learning
    first, last = (driver.choose(state_at(0.5, 2.5), trial) for trial in (0, 19))
    assert first is not None
    assert last is not None
    assert first.temperature == config.temperature_start
    assert last.temperature == pytest.approx(config.temperature_end)
    tried = {driver.choose(state_at(0.5, 2.5), 0).action for _ in range(200)}  # type: ignore[union-attr]
    assert len(tried) == 8


def test_fuzzy_heading_is_the_blend(make_policy: PolicyMaker) -> None:
    driver = behaviour(make_policy({(0, 1): 0, (1, 1): 6}), mode='fuzzy')
    heading = driver.heading(None, state_at(X1, 2.5))  # half and half
    assert heading == pytest.approx(-math.pi / 4)
