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
import yaml

from goalreach_lab.abroad.ros_drive import WORLD, drive
from goalreach_lab.behaviors.mujoco_driver import drive_mujoco
from goalreach_lab.behaviors.suite import ALL
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Pose2
from goalreach_perception.measurement_model import Optics
from goalreach_perception.tag_detection import TagDetector
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


def test_it_is_short_and_imports_nothing_of_ours() -> None:
    assert len(WORLD.read_text().splitlines()) <= LARGEST_LINES
    names: set[str] = set()
    for path in WORLD.parent.glob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
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


def test_an_image_is_of_the_step_that_joints_are_read_at(world: Any) -> None:
    robot = world.Robot(options(world), ARENA)
    robot.head[:] = 0.5, 0.0, 0.0
    for _ in range(50):
        robot.step()
    robot.render()
    seen = robot.data.cam_xmat.copy()
    world.mujoco.mj_forward(robot.model, robot.data)
    assert seen == pytest.approx(robot.data.cam_xmat, abs=1e-12)


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


POST = {'x_m': 1.778, 'y_m': 2.5, 'radius_m': 0.2, 'height_m': 1.6}
BOX = {'x_m': 0.8, 'y_m': 3.5, 'length_m': 0.3, 'width_m': 0.5, 'heading_deg': 90}
WALKER = {'x_m': 2.4, 'y_m': 3.5, 'radius_m': 0.1, 'track_m': [[0.4, 3.5]], 'speed_m_per_s': 0.1}


def among(world: Any, *obstacles: Any, ambient: float = 0.0) -> Any:
    """Return the robot among obstacles, at (1.778, 3.5), facing the goal's wall."""
    robot = world.Robot(options(world, ambient=ambient), {**ARENA, 'obstacles': list(obstacles)})
    robot.reset([1.778, 3.5, -math.pi / 2])
    world.mujoco.mj_forward(robot.model, robot.data)
    return robot


