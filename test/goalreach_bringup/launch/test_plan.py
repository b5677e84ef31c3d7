"""From options to the parameters of every node."""

from dataclasses import replace
import math
from pathlib import Path
from typing import Any

import pytest

from goalreach_bringup.launch.learning_run import LearningRun
from goalreach_bringup.launch.options import RunOptions, parse_start
from goalreach_bringup.launch.plan import (
    ExternalNodes,
    choose_starts,
    plan_parameters,
    standalone_parameters,
)
from goalreach_evaluation.starts import RunSeeds
from goalreach_learning.controller_config import MissionConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameter_file import NodeParameters, read_parameters, write_parameters
from goalreach_msgs_py.parameters import build_config
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
    changes: dict[str, Any], consumers: str
) -> None:
    before = planned({ROBOT: {'consumers': 'mine'}}, **changes)
    used = ExternalNodes().parameters(before, replace(OPTIONS, **changes))
    assert (before[ROBOT]['consumers'], used[ROBOT]['consumers']) == ('mine', consumers)


def test_the_parameters_of_one_run_can_be_given_to_another(tmp_path: Path) -> None:
    path, other = tmp_path / 'parameters.yaml', tmp_path / 'other.yaml'
    user: NodeParameters = {ROBOT: {'consumers': 'mine'}, LOCALIZER: {'camera_height_m': 0.8}}
    poses = (parse_start('1.0,3.0,0'), parse_start('2.0,3.0,90'))
    write_parameters(path, planned(user, paths=3, start_poses=poses, record=tmp_path))
    again = planned(read_parameters(path), seed=9, paths=5, clock='lockstep')
    write_parameters(path, again)
    write_parameters(other, planned(user, seed=9, paths=5, clock='lockstep'))
    assert path.read_text() == other.read_text()
    used = ExternalNodes().parameters(again, replace(OPTIONS, seed=9, paths=5))
    assert used[ROBOT]['consumers'] == 'mine,run_monitor'
    assert used[CONTROLLER]['consumer'] == 'run_monitor'


def test_the_seed_of_the_options_is_that_of_the_robot_and_of_the_controller() -> None:
    for seed in (0, 9):
        parameters = planned({ROBOT: {'seed': 1}, CONTROLLER: {'seed': 1}}, seed=seed)
        seeds = RunSeeds.spawn(seed)
        assert parameters[ROBOT]['seed'] == seeds.simulator
        assert parameters[CONTROLLER]['seed'] == seeds.controller


def test_learning_continues_with_the_parameters_of_its_first_run(tmp_path: Path) -> None:
    path, policy = tmp_path / 'parameters.yaml', Policy.unlearned(ARENA.regions)
    options = RunOptions(learn=True, policy='new.json')
    user: NodeParameters = {}
    for driven in (0, 7):
        parameters = plan_parameters(
            options, arena=ARENA, starts=ARENA.starts, policy_path='new.json', user=user,
            learning=LearningRun(policy=policy, first_path=driven, trials=3, learner='sarsa'),
        )  # fmt: skip
        assert parameters[CONTROLLER]['first_path'] == driven
        write_parameters(path, parameters)
        user = read_parameters(path)


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


def test_a_start_on_the_free_floor_is_where_paths_begin() -> None:
    poses = (parse_start('1.0,3.0,0'), parse_start('2.0,3.0,90'))
    assert choose_starts(replace(OPTIONS, start_poses=poses), ARENA) == poses
    assert planned(start_poses=poses)[CONTROLLER]['starts'] == (1, 3, 0, 2, 3, math.pi / 2)


def test_a_run_that_learns_drives_the_starts_in_order() -> None:
    options = RunOptions(learn=True, policy='new.json')
    assert choose_starts(options, ARENA) == ARENA.starts


