import dataclasses
import math

import numpy as np
import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.obstacles import Obstacle, obstacles_to_flat
from goalreach_msgs_py.values import HeadAngles, Pose2, Twist2
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatedFaults, SimulatorConfig

START = Pose2(x_m=1.778, y_m=3.0, heading_rad=-math.pi / 2)


def make_simulator(preset: str = 'none', seed: int = 1) -> Simulator:
    config = SimulatorConfig.for_arena(Arena(), noise_preset(preset))
    simulator = Simulator(config, np.random.default_rng(seed))
    simulator.reset(START)
    return simulator


def twist(linear_m_per_s: float, steering_rad_per_s: float) -> Twist2:
    return Twist2(linear_m_per_s=linear_m_per_s, steering_rad_per_s=steering_rad_per_s)


def head(turret_rad: float, pan_rad: float = 0.0, tilt_rad: float = 0.0) -> HeadAngles:
    return HeadAngles(turret_rad=turret_rad, pan_rad=pan_rad, tilt_rad=tilt_rad)


def drive(simulator: Simulator, periods: int) -> list[SensorFrame]:
    frames = []
    for tick in range(periods):
        simulator.command_drive(twist(0.4, 0.5 * math.sin(tick / 10)))
        simulator.command_head(head(0.2, 0.1, 0.15))
        simulator.advance()
        frames.append(simulator.sense())
    return frames


def contents(frame: SensorFrame) -> tuple[object, ...]:
    values = (getattr(frame, field.name) for field in dataclasses.fields(frame))
    return tuple(v.tobytes() if isinstance(v, np.ndarray) else v for v in values)


def test_leds_are_where_the_camera_model_says() -> None:
    simulator = make_simulator()
    simulator.command_head(head(0.0, 0.0, 0.2))
    for _ in range(10):
        simulator.advance()
    frame = simulator.sense()
    # Middle LED: 2.492 m ahead, 0.7288 m above the camera. Seen 16.302 deg up, 4.843 deg above
    # the axis: 554.256 px * tan = 46.96 px over the middle row.
    window = frame.image[180:206, 307:333].astype(float) - 10.0
    rows, columns = np.indices(window.shape)
    elevation_rad = math.atan2(1.8288 - 1.10, 3.0 - 0.508) - 0.2
    v_px = 239.5 - 554.2562584 * math.tan(elevation_rad)
    assert (window * rows).sum() / window.sum() + 180 == pytest.approx(v_px, abs=0.02)
    assert (window * columns).sum() / window.sum() + 307 == pytest.approx(319.5, abs=0.02)


def test_frame_without_noise_equals_the_truth() -> None:
    simulator = make_simulator()
    frame = drive(simulator, 40)[-1]
    assert frame.time_ns == 40 * 40_000_000
    assert frame.odometry.pose.x_m == pytest.approx(frame.truth.pose.x_m, abs=1e-12)
    assert frame.odometry.pose.y_m == pytest.approx(frame.truth.pose.y_m, abs=1e-12)
    assert frame.odometry.pose.heading_rad == pytest.approx(frame.truth.pose.heading_rad)
    assert frame.joints == frame.truth_head
    assert frame.base_yaw_rad == pytest.approx(simulator.robot.base_yaw_rad, abs=1e-12)


def test_same_seed_same_frames() -> None:
    one, other = (drive(make_simulator('nominal', 5), 15) for _ in range(2))
    assert [contents(f) for f in one] == [contents(f) for f in other]


def test_changed_noise_draws_new_errors_at_the_same_pose() -> None:
    simulator = make_simulator('nominal', 5)
    before = drive(simulator, 30)[-1]
    simulator.change_noise(noise_preset('none'))
    simulator.advance()
    after = simulator.sense()
    assert after.time_ns == before.time_ns + 40_000_000
    assert after.truth.pose == before.truth.pose
    assert after.odometry.pose == after.truth.pose
    assert after.joints == after.truth_head
    assert simulator.config.noise == noise_preset('none')
    assert drive(simulator, 30)[-1].joints == simulator.sense().truth_head


def test_faults_survive_changed_noise() -> None:
    simulator = make_simulator()
    simulator.faults = SimulatedFaults(stuck_bumper=4)
    simulator.change_noise(noise_preset('harsh'))
    assert simulator.sense().bumpers[4]