def test_the_sonar_hears_what_meets_its_beams_squarely(
    world: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard = world.Obstacles.hear.__globals__
    monkeypatch.setitem(heard, 'LOST', 0.0)
    monkeypatch.setitem(heard, 'ERROR', 0.0)
    ranges_m = among(world, POST, BOX).obstacles.hear()
    assert len(ranges_m) == 16
    # In front the post, to the left the wall, behind the wall, to the right the box, turned by a
    # right angle so that it ends at 0.8 + 0.25.
    found = [ranges_m[sensor] for sensor in (0, 4, 8, 12)]
    assert found == pytest.approx([3.5 - 2.7, 1.778, 1.58, 1.778 - 1.05], abs=1e-3)
    # Askew, the wall is heard by the edge of a beam, 22.5 - 12.5 degrees off the wall's normal.
    eye_m = 0.205 * math.cos(math.radians(22.5))
    slant_m = (1.778 - eye_m) / math.cos(math.radians(10.0))
    assert ranges_m[5] == pytest.approx(0.205 + slant_m, abs=1e-3)
    # Past the post, the beam meets everything too far off its normal.
    assert ranges_m[14] == math.inf


def test_a_sonar_misses_some_echoes_and_errs_by_a_hundredth(world: Any) -> None:
    obstacles = among(world, POST).obstacles
    ranges_m = np.array([obstacles.hear()[0] for _ in range(1000)])
    assert 5 < np.isinf(ranges_m).sum() < 45
    echoes_m = ranges_m[np.isfinite(ranges_m)]
    assert np.mean(echoes_m) == pytest.approx(0.8, abs=0.002)
    assert np.std(echoes_m) == pytest.approx(0.01 * (0.8 - 0.205), rel=0.15)


@pytest.mark.parametrize('ambient', [0.0, 60.0])
def test_an_obstacle_hides_an_led_and_is_seen_in_light(world: Any, ambient: float) -> None:
    brightest = []
    for obstacles in ((), (POST,)):
        robot = among(world, *obstacles, ambient=ambient)
        image = robot.render()
        brightest.append(image[:, 280:360].max())
        robot.whole.close()
        robot.tile.close()
    free, hidden = brightest
    # The post has 0.8 of the grey value of the walls.
    assert image[200, 320] == pytest.approx(0.8 * ambient, abs=1.0)
    assert image[20, 100] == pytest.approx(ambient, abs=1.0)
    assert free > ambient + 50.0 > ambient + 1.0 > hidden


def test_who_runs_into_the_robot_turns_back(world: Any) -> None:
    robot, walked_m = among(world, WALKER), []
    for _ in range(6000):
        robot.step()
        walked_m.append(float(robot.data.mocap_pos[0, 0]))
    assert walked_m[1000] == pytest.approx(2.4 - 0.1, abs=0.001)
    # It meets the robot at 1.778 + 0.225 + 0.1, after 2.97 s, and has walked 2.97 s back at 6 s.
    assert min(walked_m) == pytest.approx(2.103, abs=0.003)
    assert walked_m[-1] == pytest.approx(2.4, abs=0.02)
    felt = set(np.flatnonzero(robot.pressed))
    assert felt
    assert felt <= {4, 5, 6}
    assert robot.truth()[:2] == pytest.approx([1.778, 3.5], abs=0.005)


def test_a_standing_box_stops_the_robot(world: Any) -> None:
    robot = among(world, {**BOX, 'x_m': 1.778, 'y_m': 2.9})
    for _ in range(3000):
        robot.age_s, robot.wanted = 0.0, np.array([0.2, 0.0])
        robot.step()
    assert robot.truth()[1] == pytest.approx(2.9 + 0.15 + world.BODY_M, abs=0.005)
    assert {0} <= set(np.flatnonzero(robot.pressed)) <= {19, 0, 1}


def test_a_start_must_leave_room(world: Any) -> None:
    obstacles = among(world, POST, BOX).obstacles
    # Beside the post, beside the box, at a wall.
    for x, y, room in (
        (1.778, 2.93, True), (1.778, 2.92, False), (1.28, 3.5, True), (1.27, 3.5, False),
        (3.4, 4.0, False),
    ):  # fmt: skip
        assert obstacles.leave(x, y) is room


@pytest.mark.parametrize('seed', [2, 3])  # of tyres smaller and larger than they should be
def test_the_differential_base_turns_by_its_wheels(world: Any, seed: int) -> None:
    robot = world.Robot(options(world, base='differential', seed=seed), ARENA)
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
@pytest.mark.parametrize(
    ('content', 'reason'),
    [
        (None, 'FileNotFoundError'),
        ('width_m: 3\n', "KeyError: 'length_m'"),
        ('leds_m: [', 'ParserError: while parsing a flow node'),
        ('- 3\n', 'TypeError: list indices'),
        ('{width_m: 3, length_m: 5, leds_m: [[1, 2]]}', 'ValueError: not enough values'),
    ],
)
def test_a_bad_arena_file_gets_one_line(tmp_path: Path, content: str | None, reason: str) -> None:
    path = tmp_path / 'arena.yaml'
    if content is not None:
        path.write_text(content)
    environment = graphs.graph_environment(graphs.fresh_domain(), tmp_path)
    command = [sys.executable, str(WORLD), '--arena', str(path)]
    run = subprocess.run(command, env=environment, text=True, capture_output=True, check=False)
    (line,) = run.stderr.strip().splitlines()
    assert line.startswith(f'{path}: {reason}')
    assert run.returncode == 1


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
            assert serve_until(lambda: all(len(kept) >= 25 for kept in stamps.values()), 90.0)
    finally:
        process.terminate()
        assert process.wait(20.0) == 0
    for topic, period_ms in zip(kinds, (20.0, 25.0, 40.0), strict=True):
        periods_ms = np.diff(stamps[topic]) / 1e6
        counts = np.round(periods_ms / period_ms)  # a world that is late leaves images out
        assert counts.min() >= 1
        assert topic.startswith('/camera') or counts.max() == 1
        assert np.abs(periods_ms - counts * period_ms).max() <= 6.0 + 1.0
        assert np.ptp(periods_ms) > 0
    assert not set(stamps['/camera/image_raw']) <= set(stamps['/odom'])


def _keep(kept: list[int], message: Any) -> None:
    kept.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


@pytest.mark.graph
@pytest.mark.timeout(900)
@pytest.mark.usefixtures('world')
def test_a_fixed_colour_camera_on_a_differential_base_reaches_the_goal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))
    arena = WORLD.with_name('eight_leds.yaml')
    leds_m = [float(c) for led in yaml.safe_load(arena.read_text())['leds_m'] for c in led]
    told = {'landmark_localizer': {'head': 'none', 'landmarks_m': leds_m}}
    flags = ('--base', 'differential', '--arena', str(arena))
    (path,) = drive(flags, told, Arena().starts[8:9], seed=7)
    assert path['outcome'] == 'goal'
    assert np.percentile([error for error, _ in path['errors']], 95) < 0.033


@pytest.mark.graph
@pytest.mark.timeout(900)
def test_two_paths_in_the_dark_reach_the_goal(world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert world.mujoco
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))
    instant = ('--exposure', '0')  # one image for each stamp, not three: software renders them
    paths = list(drive(instant, {}, Arena().starts[2:4], seed=7))
    assert [path['outcome'] for path in paths] == ['goal', 'goal']
    assert all(len(path['errors']) > 50 for path in paths)


@pytest.mark.graph
@pytest.mark.timeout(900)
@pytest.mark.usefixtures('world')
def test_the_behaviours_go_round_what_stands_and_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(graphs.fresh_domain()))
    start = Pose2(x_m=1.78, y_m=3.3, heading_rad=-math.pi / 2)
    obstacles = (
        Obstacle(x_m=1.9, y_m=2.3, length_m=0.4, width_m=0.2, heading_rad=0.3),
        Obstacle(x_m=0.6, y_m=1.9, radius_m=0.1, track_m=((0.6, 2.6),), speed_m_per_s=0.1),
    )
    arena = Arena(starts=(start,), obstacles=obstacles)
    path = drive_mujoco(arena, ALL, 60.0, seed=7)
    assert (path['outcome'], path['bumps'], path['ends_pressed']) == ('goal', 0, False)
    trace_m = np.array(path['trace'])
    assert min(obstacles[0].contact(*at_m)[0] for at_m in trace_m) > BODY_RADIUS_M
    assert np.abs(trace_m[:, 0] - 1.78).max() > 0.2


