"""From options to the parameters of every node."""

from dataclasses import replace
import math
from typing import Any

import pytest

from goalreach_bringup.launch.options import RunOptions, parse_start
from goalreach_bringup.launch.plan import choose_starts, plan_parameters
from goalreach_evaluation.starts import RunSeeds
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameter_file import NodeParameters
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT
from goalreach_msgs_py.values import Pose2

ARENA = Arena()
OPTIONS = RunOptions(seed=7)


def planned(user: dict[str, dict[str, Any]] | None = None, **changes: Any) -> Any:  # noqa: ANN401
    options = replace(OPTIONS, **changes)
    return plan_parameters(
        options,
        arena=ARENA,
        starts=choose_starts(options, ARENA),
        policy_path='policy.json',
        user=user or {},
    )


def test_every_node_gets_its_parameters() -> None:
    parameters = planned(paths=3)
    assert set(parameters) == set(NODES)
    assert parameters[CONTROLLER]['paths'] == 3
    assert len(parameters[CONTROLLER]['starts']) == 66
    assert parameters[ROBOT]['start_pose'] == parameters[CONTROLLER]['starts'][:3]
    assert parameters[ESTIMATOR]['x_knots_m'] == ARENA.regions.x_knots_m
    assert parameters[LOCALIZER]['landmarks_m'] == parameters[ROBOT]['landmarks_m']


def test_an_option_wins_over_the_file_and_the_file_over_the_default() -> None:
    user: NodeParameters = {CONTROLLER: {'mode': 'crisp'}, ROBOT: {'speed': 3.0}}
    assert planned(user)[CONTROLLER]['mode'] == 'crisp'
    assert planned(user, mode='fuzzy')[CONTROLLER]['mode'] == 'fuzzy'
    assert planned(user)[ROBOT]['speed'] == 3.0
    assert planned()[ROBOT]['speed'] == 1.0


@pytest.mark.parametrize(
    ('changes', 'consumers'),
    [
        ({'clock': 'realtime'}, 'mine'),
        ({'clock': 'realtime', 'record': 'bag'}, 'mine,recorder'),
        ({'clock': 'lockstep'}, 'mine,run_monitor'),
        ({'clock': 'lockstep', 'record': 'bag'}, 'mine,run_monitor,recorder'),
    ],
)
def test_monitor_and_recorder_are_consumers_besides_those_of_the_file(
    changes: dict[str, str], consumers: str
) -> None:
    assert planned({ROBOT: {'consumers': 'mine'}}, **changes)[ROBOT]['consumers'] == consumers


def test_noise_reaches_robot_and_localizer() -> None:
    harsh, nominal = planned(noise='harsh'), planned()
    for node in (ROBOT, LOCALIZER):
        name = 'noise.focal_error'
        assert harsh[node][name] == 2 * nominal[node][name]


@pytest.mark.parametrize(
    ('user', 'said'),
    [
        (
            {CONTROLLER: {'mood': 'bold'}},
            "goal_reaching_controller.mood = 'bold': must be a param",
        ),
        ({ROBOT: {'speed': -1.0}}, r'nomad200\.speed = -1\.0: must be a number in'),
        ({LOCALIZER: {'noise.focal_error': 'x'}}, r"landmark_localizer\.noise\.focal_error = 'x'"),
        ({ROBOT: {'sonar': 'loud'}}, "nomad200.sonar = 'loud': must be true or false"),
    ],
)
def test_a_bad_value_is_told_before_anything_starts(
    user: dict[str, dict[str, Any]], said: str
) -> None:
    with pytest.raises(ConfigurationError, match=said):
        planned(user)


def test_random_starts_are_free_repeatable_and_not_in_the_goal() -> None:
    options = replace(OPTIONS, starts='random', paths=50)
    starts = choose_starts(options, ARENA)
    assert starts == choose_starts(options, ARENA)
    assert starts != choose_starts(replace(options, seed=8), ARENA)
    assert len(starts) == 50
    for start in starts:
        assert ARENA.is_free(start.x_m, start.y_m)
        assert ARENA.regions.region_at(start.x_m, start.y_m) != ARENA.regions.goal


def test_a_counted_run_drives_the_starts_in_order_and_an_endless_one_begins_opposite() -> None:
    assert choose_starts(replace(OPTIONS, paths=22), ARENA) == ARENA.starts
    endless = choose_starts(OPTIONS, ARENA)
    assert endless == ARENA.starts[11:] + ARENA.starts[:11]
    assert endless[0].y_m > 4.0


def test_a_start_is_metres_and_degrees() -> None:
    assert parse_start('1,2.5,-90') == Pose2(x_m=1.0, y_m=2.5, heading_rad=-math.pi / 2)


@pytest.mark.parametrize('text', ['', '1,2', '1,2,x', '1,2,nan', '1,2,3,4'])
def test_refuses_other_starts(text: str) -> None:
    with pytest.raises(ConfigurationError, match='--start'):
        parse_start(text)


def test_refuses_a_start_in_a_wall() -> None:
    options = replace(OPTIONS, start_poses=(parse_start('0.1,2,0'),))
    with pytest.raises(ConfigurationError, match='free floor'):
        choose_starts(options, ARENA)


def test_seeds_are_independent_and_repeatable() -> None:
    seeds = RunSeeds.spawn(7)
    assert seeds == OPTIONS.seeds
    assert len({seeds.simulator, seeds.controller, seeds.starts, seeds.training}) == 4
