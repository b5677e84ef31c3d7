"""Runs with nodes that somebody else starts: placed or not, judged or not, lost and back."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from contextlib import contextmanager
import json
import os
from pathlib import Path
import pty
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
import pytest
from std_srvs.srv import Trigger

from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
import graphs

pytestmark = pytest.mark.graph
ROBOT = 'goalreach_sim.nomad200_node'
LOCALIZER = 'goalreach_perception.landmark_localizer_node'
BARE = ('-r', '__node:=bot', '-r', '/ground_truth/odom:=/hidden', '-r', '/clock:=/hidden_clock')
"""A robot without the services of nomad200, without a clock, of which nobody knows the truth."""
START = ('-p', 'start_pose:=[1.0, 3.0, 0.0]')


@contextmanager
def someones(module: str, *words: str, domain: int, home: Path) -> Iterator[subprocess.Popen[str]]:
    """Run a node as its owner does, outside the launcher, and end it."""
    with subprocess.Popen(
        [sys.executable, '-m', module, '--ros-args', *words],
        env=graphs.graph_environment(domain, home),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(20.0)


def run_words(*words: str, node: str = 'nomad200') -> list[str]:
    return ['run', '--external', node, '--policy', 'paper', '--no-dashboard', *words]


def lines_of(run: subprocess.Popen[str], until: str) -> list[str]:
    """Return what a run prints, up to the line with some words."""
    lines: list[str] = []
    for line in run.stdout or ():
        lines.append(line.rstrip())
        if until in line:
            return lines
    raise AssertionError('\n'.join(lines))


def test_a_robot_with_services_and_truth_is_placed_and_judged(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    words = run_words('--paths', '2', '--clock', 'lockstep', '--start', '0.9,3.5,90', '--composed')
    with graphs.goalreach(words, domain=domain, home=tmp_path) as run:
        lines_of(run, f'waiting for nomad200 or a publisher of /odom in ROS_DOMAIN_ID {domain}')
        with someones(ROBOT, '-p', 'clock:=lockstep', domain=domain, home=tmp_path):
            output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert 'nomad200 (external) is there' in output
    assert 'drives from where it stands' not in output
    assert 'nomad200 is up' not in output
    assert '2 of 2 paths reached the goal' in output


def test_a_bare_robot_drives_from_where_it_stands_and_a_person_places_it(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    summary = tmp_path / 'summary.json'
    words = run_words('--paths', '2', '--clock', 'lockstep', '--summary', str(summary))
    lockstep = ('-p', 'clock:=lockstep')
    with (
        graphs.onlooker(domain) as (node, serve_until),
        someones(ROBOT, *BARE, *START, *lockstep, domain=domain, home=tmp_path),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        lines = lines_of(run, 'place the robot for the next path')
        states: list[DiagnosticArray] = []
        graphs.collect(node, DiagnosticArray, '/state', RELIABLE_QOS, states)
        assert serve_until(lambda: len(states) > 100, 90.0)  # no path begins, none ends
        for name in ('bot/reset', 'run_monitor/start'):
            client = node.create_client(Trigger, name)
            assert serve_until(client.service_is_ready, 90.0)
            answer = client.call_async(Trigger.Request())
            assert serve_until(answer.done, 90.0)
            assert answer.result().success
        output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert any('no /nomad200/reset: the robot drives from where it stands' in s for s in lines)
    assert sum('declared' in line and 'path ' in line for line in lines) == 1
    assert '2 of 2 paths declared in the goal, unjudged' in output
    paths = json.loads(summary.read_text())['paths']
    assert [path['outcome'] for path in paths] == ['declared', 'declared']
    assert paths[0]['start'][:2] == pytest.approx([1.0, 3.0], abs=0.05)
    assert all(path['pose_error_m'] == {} for path in paths)
    assert all(1.0 < path['length_m'] < 4.0 and path['duration_s'] < 40.0 for path in paths)


def test_enter_begins_the_next_path(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    ours, theirs = pty.openpty()
    words = run_words('--paths', '2', '--clock', 'lockstep')
    command = [sys.executable, '-m', 'goalreach_bringup.cli', *words]
    near = ('-p', 'start_pose:=[1.8, 0.9, -1.57]', '-p', 'clock:=lockstep')
    with (
        someones(ROBOT, *BARE, *near, domain=domain, home=tmp_path),
        subprocess.Popen(
            command,
            env=graphs.graph_environment(domain, tmp_path),
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as run,
    ):
        try:
            lines_of(run, 'place the robot for the next path')
            os.write(ours, b'\n')  # it still stands in the goal: the next path ends at once
            output, _ = run.communicate(timeout=60)
        finally:
            run.kill()
    os.close(ours)
    os.close(theirs)
    assert run.returncode == 0, output
    assert '2 of 2 paths declared' in output


def test_a_service_of_a_given_name_places_the_robot(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    words = run_words('--paths', '2', '--clock', 'lockstep', '--placement-service', '/bot/reset')
    far = ('-p', 'clock:=lockstep')
    with (
        someones(ROBOT, *BARE, *START, *far, domain=domain, home=tmp_path),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert '/bot/reset places the robot for each path' in output
    starts = [line.split()[3:7] for line in output.splitlines() if line.startswith('path ')]
    assert len(starts) == 2
    assert all(abs(float(x) - 1.0) < 0.1 and abs(float(y) - 3.0) < 0.1 for x, _, y, _ in starts)


@pytest.mark.parametrize('bare', [False, True], ids=['placed', 'bare'])
def test_a_robot_killed_and_started_again_in_the_middle(tmp_path: Path, *, bare: bool) -> None:
    domain = graphs.fresh_domain()
    # From the far corner: a path in lockstep must outlast what discovery takes at times.
    words = run_words('--paths', '1', '--clock', 'lockstep', '--start', '0.4,4.7,90')
    far = ('-p', 'start_pose:=[0.4, 4.7, 1.57]', '-p', 'clock:=lockstep')
    robot = (*(BARE if bare else ()), *far)
    odometry: list[Odometry] = []
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        graphs.collect(node, Odometry, '/odom', RELIABLE_QOS, odometry)
        with someones(ROBOT, *robot, domain=domain, home=tmp_path) as first:
            assert serve_until(
                lambda: bool(odometry) and odometry[-1].twist.twist.linear.x > 0.1, 90.0
            )
            first.kill()
        lines_of(run, 'nomad200 (external): nothing on /odom for 2 s: the robot waits for it')
        with someones(ROBOT, *robot, domain=domain, home=tmp_path):
            output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert 'nomad200 (external) is back' in output
    assert 'the clock of the robot has restarted: restarting the nodes' in output
    assert f'1 of 1 paths {"declared in" if bare else "reached"} the goal' in output
    assert 'error' not in output.replace('error p95', '')


def test_a_robot_without_watchdog_is_stopped_when_the_localizer_goes(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    words = run_words('--paths', '1', '--external', 'landmark_localizer')
    commands: list[TwistStamped] = []
    robot = ('-p', 'watchdog_s:=60.0', *BARE, *START)
    with (
        graphs.onlooker(domain) as (node, serve_until),
        someones(ROBOT, *robot, domain=domain, home=tmp_path),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        graphs.collect(node, TwistStamped, '/cmd_vel', RELIABLE_QOS, commands)
        with someones(LOCALIZER, domain=domain, home=tmp_path) as localizer:
            assert serve_until(lambda: bool(commands) and commands[-1].twist.linear.x > 0.1, 90.0)
            localizer.kill()
        assert serve_until(lambda: commands[-1].twist == type(commands[-1].twist)(), 90.0)
        lines_of(run, 'landmark_localizer (external): nothing on /pose for 2 s')
        with someones(LOCALIZER, domain=domain, home=tmp_path):
            output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert '1 of 1 paths declared in the goal' in output


def test_the_last_command_of_a_run_is_to_stand(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    commands: list[TwistStamped] = []
    with (
        graphs.onlooker(domain) as (node, serve_until),
        someones(ROBOT, *BARE, *START, domain=domain, home=tmp_path),
        graphs.goalreach(run_words(), domain=domain, home=tmp_path) as run,
    ):
        graphs.collect(node, TwistStamped, '/cmd_vel', RELIABLE_QOS, commands)
        assert serve_until(lambda: bool(commands) and commands[-1].twist.linear.x > 0.1, 90.0)
        run.terminate()
        assert serve_until(lambda: run.poll() is not None, 90.0)
        serve_until(lambda: False, 0.2)
    assert commands[-1].twist == type(commands[-1].twist)()


def test_without_driving_the_robot_stands_and_the_commands_are_shown(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    odometry: list[Odometry] = []
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(
            ['run', '--no-drive', '--policy', 'paper', '--start', '1.0,3.0,0', '--no-dashboard'],
            domain=domain,
            home=tmp_path,
        ) as run,
    ):
        graphs.collect(node, Odometry, '/odom', RELIABLE_QOS, odometry)
        lines = lines_of(run, 'not sent: 0.00 m/s, -')
        assert not node.count_publishers('/cmd_vel')
        assert serve_until(lambda: len(odometry) > 10, 90.0)
    assert any('not sent:' in line for line in lines)
    assert all(message.twist.twist.linear.x == 0.0 for message in odometry)


def test_a_node_that_only_drives_takes_the_wheels_and_ours_keeps_the_paths(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    example = Path(__file__).parents[4] / 'examples' / 'own_controller.py'
    words = ['--paths', '1', '--clock', 'lockstep', '--start', '0.9,3.5,90']
    words = run_words(*words, node='goal_reaching_controller')
    environment = graphs.graph_environment(domain, tmp_path)
    with (
        subprocess.Popen([sys.executable, str(example)], env=environment) as driver,
        contextlib.ExitStack() as stack,
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        stack.callback(driver.terminate)
        output, _ = run.communicate(timeout=100)
    assert run.returncode == 0, output
    assert 'another node drives; our goal_reaching_controller keeps the paths' in output
    assert '1 of 1 paths reached the goal' in output


@pytest.mark.parametrize(
    ('words', 'reason'),
    [
        (['--external', 'robot'], "--external = 'robot': must be one of nomad200, "),
        (['--placement-service', '/x'], "--placement-service = '/x': must be given with --ext"),
        (['--no-drive', '--clock', 'lockstep'], "--no-drive = 'lockstep': must be in real time"),
    ],
)
def test_what_does_not_fit_gets_one_line(tmp_path: Path, words: list[str], reason: str) -> None:
    domain = graphs.fresh_domain()
    with graphs.goalreach(['run', *words], domain=domain, home=tmp_path) as run:
        output, _ = run.communicate(timeout=30)
    assert run.returncode == 2
    assert output.startswith(f'goalreach run: {reason}'), output
    assert len(output.splitlines()) == 1


@pytest.mark.parametrize(
    ('words', 'parameters', 'reason'),
    [
        (
            '--no-drive --policy paper',
            'nomad200: {ros__parameters: {clock: lockstep}}',
            "--no-drive = 'clock: lockstep'",
        ),
        (
            '--learn --policy {home}/new.json',
            'goal_reaching_controller: {ros__parameters: {learning.trials: many}}',
            "trials = 'many': must be a whole number",
        ),
    ],
)
def test_parameters_that_do_not_fit_get_one_line_and_leave_no_policy(
    tmp_path: Path, words: str, parameters: str, reason: str
) -> None:
    path = tmp_path / 'params.yaml'
    path.write_text(parameters)
    given = ['run', *words.format(home=tmp_path).split(), '--params-file', str(path)]
    with graphs.goalreach(given, domain=graphs.fresh_domain(), home=tmp_path) as run:
        output, _ = run.communicate(timeout=60)
    assert run.returncode == 2, output
    assert f'goalreach run: {reason}' in output
    assert not (tmp_path / 'new.json').exists()
