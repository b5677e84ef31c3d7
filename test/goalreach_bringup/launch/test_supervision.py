"""A node that dies is started again, and the run goes on."""

import itertools
import os
from pathlib import Path
import signal
import subprocess

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.qos import QoSProfile

from goalreach_bringup.launch.path_evaluator import Progress
from goalreach_bringup.launch.plan import resume_parameters
from goalreach_bringup.launch.ros import supervisor
from goalreach_lab.rigs.processes import find_descendant
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.topics import NODES
from goalreach_msgs_py.values import Pose2
import graphs


def process_of(launcher: subprocess.Popen[str], node: str) -> int:
    """Return the process id of a node that this launcher started."""
    pid = find_descendant(launcher.pid, node)
    assert pid is not None, f'{node} is not running'
    return pid


@pytest.mark.graph
@pytest.mark.parametrize('node', NODES)
def test_the_run_goes_on_after_a_node_was_killed(tmp_path: Path, node: str) -> None:
    domain = graphs.fresh_domain()
    paths = 5  # a run that lasts: the test may meet its graph late
    arguments = ['run', '--paths', str(paths), '--clock', 'lockstep']
    truth: list[Odometry] = []
    with graphs.onlooker(domain) as (watcher, serve_until):
        graphs.collect(watcher, Odometry, '/ground_truth/odom', QoSProfile(depth=1000), truth)
        with graphs.goalreach(arguments, domain=domain, home=tmp_path) as run:
            assert serve_until(lambda: len(truth) > 40, 90.0), run.communicate()[0]
            victim = process_of(run, node)
            os.kill(victim, signal.SIGKILL)
            assert serve_until(lambda: run.poll() is not None, 90.0)
            output, _ = run.communicate()
    assert run.returncode == 0, output
    assert f'{node}: error: was ended by SIGKILL; restarting it' in output
    assert f'{paths} of {paths} paths reached the goal' in output
    stamps = [stamp_from_msg(message.header.stamp) for message in truth]
    assert stamps == sorted(stamps)
    poses = [message.pose.pose.position for message in truth]
    steps = [abs(b.x - a.x) + abs(b.y - a.y) for a, b in itertools.pairwise(poses)]
    assert sum(step > 0.05 for step in steps[2:]) < paths  # none but from path to path


@pytest.mark.graph
def test_a_node_that_keeps_dying_ends_the_run(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    commands: list[TwistStamped] = []
    with graphs.onlooker(domain) as (watcher, serve_until):
        graphs.collect(watcher, TwistStamped, '/cmd_vel', RELIABLE_QOS, commands)
        with graphs.goalreach(['run'], domain=domain, home=tmp_path) as run:
            assert serve_until(lambda: bool(commands), 90.0), run.communicate()[0]
            while run.poll() is None:
                victim = find_descendant(run.pid, 'state_estimator')
                if victim is not None:
                    os.kill(victim, signal.SIGKILL)
                serve_until(lambda: False, 0.1)
            output, _ = run.communicate()
    assert run.returncode == 1, output
    assert 'state_estimator: error: was ended by SIGKILL; it keeps dying' in output
    assert 'Traceback' not in output


def test_a_restarted_robot_stands_where_it_was_and_its_clock_goes_on() -> None:
    truth = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)
    progress = Progress(path=7, placed=True, last_ns=123, truth=truth)
    assert resume_parameters(progress, lockstep=False) == {
        'goal_reaching_controller': {'first_path': 7, 'resume': True},
        'nomad200': {'start_pose': (1.0, 2.0, 0.5), 'start_time_ns': 123},
    }


def test_in_lockstep_its_clock_goes_on_past_what_the_launcher_has_not_heard() -> None:
    progress = Progress(
        path=0, placed=True, last_ns=10_000_000_123, truth=Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
    )
    resumed = resume_parameters(progress, lockstep=True)
    assert resumed['nomad200']['start_time_ns'] == 16_000_000_123


def test_before_the_first_tick_everything_starts_as_planned() -> None:
    progress = Progress(path=0, placed=False, last_ns=0, truth=None)
    assert resume_parameters(progress, lockstep=True) == {
        'goal_reaching_controller': {'first_path': 0, 'resume': False}
    }


class _Answering:
    """The parameters of a node that answers every request at once."""

    def services_are_ready(self) -> bool:
        return True

    def get_parameters(self, _: list[str]) -> 'rclpy.Future[object]':
        future: rclpy.Future[object] = rclpy.Future()
        future.set_result(None)
        return future


class _Silent(_Answering):
    """Those of one that never answers."""

    def get_parameters(self, _: list[str]) -> 'rclpy.Future[object]':
        return rclpy.Future()


def test_silence_is_noticed_twenty_seconds_after_a_start_and_four_after_an_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client = _Silent()
    monkeypatch.setattr(supervisor, 'AsyncParameterClient', lambda *_: client)
    probe = supervisor.LivenessProbe(None, 'nomad200', 0.0)
    assert [probe.silent(0.5 * tick) for tick in range(42)] == [False] * 41 + [True]
    probe.restart(100.0)
    assert not any(probe.silent(time_s) for time_s in (100.0, 100.5))
    probe._pending[0].set_result(None)
    assert not any(probe.silent(101.0 + 0.5 * tick) for tick in range(9))
    assert probe.silent(105.5)


def test_no_node_is_blamed_for_the_time_in_which_nobody_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervisor, 'AsyncParameterClient', lambda *_: _Answering())
    probe = supervisor.LivenessProbe(None, 'nomad200', 0.0)
    assert not any(probe.silent(0.05 * tick) for tick in range(100))
    assert not probe.silent(60.0)  # Ctrl-Z, then fg
    assert not any(probe.silent(60.0 + 0.05 * tick) for tick in range(100))
