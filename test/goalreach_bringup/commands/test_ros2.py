from __future__ import annotations

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bringup.command import Command
from goalreach_bringup.commands import ros2

REAL = f"""\
#!{sys.executable} -S
import json, os, sys
print(json.dumps([sys.argv[1:], os.environ.get('_ROS_WHEELS_BOOTSTRAP_COMPLETE'),
                  os.environ.get('LD_LIBRARY_PATH')]))
sys.exit(3)
"""


def parsed(*arguments: str) -> ros2.Options:
    _, options = Command.of_module(ros2).parse('goalreach ros2', arguments)
    assert isinstance(options, ros2.Options)
    return options


def test_all_arguments_are_for_ros2() -> None:
    assert parsed('topic', 'echo', '--once', '/a').arguments == ('topic', 'echo', '--once', '/a')
    assert parsed('topic', '--help').arguments == ('topic', '--help')


def test_the_real_ros2_is_started_in_its_own_environment(tmp_path: Path) -> None:
    real = tmp_path / 'ros2'
    real.write_text(REAL, encoding='utf-8')
    real.chmod(0o755)
    wheels = os.path.join(sys.prefix, 'lib')  # noqa: PTH118 - as it is in the variable
    environment = {k: v for k, v in os.environ.items() if k != 'GOALREACH_ROS2_HANDED_OVER'} | {
        'PATH': f'{tmp_path}{os.pathsep}{os.environ["PATH"]}',
        'LD_LIBRARY_PATH': os.pathsep.join([wheels, '/opt/ros/jazzy/lib']),
        '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',
    }
    done = subprocess.run(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'ros2', 'bag', 'info', '--help'],
        env=environment,
        capture_output=True,
        check=False,
        text=True,
        timeout=60,
    )
    assert done.returncode == 3
    assert json.loads(done.stdout) == [['bag', 'info', '--help'], None, '/opt/ros/jazzy/lib']


def test_without_a_real_ros2_its_part_here_is_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    assert ros2.execute(parsed()) == 0
    assert capsys.readouterr().out.startswith('usage: ros2 ')


def test_a_wrapper_that_comes_back_is_not_started_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrapper = tmp_path / 'ros2'
    wrapper.write_text('#!/bin/sh\nexit 9\n', encoding='utf-8')
    wrapper.chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('GOALREACH_ROS2_HANDED_OVER', '1')
    assert ros2.execute(parsed()) == 0
    assert capsys.readouterr().out.startswith('usage: ros2 ')