@pytest.mark.parametrize('paths', [0, 10])
def test_a_trial_from_random_starts_has_as_many_as_the_arena(paths: int) -> None:
    options = RunOptions(learn=True, policy='new.json', starts='random', paths=paths)
    assert len(choose_starts(options, ARENA)) == len(ARENA.starts)
    assert choose_starts(options, ARENA) == choose_starts(replace(options, paths=3), ARENA)


def test_parameters_that_every_node_has_are_accepted() -> None:
    user = {'use_sim_time': True, 'qos_overrides./odom.publisher.depth': 5}
    assert planned({ROBOT: user})[ROBOT].items() >= user.items()


@pytest.mark.parametrize(
    ('behaviors', 'wanted', 'sonar'),
    [
        (None, False, False),
        (None, True, True),
        ('goal', False, False),
        ('first(escape, goal)', False, True),
        ('avoid', False, True),
    ],
)
def test_behaviors_other_than_the_goal_need_the_sonar(
    behaviors: str | None, wanted: object, sonar: object
) -> None:
    assert planned({ROBOT: {'sonar': wanted}}, behaviors=behaviors)[ROBOT]['sonar'] is sonar


@pytest.mark.parametrize(('requested', 'paths'), [(0, 66), (3, 10), (100, 66)])
def test_learning_goes_on_in_its_file(requested: int, paths: int) -> None:
    options = RunOptions(learn=True, policy='new.json', paths=requested)
    policy = Policy.unlearned(ARENA.regions)
    learning = LearningRun(policy=policy, first_path=7, trials=3, learner='sarsa')
    parameters = plan_parameters(
        options, arena=ARENA, starts=ARENA.starts, policy_path='new.json', user={},
        learning=learning,
    )[CONTROLLER]  # fmt: skip
    expected = {
        'policy': 'new.json', 'policy_out': 'new.json', 'first_path': 7, 'paths': paths,
        'learn': True, 'learner': 'sarsa',
    }  # fmt: skip
    assert parameters.items() >= expected.items()


def test_a_run_that_does_not_learn_begins_with_the_first_path_and_writes_no_policy() -> None:
    parameters = planned(paths=5)[CONTROLLER]
    expected = {'policy_out': '', 'first_path': 0, 'paths': 5, 'learn': False}
    assert parameters.items() >= expected.items()
    assert planned({CONTROLLER: {'learn': True}})[CONTROLLER]['learn'] is True


def test_nodes_of_a_launch_file_wait_for_whom_the_file_names(tmp_path: Path) -> None:
    path = tmp_path / 'params.yaml'
    path.write_text(
        'nomad200: {ros__parameters: {consumers: a}}\n'
        'goal_reaching_controller: {ros__parameters: {consumer: b}}\n'
    )
    parameters = standalone_parameters(RunOptions(params_file=path, clock='lockstep'))
    assert parameters[ROBOT]['consumers'] == 'a'
    assert parameters[CONTROLLER]['consumer'] == 'b'


@pytest.mark.parametrize(
    ('external', 'started'),
    [
        (ExternalNodes(), NODES),
        (ExternalNodes(names=(ROBOT, LOCALIZER)), (ESTIMATOR, CONTROLLER)),
        (ExternalNodes(names=(CONTROLLER,)), (ROBOT, LOCALIZER, ESTIMATOR)),
        (ExternalNodes(names=(CONTROLLER,), only_drives=True), NODES),
        (ExternalNodes(names=(ROBOT, CONTROLLER), only_drives=True), NODES[1:]),
    ],
)
def test_what_others_replace_is_not_started(
    external: ExternalNodes, started: tuple[str, ...]
) -> None:
    assert external.started == started