def test_another_seed_other_frames() -> None:
    one, other = drive(make_simulator('nominal', 5), 1), drive(make_simulator('nominal', 6), 1)
    assert contents(one[0]) != contents(other[0])


def test_pixels_do_not_depend_on_the_drive() -> None:
    standing, driven = make_simulator('nominal', 5), make_simulator('nominal', 5)
    driven.command_drive(twist(0.4, 0.0))
    for _ in range(20):
        standing.advance()
        driven.advance()
    bottom = slice(400, 480)  # no LED gets there
    assert (standing.sense().image[bottom] == driven.sense().image[bottom]).all()


def test_head_target_is_relative_to_the_heading_now_and_then_to_the_base() -> None:
    simulator = make_simulator()
    simulator.command_drive(twist(0.0, 1.0))
    for _ in range(12):
        simulator.advance()
    steered_rad = simulator.robot.steering.position
    assert steered_rad > 0.05
    simulator.command_head(head(0.3))
    simulator.command_drive(twist(0.0, -1.0))
    for _ in range(75):
        simulator.command_drive(twist(0.0, -1.0))
        simulator.advance()
    assert simulator.robot.turret.position == pytest.approx(steered_rad + 0.3, abs=1e-12)
    joint_rad = simulator.sense().joints.turret_rad
    expected_rad = steered_rad + 0.3 - simulator.robot.steering.position
    assert math.cos(joint_rad - expected_rad) == pytest.approx(1.0, abs=1e-12)


def test_turret_takes_the_shortest_turn() -> None:
    simulator = make_simulator()
    simulator.command_head(head(3.0))
    for _ in range(150):
        simulator.advance()
    simulator.command_head(head(-3.0))
    for _ in range(150):
        simulator.advance()
    assert simulator.robot.turret.position == pytest.approx(2 * math.pi - 3.0, abs=1e-12)


def test_reset_keeps_clock_and_errors_and_restarts_the_rest() -> None:
    simulator = make_simulator('nominal', 3)
    before = drive(simulator, 30)[-1]
    simulator.reset(START)
    frame = simulator.sense()
    assert frame.time_ns == before.time_ns
    assert frame.truth.pose == START
    assert frame.odometry.pose == START
    assert frame.odometry.twist == twist(0.0, 0.0)
    assert frame.truth_head.turret_rad == 0.0
    assert abs(frame.truth_head.pan_rad) < 0.02
    again = drive(simulator, 30)[-1]
    assert again.time_ns == 2 * before.time_ns
    assert again.truth.pose == before.truth.pose
    assert again.odometry.pose == before.odometry.pose


def test_watchdog_stops_the_drive() -> None:
    simulator = make_simulator()
    simulator.command_drive(twist(0.4, 0.0))
    simulator.command_head(head(1.0))
    for _ in range(60):
        simulator.advance()
    frame = simulator.sense()
    assert frame.truth.twist == twist(0.0, 0.0)
    # The ramp would end at 0.525 s; the watchdog comes at 0.4 s and 0.3048 m/s, after 0.06096 m,
    # and brakes at 5.08 m/s^2 over 0.3048^2 / 10.16 = 0.009144 m.
    assert START.y_m - frame.truth.pose.y_m == pytest.approx(0.070104, abs=1e-9)
    # The turret stops too: 30 deg/s^2 for 0.4 s up and 0.4 s down make 4.8 degrees.
    assert frame.joints.turret_rad == pytest.approx(math.radians(4.8), abs=1e-9)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_watchdog_stops_from_full_speed_within_its_time(
    sign: float,
) -> None:
    simulator = make_simulator()
    for _ in range(25):
        simulator.command_drive(twist(sign * 0.508, 0.0))
        simulator.advance()
    speeds = []
    for _ in range(13):
        speeds.append(sign * simulator.sense().truth.twist.linear_m_per_s)
        simulator.advance()
    # From 0.04 s after the last command on: full speed until 0.4 s; at 0.5 s, and so at the tick
    # of 0.52 s, it stands.
    assert speeds == pytest.approx([0.508] * 10 + [0.3048, 0.1016, 0.0])
    assert simulator.sense().truth.twist == twist(0.0, 0.0)