@pytest.mark.graph
@pytest.mark.timeout(900)
@pytest.mark.usefixtures('world')
def test_it_joins_a_run_and_may_be_killed_and_started_again(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    environment = graphs.graph_environment(domain, tmp_path)
    command = [sys.executable, str(WORLD), '--lockstep', '--exposure', '0']
    words = ['run', '--external', 'nomad200', '--policy', 'paper', '--clock', 'lockstep']
    words += ['--paths', '1', '--start', '1.78,3.0,-90', '--no-dashboard']
    odometry: list[Odometry] = []
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        node.create_subscription(Odometry, '/odom', odometry.append, 50)
        with subprocess.Popen(command, env=environment) as first:
            assert serve_until(
                lambda: bool(odometry) and odometry[-1].twist.twist.linear.x > 0.1, 120.0
            )
            first.kill()
        with subprocess.Popen(command, env=environment) as second:
            try:
                output, _ = run.communicate(timeout=200)
            finally:
                second.terminate()
    assert run.returncode == 0, output
    assert 'the clock of the robot has restarted: restarting the nodes' in output
    assert '1 of 1 paths reached the goal' in output


def test_printed_tags_are_where_the_camera_sees_them(world: Any) -> None:
    arena = read_arena(WORLD.with_name('six_tags.yaml'))
    told = yaml.safe_load(WORLD.with_name('six_tags.yaml').read_text())
    settings = options(world, base='differential', ambient=120.0, texture=True)
    robot, rng = world.Robot(settings, told), np.random.default_rng(0)
    focal_px, (rows, columns) = robot.focal_px, (robot.rows, robot.columns)
    camera = PinholeCamera(
        width_px=columns, height_px=rows, fx_px=focal_px, fy_px=focal_px,
        cx_px=(columns - 1) / 2, cy_px=(rows - 1) / 2,
    )  # fmt: skip
    detector, compared = TagDetector(arena.tags, arena.tag_family, 0, 0.0), 0
    for heading in np.arange(0.0, math.tau, 1.0):
        robot.reset([1.8, 2.5, heading])
        light = robot.render() + rng.normal(8.0, 1.0, (rows, columns))
        found = detector.find(light.round().clip(0, 255).astype(np.uint8), Optics(camera))
        turn = robot.data.cam_xmat[0].reshape(3, 3) * (1, -1, -1)
        for first in range(0, len(found.leds), 4):
            tag = arena.tags[int(found.leds[first]) // 4]
            page = int(
                np.flatnonzero(robot.model.geom_matid == robot.model.mat(str(tag.id)).id)[0]
            )
            right, up, _ = robot.data.geom_xmat[page].reshape(3, 3).T * tag.size_m / 2
            signs = ((-1, 1), (1, 1), (1, -1), (-1, -1))
            corners = [robot.data.geom_xpos[page] + a * right + b * up for a, b in signs]
            pixels = camera.project((np.array(corners) - robot.data.cam_xpos[0]) @ turn)
            assert found.pixels_px[first : first + 4] == pytest.approx(pixels, abs=0.15)
            compared += 1
    assert compared >= 5


@pytest.mark.graph
@pytest.mark.timeout(900)
@pytest.mark.usefixtures('world')
def test_a_webcam_sees_six_printed_tags_reaches_the_goal_and_is_recomputed(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    environment = graphs.graph_environment(domain, tmp_path)
    arena, parameters = (str(WORLD.with_name(f'{name}.yaml')) for name in ('six_tags', 'webcam'))
    flags = ['--base', 'differential', '--arena', arena, '--ambient', '120', '--compressed']
    flags += ['--lockstep', '--exposure', '0', '--camera-hz', '10']
    words = ['run', '--external', 'nomad200', '--policy', 'paper', '--clock', 'lockstep']
    words += ['--arena', arena, '--params-file', parameters, '--paths', '1']
    words += ['--start', '1.78,2.4,-90', '--no-dashboard', '--record', str(tmp_path / 'bag')]
    command = [sys.executable, str(WORLD), *flags]
    with (
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
        subprocess.Popen(command, env=environment) as robot,
    ):
        try:
            output, _ = run.communicate(timeout=300)
        finally:
            robot.terminate()
    assert run.returncode == 0, output
    assert '1 of 1 paths reached the goal' in output
    words = ['replay', str(tmp_path / 'bag'), '--recompute']
    with graphs.goalreach(words, domain=domain, home=tmp_path) as replay:
        output, _ = replay.communicate(timeout=100)
    assert replay.returncode == 0, output
    assert 'the same within' in output