@pytest.mark.parametrize(
    ('external', 'service', 'clock', 'changes'),
    [
        (ExternalNodes(), '', 'realtime', {}),
        (ExternalNodes(names=(LOCALIZER,)), '', 'realtime', {}),
        (ExternalNodes(names=(ROBOT,)), '', 'lockstep', {}),
        (ExternalNodes(names=(ROBOT,)), '', 'realtime', {'stop_after_s': 0.5}),
        (
            ExternalNodes(names=(ROBOT,), has_reset=False), '', 'lockstep',
            {'starts': (), 'placement_service': ''},
        ),
        (
            ExternalNodes(names=(ROBOT,)), '/put', 'lockstep',
            {'starts': (), 'placement_service': '/put'},
        ),
    ],
)  # fmt: skip
def test_the_controller_is_told_who_places_and_who_stops_the_robot(
    external: ExternalNodes, service: str, clock: str, changes: dict[str, Any]
) -> None:
    before = planned(clock=clock)
    options = RunOptions(external=(ROBOT,), placement_service=service)
    after = external.parameters(before, options)
    changes = {'consumer': 'run_monitor', **changes}
    assert after[CONTROLLER] == {**before[CONTROLLER], **changes}
    assert external.is_placed(service) == ('starts' not in changes)


@pytest.mark.parametrize(
    ('external', 'service'),
    [(ExternalNodes(names=(ROBOT,), has_reset=False), ''), (ExternalNodes(), '/put')],
)
def test_a_robot_that_is_not_placed_learns_in_the_trials_announced(
    external: ExternalNodes, service: str
) -> None:
    options = RunOptions(external=(ROBOT,), placement_service=service)
    planned_for = external.parameters(planned(), options)
    mission = build_config(MissionConfig, planned_for[CONTROLLER])
    orders = [mission.path_order(path) for path in range(440)]
    trials = [order.trial for order in orders if order]
    assert trials == [trial for trial in range(20) for _ in ARENA.starts]


def test_a_time_until_the_robot_is_stopped_is_kept() -> None:
    before = planned({CONTROLLER: {'stop_after_s': 2.0}})
    external = ExternalNodes(names=(ROBOT,))
    after = external.parameters(before, OPTIONS)
    assert after[CONTROLLER]['stop_after_s'] == 2.0


@pytest.mark.parametrize(
    ('only_drives', 'drive', 'clock', 'consumers'),
    [
        (False, True, 'lockstep', 'mine,run_monitor'),
        (False, False, 'realtime', 'mine'),
        (True, True, 'realtime', 'mine'),
        (True, True, 'lockstep', 'mine,run_monitor,goal_reaching_controller'),
    ],
)
def test_commands_of_ours_that_are_not_for_the_robot_have_another_topic(
    only_drives: bool,  # noqa: FBT001
    drive: bool,  # noqa: FBT001
    clock: str,
    consumers: str,
) -> None:
    external = ExternalNodes(names=(CONTROLLER,) * only_drives, only_drives=only_drives)
    before = planned({ROBOT: {'consumers': 'mine'}}, clock=clock)
    after = external.parameters(before, replace(OPTIONS, no_drive=not drive))
    assert after[ROBOT] == {**before[ROBOT], 'consumers': consumers}
    assert after[CONTROLLER]['stamped_cmd_vel'] is (
        before[CONTROLLER]['stamped_cmd_vel'] or not drive
    )
    rules = () if drive and not only_drives else (f'{CONTROLLER}:cmd_vel:=cmd_vel_not_sent',)
    assert external.remaps(drive=drive) == rules


@pytest.mark.parametrize(
    ('external', 'service', 'lines'),
    [
        (ExternalNodes(), '', []),
        (ExternalNodes(names=(ROBOT,)), '', ['nomad200 (external) is there']),
        (ExternalNodes(only_drives=True), '', ['another node drives']),
        (ExternalNodes(has_reset=False), '/put', ['/put places the robot']),
        (ExternalNodes(has_reset=False), '', ['no /nomad200/reset: the robot drives from']),
        (ExternalNodes(has_truth=False), '', ['no /ground_truth/odom: paths that end']),
    ],
)
def test_what_differs_from_a_run_of_ours_is_told(
    external: ExternalNodes, service: str, lines: list[str]
) -> None:
    told = external.lines(service)
    assert len(told) == len(lines)
    assert all(line.startswith(begin) for line, begin in zip(told, lines, strict=True))
