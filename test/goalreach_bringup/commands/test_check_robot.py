"""The command against real robots over DDS."""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys

import pytest

import graphs
from ros_robot import node_process

pytestmark = pytest.mark.graph


def check(domain: int, home: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'check-robot', *words],
        env=graphs.graph_environment(domain, home),
        text=True,
        capture_output=True,
        check=False,
        timeout=120,
    )


def test_a_robot_that_can_drive_is_told_so_and_moved(tmp_path: Path) -> None:
    domain, path = graphs.fresh_domain(), tmp_path / 'verdicts.json'
    placed = {'start_pose': '[1.778, 2.5, -1.5708]'}
    robot = node_process('nomad200', placed, domain=domain, home=tmp_path)
    with robot, graphs.onlooker(domain) as (node, serve):
        assert serve(lambda: node.count_publishers('/odom') > 0, 90.0)
        found = check(domain, tmp_path, '--move', '--json', str(path))
    assert found.returncode == 0, found.stdout + found.stderr
    told = json.loads(path.read_text())
    assert told['can_drive'] is True
    lines = found.stdout.splitlines()
    assert len(lines) == len(told['verdicts'])
    assert any(line.startswith('ok     /camera/image_raw') and 'mono8' in line for line in lines)
    subjects = [v['subject'] for v in told['verdicts'] if 'reported' in v['text']]
    joints = ['turret_joint', 'pan_joint', 'tilt_joint']
    assert subjects == [*joints, 'linear.x', 'angular.z']
    assert any('seen' in v['text'] for v in told['verdicts'])


def test_where_there_is_no_robot_each_input_is_missed(tmp_path: Path) -> None:
    found = check(graphs.fresh_domain(), tmp_path, '--duration', '1')
    assert found.returncode == 1
    wrong = [line.split()[1] for line in found.stdout.splitlines() if line.startswith('wrong')]
    assert wrong == [
        '/camera/image_raw', '/camera/camera_info', '/odom', '/joint_states', '/bumpers',
        '/cmd_vel', '/head/command',
    ]  # fmt: skip
    assert found.stderr == ''


def test_the_parameter_file_of_the_run_tells_what_is_expected(tmp_path: Path) -> None:
    path = tmp_path / 'robot.yaml'
    path.write_text(
        'landmark_localizer:\n  ros__parameters:\n    head: none\n'
        'goal_reaching_controller:\n  ros__parameters:\n    bumpers: optional\n'
    )
    domain = graphs.fresh_domain()
    found = check(domain, tmp_path, '--duration', '1', '--params-file', str(path))
    assert '/joint_states' not in found.stdout
    assert '/head/command' not in found.stdout
    assert 'note   /bumpers' in found.stdout


def test_a_bad_parameter_gets_one_line(tmp_path: Path) -> None:
    path = tmp_path / 'robot.yaml'
    path.write_text('landmark_localizer:\n  ros__parameters:\n    head: two\n')
    found = check(graphs.fresh_domain(), tmp_path, '--params-file', str(path))
    assert found.returncode == 2
    (line,) = found.stderr.splitlines()
    assert line.startswith("goalreach check-robot: head = 'two'")