def test_a_command_while_the_watchdog_brakes_counts_at_once() -> None:
    simulator = make_simulator()
    for _ in range(25):
        simulator.command_drive(twist(0.4, 0.0))
        simulator.advance()
    for _ in range(10):
        simulator.advance()
    assert simulator.sense().truth.twist.linear_m_per_s == pytest.approx(0.4 - 0.04 * 5.08)
    simulator.command_drive(twist(0.4, 0.0))
    simulator.advance()
    assert simulator.sense().truth.twist.linear_m_per_s == pytest.approx(0.1968 + 0.04 * 0.762)


def test_head_moves_without_a_drive_command() -> None:
    simulator = make_simulator()
    simulator.command_head(head(1.0))
    for _ in range(100):
        simulator.advance()
    assert simulator.sense().joints.turret_rad == pytest.approx(1.0, abs=1e-12)


def test_the_camera_moves_with_the_robot() -> None:
    simulator = make_simulator()
    simulator.reset(Pose2(x_m=1.778, y_m=3.0, heading_rad=-2.0))
    simulator.command_drive(twist(0.4, 0.0))
    for _ in range(5):
        simulator.advance()
    moves = simulator._camera_pose(head(1.0)).velocity_m_per_s
    # After 0.2 s at 0.762 m/s^2.
    assert moves == pytest.approx([0.1524 * math.cos(2.0), -0.1524 * math.sin(2.0), 0.0])


def test_bump_is_sensed() -> None:
    simulator = make_simulator()
    simulator.reset(Pose2(x_m=1.778, y_m=0.3, heading_rad=-math.pi / 2))
    for _ in range(50):
        simulator.command_drive(twist(0.4, 0.0))
        simulator.advance()
    frame = simulator.sense()
    assert [i for i, flag in enumerate(frame.bumpers) if flag] == [0, 1, 19]
    assert frame.truth.pose.y_m == pytest.approx(0.225, abs=1e-12)


def test_a_post_hides_an_led() -> None:
    config = SimulatorConfig.for_arena(Arena(), noise_preset('none'))
    post = Obstacle(x_m=1.778, y_m=2.0, radius_m=0.05, height_m=1.9)
    config = dataclasses.replace(config, obstacles=obstacles_to_flat([post]))
    simulator = Simulator(config, np.random.default_rng(1))
    simulator.reset(START)
    simulator.command_head(head(0.0, 0.0, 0.2))
    for _ in range(10):
        simulator.advance()
    image = simulator.sense().image
    assert (image[:, 300:340] == 10).all()
    assert image.max() > 60


def test_an_old_command_feeds_the_watchdog_less() -> None:
    stopped_m = []
    for age_s in (0.0, 0.2):
        simulator = make_simulator()
        for _ in range(25):
            simulator.command_drive(twist(0.4, 0.0))
            simulator.advance()
        before = simulator.sense().truth.pose
        simulator.command_drive(twist(0.4, 0.0), age_s)
        for _ in range(25):
            simulator.advance()
        stopped_m.append(before.y_m - simulator.sense().truth.pose.y_m)
    # 0.4 m/s for 0.4 s, and 0.4^2 / 10.16 to brake; 0.2 s less of the first.
    assert stopped_m == pytest.approx([0.175748, 0.095748], abs=1e-6)


def test_a_refused_reset_changes_nothing_and_new_noise_moves_out_of_an_obstacle() -> None:
    walker = Obstacle(
        x_m=1.0, y_m=1.0, radius_m=0.2, speed_m_per_s=0.3, track_m=((2.0, 1.0), (1.0, 1.0))
    )
    config = SimulatorConfig.for_arena(
        dataclasses.replace(Arena(), obstacles=(walker,)), noise_preset('none')
    )
    simulator = Simulator(config, np.random.default_rng(1))
    simulator.reset(START)
    for _ in range(75):
        simulator.advance()
    (before,) = simulator.robot.walls.obstacles
    assert before.x_m > 1.5
    with pytest.raises(ConfigurationError, match='start_pose'):
        simulator.reset(Pose2(x_m=1.0, y_m=1.0, heading_rad=0.0))
    assert simulator.robot.walls.obstacles == (before,)
    simulator.robot.place(Pose2(x_m=1.0, y_m=1.0, heading_rad=0.0))
    simulator.change_noise(noise_preset('nominal'))
    assert simulator.robot.walls.clearance_m(simulator.robot.x_m, simulator.robot.y_m) >= 0.0
