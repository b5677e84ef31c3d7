"""The public interface: doctests, equality with the commands, and what importing it loads."""

from __future__ import annotations

import doctest
import json
import math
from pathlib import Path
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

import goalreach
from goalreach import api
from goalreach_bringup.cli import main


def run_python(code: str) -> str:
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, timeout=60, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize('module', [goalreach, api])
def test_doctests(module: ModuleType) -> None:
    if module is goalreach:
        pytest.importorskip('gymnasium')
    found = doctest.testmod(module)
    assert found.attempted > 0
    assert found.failed == 0


def test_importing_loads_neither_ros_nor_matplotlib() -> None:
    code = 'import goalreach, sys; print(*{m.partition(".")[0] for m in sys.modules})'
    assert {'rclpy', 'sensor_msgs', 'matplotlib', 'rich'}.isdisjoint(run_python(code).split())


def test_importing_works_without_gymnasium() -> None:
    code = 'import sys; sys.modules["gymnasium"] = None; import goalreach; print(goalreach.train)'
    assert 'function train' in run_python(code)


def test_every_exported_name_is_there() -> None:
    assert all(hasattr(goalreach, name) for name in goalreach.__all__)


def test_train_is_the_command_train(tmp_path: Path) -> None:
    main(['train', '--seed', '7', '--out', str(tmp_path / 'p.json'), '--quiet'])
    goalreach.write_policy(tmp_path / 'mine.json', goalreach.train(seed=7))
    assert (tmp_path / 'mine.json').read_bytes() == (tmp_path / 'p.json').read_bytes()


def test_evaluate_is_the_command_evaluate(tmp_path: Path) -> None:
    path = tmp_path / 'policy.json'
    goalreach.write_policy(path, goalreach.train(seed=1))
    options = ['--policy', str(path), '--starts', 'random:2', '--seed', '4', '--quiet']
    main(['evaluate', *options, '--json', str(tmp_path / 'summary.json')])
    summary = json.loads((tmp_path / 'summary.json').read_text())
    result = goalreach.evaluate(path, starts='random:2', seed=4)
    clock = {'wall_time_s': 0.0, 'real_time_factor': 0.0}
    assert {**json.loads(json.dumps(result.to_json())), **clock} == {**summary, **clock}
    assert result.success_rate == summary['success_rate'] == 1.0


def test_simulate_drives_the_path_of_evaluate() -> None:
    policy = goalreach.train(seed=7)
    start = goalreach.Pose2(x_m=1.2, y_m=2.5, heading_rad=math.pi / 2)
    (path,) = goalreach.evaluate(policy, starts=[start], seed=5).paths
    count, last = 0, None
    for last in goalreach.simulate(policy, start=(1.2, 2.5, 90.0), seed=5):
        assert (last.result is None) or last.result == path
        count += 1
    assert last is not None
    assert last.result == path
    assert count == round(path.duration_s * 25) + 1
    assert last.covariance.shape == (3, 3)
    assert (
        math.dist((last.pose.x_m, last.pose.y_m), (last.true_pose.x_m, last.true_pose.y_m)) < 0.1
    )


def test_objects_are_named_in_the_summary() -> None:
    arena, noise = goalreach.Arena(name='mine'), goalreach.NoiseModel()
    policy = goalreach.train(arena=arena, config=goalreach.LearningConfig(trials=5))
    result = goalreach.evaluate(policy, arena=arena, noise=noise, starts=[(1.2, 2.5, 90.0)])
    summary = result.to_json()
    assert summary['policy'] == 'in memory'
    assert summary['config']['arena'] == 'mine'
    assert summary['config']['noise'] == summary['config']['starts'] == 'in memory'


def test_figures_come_in_the_papers_order(tmp_path: Path) -> None:
    policy = goalreach.train()
    files = goalreach.figures(policy, out=tmp_path / 'new', formats='svg')
    assert [file.name[:8] for file in files] == [f'figure_{k}' for k in range(1, 7)]
    assert all(file.stat().st_size > 1000 for file in files)


@pytest.mark.parametrize(
    ('call', 'line'),
    [
        (lambda: goalreach.train(seed=-1), 'seed = -1: must be a whole number >= 0'),
        (lambda: goalreach.evaluate(seed=-1), 'seed = -1: must be a whole number >= 0'),
        (lambda: goalreach.evaluate(jobs=0), 'jobs = 0: must be a whole number >= 1'),
        (lambda: goalreach.evaluate(mode='quick'), "mode = 'quick': must be"),
        (lambda: goalreach.evaluate(starts='here'), "starts = 'here': must be paper, random:N"),
        (lambda: goalreach.evaluate(starts=[]), 'starts = .*: must be at least one pose'),
        (lambda: goalreach.evaluate(starts=[(9.0, 1.0, 0.0)]), r'starts\[0\] = .*free floor'),
        (lambda: goalreach.evaluate(noise='loud'), 'loud: is no preset'),
        (lambda: goalreach.simulate(start=(1.0, 2.0)), 'start = .*: must be x and y in metres'),
        (lambda: goalreach.simulate(start=(1.0, np.nan, 0.0)), r'starts\[0\] = .*free floor'),
        (lambda: goalreach.simulate(arena='moon'), 'moon: is no file and none of'),
        (
            lambda: goalreach.simulate(goalreach.train(), arena='narrow'),
            r'policy: regions.x_knots_m = .*the arena narrow has',
        ),
        (
            lambda: goalreach.figures(goalreach.train(arena='large')),
            r'policy: regions.x_knots_m = ',
        ),
        (
            lambda: goalreach.figures(goalreach.train(), formats=['gif']),
            "formats = .*: must be 'svg', 'png' or both",
        ),
    ],
)
def test_a_bad_value_is_refused_in_one_line(call: object, line: str) -> None:
    assert callable(call)
    with pytest.raises(goalreach.GoalreachError, match=line) as caught:
        call()
    assert '\n' not in str(caught.value)
