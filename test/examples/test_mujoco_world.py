"""The MuJoCo world: what it may import, what its camera and base do, and two paths in it."""

from __future__ import annotations

import argparse
import ast
from functools import partial
import math
from pathlib import Path
import subprocess
import sys
from typing import Any

from nav_msgs.msg import Odometry
import numpy as np
import pytest
from sensor_msgs.msg import Image, JointState

from goalreach_lab.abroad.ros_drive import WORLD, drive
from goalreach_msgs_py.arena import Arena
import graphs
from modules import load_module
from mujoco_rendering import require_rendering

ARENA = {'width_m': 3.556, 'length_m': 5.08, 'leds_m': [list(led) for led in Arena().landmarks_m]}
LARGEST_LINES = 350


@pytest.fixture(scope='module')
def world() -> Any:
    require_rendering()
    return load_module(WORLD)


def options(world: Any, **changes: Any) -> argparse.Namespace:
    values = {name.replace('-', '_'): float(value) for name, value in world.OPTIONS.items()}
    flags = {'base': 'nomad200', 'tyres': 'hard', 'seed': 3, 'texture': False, 'lamps': False}
    return argparse.Namespace(**{**values, **flags, 'reflections': False, **changes})


def test_it_is_one_short_file_that_imports_nothing_of_ours() -> None:
    text = WORLD.read_text()
    assert len(text.splitlines()) <= LARGEST_LINES
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or '')
    assert 'mujoco' in names
    assert not [name for name in names if name.startswith(('goalreach', '.'))]


@pytest.mark.parametrize('blur_px', [0.3, 1.2, 2.5])
def test_the_centroid_of_an_led_is_its_projection(world: Any, blur_px: float) -> None:
    robot, compared = world.Robot(options(world, blur=blur_px), ARENA), 0
    half, rng = 16, np.random.default_rng(0)
    for _ in range(8):
        robot.reset([rng.uniform(0.8, 2.8), rng.uniform(1.5, 4.5), -math.pi / 2])
        world.mujoco.mj_forward(robot.model, robot.data)
        image = robot.render()
        turn = robot.data.cam_xmat[0].reshape(3, 3)
        for x, y, z in (robot.data.geom_xpos[robot.lights] - robot.data.cam_xpos[0]) @ turn:
            u = (robot.columns - 1) / 2 - robot.focal_px * x / z
            v = (robot.rows - 1) / 2 + robot.focal_px * y / z
            if not (half < u < robot.columns - half - 1 and half < v < robot.rows - half - 1):
                continue
            left, top, across = round(u) - half, round(v) - half, np.arange(2 * half)
            spot = image[top : top + 2 * half, left : left + 2 * half]
            assert left + spot.sum(0) @ across / spot.sum() == pytest.approx(u, abs=0.03)
            assert top + spot.sum(1) @ across / spot.sum() == pytest.approx(v, abs=0.03)
            compared += 1
    assert compared >= 8


def slip_deg(world: Any, tyres: str) -> float:
    """Return the angle between heading and motion in a bend of 0.4 m/s and 0.7 rad/s."""
    robot = world.Robot(options(world, tyres=tyres), ARENA)
    robot.reset([1.8, 2.0, 0.3])
    for step in range(2500):
        robot.age_s, robot.wanted = 0.0, np.array([0.4, 0.7 if step > 800 else 0.0])
        robot.step()
    x, y = robot.data.qvel[:2]
    return abs(math.degrees(math.remainder(math.atan2(y, x) - robot.truth()[2], math.tau)))


def test_soft_tyres_slip_in_a_bend(world: Any) -> None:
    assert slip_deg(world, 'hard') < 0.15
    assert 0.3 < slip_deg(world, 'soft') < 0.8


def test_a_wall_stops_the_robot_and_presses_the_bumpers_in_front(world: Any) -> None:
    robot = world.Robot(options(world), ARENA)
    robot.reset([1.8, 0.5, -math.pi / 2])
    for _ in range(3000):
        robot.age_s, robot.wanted = 0.0, np.array([0.2, 0.0])
        robot.step()
    assert robot.truth()[1] == pytest.approx(world.BODY_M, abs=0.003)
    pressed = np.flatnonzero(robot.data.sensordata)
    assert 0 in pressed
    assert set(pressed) <= {19, 0, 1}


def test_the_differential_base_turns_by_its_wheels(world: Any) -> None:
    robot = world.Robot(options(world, base='differential'), ARENA)
    robot.age_s, robot.wanted = 0.0, np.array([0.3, 0.5])
    for _ in range(1000):
        robot.age_s = 0.0
        robot.step()
    turned, counted = robot.truth()[2] + math.pi / 2, robot.odometry[2] + math.pi / 2
    assert 0.3 < counted < 0.5
    assert turned == pytest.approx(counted, abs=0.03)
    assert robot.render().shape == (720, 1280)


@pytest.mark.graph
@pytest.mark.usefixtures('world')
def test_sensors_have_clocks_of_their_own(tmp_path: Path) -> None:
    flags = ('--odom-hz', '50', '--joints-hz', '40', '--jitter-ms', '3', '--delay-ms', '15')
    domain = graphs.fresh_domain()
    environment = graphs.graph_environment(domain, tmp_path)
    process = subprocess.Popen([sys.executable, str(WORLD), *flags], env=environment)
    kinds = {'/odom': Odometry, '/joint_states': JointState, '/camera/image_raw': Image}
    stamps: dict[str, list[int]] = {topic: [] for topic in kinds}
    try:
        with graphs.onlooker(domain) as (node, serve_until):
            for topic, kind in kinds.items():
                node.create_subscription(kind, topic, partial(_keep, stamps[topic]), 50)
            assert serve_until(lambda: all(len(kept) >= 25 for kept in stamps.values()), 60.0)
    finally:
        process.terminate()
        assert process.wait(20.0) == 0
    for topic, period_ms in zip(kinds, (20.0, 25.0, 40.0), strict=True):
        periods_ms = np.diff(stamps[topic]) / 1e6
        assert np.median(periods_ms) == pytest.approx(period_ms, abs=3.0)
        assert np.ptp(periods_ms) > 0
    assert not set(stamps['/camera/image_raw']) <= set(stamps['/odom'])


def _keep(kept: list[int], message: Any) -> None:
    kept.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


@pytest.mark.graph
@pytest.mark.timeout(400)
def test_two_paths_in_the_dark_reach_the_goal(world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert world.mujoco
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))
    instant = ('--exposure', '0')  # one image for each stamp, not three: software renders them
    paths = list(drive(instant, {}, Arena().starts[2:4], seed=7))
    assert [path['outcome'] for path in paths] == ['goal', 'goal']
    assert all(len(path['errors']) > 50 for path in paths)
