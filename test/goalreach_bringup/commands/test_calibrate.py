"""The command against real robots over DDS."""

from __future__ import annotations

from pathlib import Path
import signal
import subprocess
import sys

from geometry_msgs.msg import TwistStamped
import pytest
from rclpy.qos import QoSProfile

from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.plan import standalone_parameters
import graphs
from ros_robot import node_process

pytestmark = pytest.mark.graph

TOLD = """landmark_localizer:
  ros__parameters:
    camera_mount: [-0.03, 0.02, 1.12, 0.01, 0.02, -0.03]
    camera_delay_s: -0.06
    odometry.scale: 1.03
goal_reaching_controller:
  ros__parameters:
    body_radius_m: 0.23
"""
START = {'start_pose': '[1.2, 3.2, -1.5708]'}


def calibrating(domain: int, home: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'calibrate', *words],
        cwd=home,
        env=graphs.graph_environment(domain, home),
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_a_robot_told_wrong_is_corrected_by_a_file_that_run_takes(tmp_path: Path) -> None:
    domain, told, out = graphs.fresh_domain(), tmp_path / 'told.yaml', tmp_path / 'found.yaml'
    told.write_text(TOLD)
    robot = node_process('nomad200', START, domain=domain, home=tmp_path)
    with robot, graphs.onlooker(domain) as (node, serve):
        assert serve(lambda: node.count_publishers('/odom') > 0, 90.0)
        command = calibrating(domain, tmp_path, '--params-file', str(told), '--out', str(out))
        printed, errors = command.communicate(timeout=400)
    assert command.returncode == 0, printed + errors
    assert 'it fits' in printed
    options = RunOptions(params_file=out, policy='paper')
    nodes = standalone_parameters(options)
    found = nodes['landmark_localizer']
    mount = found['camera_mount']
    assert mount[:3] == pytest.approx([0.0, 0.0, 1.1], abs=0.025)
    assert mount[3:] == pytest.approx([0.0, 0.0, 0.0], abs=0.01)
    assert found['camera_delay_s'] == pytest.approx(0.0, abs=0.002)
    assert found['odometry.scale'] == pytest.approx(1.0, abs=0.04)
    assert nodes['goal_reaching_controller']['body_radius_m'] == 0.23
    lines = printed.splitlines()
    assert [line for line in out.read_text().splitlines() if line.startswith('#')] == [
        f'# {line}' for line in lines[:-1]
    ]


def test_without_a_robot_each_input_is_missed(tmp_path: Path) -> None:
    command = calibrating(graphs.fresh_domain(), tmp_path)
    printed, errors = command.communicate(timeout=60)
    assert command.returncode == 1, errors
    assert [line.split()[:2] for line in printed.splitlines()][:2] == [
        ['wrong', '/camera/image_raw'],
        ['wrong', '/camera/camera_info'],
    ]
    assert list(tmp_path.glob('*.yaml')) == []


def test_a_file_that_is_there_is_kept(tmp_path: Path) -> None:
    (tmp_path / 'calibrated.yaml').write_text('mine')
    command = calibrating(graphs.fresh_domain(), tmp_path)
    _, errors = command.communicate(timeout=60)
    assert command.returncode == 2
    assert errors == 'goalreach calibrate: calibrated.yaml: exists already\n'
    assert (tmp_path / 'calibrated.yaml').read_text() == 'mine'


def test_the_robot_stands_after_ctrl_c(tmp_path: Path) -> None:
    domain, commands = graphs.fresh_domain(), list[TwistStamped]()
    robot = node_process('nomad200', START, domain=domain, home=tmp_path)
    with robot, graphs.onlooker(domain) as (node, serve):
        graphs.collect(node, TwistStamped, '/cmd_vel', QoSProfile(depth=100), commands)
        assert serve(lambda: node.count_publishers('/odom') > 0, 90.0)
        command = calibrating(domain, tmp_path)
        drove = serve(lambda: any(one.twist.linear.x > 0.1 for one in commands), 120.0)
        command.send_signal(signal.SIGINT)
        assert serve(lambda: command.poll() is not None, 90.0)
    _, errors = command.communicate()
    assert drove
    assert command.returncode == 130, errors
    assert errors == ''
    assert commands[-1].twist.linear.x == commands[-1].twist.angular.z == 0.0
    assert list(tmp_path.glob('*.yaml')) == []
