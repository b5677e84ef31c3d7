import dataclasses
import math

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.sensor_messages import scan_from_raw, sonar_to_raw
from goalreach_msgs_py.values import Pose2, Scan
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig
from goalreach_sim.sonar import NEAREST_M, SonarRing

BASE = Pose2(x_m=2.0, y_m=2.5, heading_rad=0.0)


def ring(error: float = 0.0, dropouts: float = 0.0) -> SonarRing:
    noise = NoiseModel(sonar_error=error, sonar_dropout_probability=dropouts)
    config = SimulatorConfig(
        arena_width_m=4.0, arena_length_m=6.0, body_radius_m=0.25, noise=noise
    )
    return SonarRing(config, np.random.default_rng(5))


def test_walls_are_seen_by_what_looks_straight_at_them() -> None:
    ranges_m = ring().read(BASE, ())
    assert [ranges_m[i] for i in (0, 4, 8, 12)] == pytest.approx([2.0, 3.5, 2.0, 2.5])
    # The beam of a neighbour, 22.5 degrees aside, meets the wall 10 degrees off its normal at
    # best: an echo. Two sensors further every ray is reflected away.
    assert ranges_m[1] == pytest.approx(
        0.25 + (1.75 + 0.25 * (1 - math.cos(math.pi / 8))) / math.cos(math.radians(10.0)), abs=0.01
    )
    assert ranges_m[2] == math.inf


def test_a_cylinder_is_seen_through_the_cone_and_hides_the_wall() -> None:
    post = Obstacle(x_m=3.2, y_m=2.5, radius_m=0.2)
    ranges_m = ring().read(BASE, [post])
    assert ranges_m[0] == pytest.approx(1.0)
    assert ranges_m[8] == pytest.approx(2.0)


def test_a_box_is_seen_face_on_and_at_its_edges_alone() -> None:
    def front(heading_deg: float) -> float:
        box = Obstacle(
            x_m=3.2, y_m=2.5, length_m=0.4, width_m=3.0, heading_rad=math.radians(heading_deg)
        )
        return ring().read(BASE, [box])[0]

    assert front(0.0) == pytest.approx(1.0)
    assert front(45.0) == math.inf


@pytest.mark.parametrize('turn_deg', [30.0, -50.0, 120.0])
def test_a_turned_box_is_as_far_as_a_straight_one(turn_deg: float) -> None:
    turn = math.radians(turn_deg)
    x_m, y_m = 2.0 + 1.2 * math.cos(turn), 2.5 + 1.2 * math.sin(turn)
    box = Obstacle(x_m=x_m, y_m=y_m, length_m=0.4, width_m=1.0, heading_rad=turn)
    ranges_m = ring().read(Pose2(x_m=2.0, y_m=2.5, heading_rad=turn), [box])
    assert ranges_m[0] == pytest.approx(1.0)
    across = Obstacle(x_m=x_m, y_m=y_m, length_m=1.0, width_m=0.4, heading_rad=turn + math.pi / 2)
    again_m = ring().read(Pose2(x_m=2.0, y_m=2.5, heading_rad=turn), [across])
    assert again_m == pytest.approx(ranges_m)


def test_errors_and_dropouts() -> None:
    noisy = ring(error=0.01, dropouts=0.1)
    readings = np.array([noisy.read(BASE, ())[0] for _ in range(2000)])
    lost = np.isinf(readings)
    assert np.mean(lost) == pytest.approx(0.1, abs=0.03)
    # 1 % of the 1.75 m from the sensor, which sits 0.25 m from the axis.
    assert np.std(readings[~lost]) == pytest.approx(0.0175, rel=0.1)
    assert np.mean(readings[~lost]) == pytest.approx(2.0, abs=0.002)


def test_a_scan_survives_as_a_message() -> None:
    ranges_m = ring().read(BASE, ())
    raw = sonar_to_raw(ranges_m, 7, 'robot1/', limits_m=(0.4, 6.7), scan_time_s=0.04)
    scan = scan_from_raw(raw)
    assert scan.on_base
    assert scan.ranges_m == pytest.approx(ranges_m)
    assert (scan.first_rad, scan.step_rad) == pytest.approx((0.0, math.tau / 16))


def test_only_who_asks_for_sonar_has_one_and_it_changes_nothing_else() -> None:
    plain = SimulatorConfig.for_arena(Arena(), noise_preset('nominal'))
    frames = []
    for config in (plain, dataclasses.replace(plain, sonar=True)):
        simulator = Simulator(config, np.random.default_rng(3))
        for _ in range(3):
            simulator.advance()
        frames.append(simulator.sense())
    without, with_sonar = frames
    assert without.sonar == ()
    assert len(with_sonar.sonar) == 16
    assert np.array_equal(without.image, with_sonar.image)
    assert without.joints == with_sonar.joints


def test_an_obstacle_of_the_arena_hides_an_led_until_it_has_passed() -> None:
    tall = Obstacle(
        x_m=1.778, y_m=2.0, radius_m=0.05, height_m=1.9, track_m=((0.5, 2.0),), speed_m_per_s=0.5
    )
    config = SimulatorConfig.for_arena(Arena(obstacles=(tall,)), noise_preset('none'))
    simulator = Simulator(config, np.random.default_rng(1))
    simulator.reset(Pose2(x_m=1.778, y_m=3.5, heading_rad=-math.pi / 2))
    assert config.sonar
    simulator.advance()
    hidden = simulator.sense().image[:, 300:340].max()
    for _ in range(25):
        simulator.advance()
    assert hidden == 10 < simulator.sense().image[:, 300:340].max()


def scan_of(step_rad: float, ranges_m: list[float]) -> Scan:
    raw = sonar_to_raw((1.0,), 7, limits_m=(0.4, 6.7), scan_time_s=0.04)
    message = deserialize_message(raw, LaserScan)
    message.angle_min, message.angle_increment, message.ranges = 0.5, step_rad, ranges_m
    return scan_from_raw(serialize_message(message))


def test_scans_of_others() -> None:
    scan = scan_of(-0.1, [1.0, 2.0, 3.0])  # clockwise
    assert (scan.first_rad, scan.step_rad) == pytest.approx((0.3, 0.1))
    assert scan.ranges_m == (3.0, 2.0, 1.0)
    near, far, unknown = scan_of(0.1, [-math.inf, 9.0, math.nan]).ranges_m
    assert (near, far, unknown) == pytest.approx((0.4, math.inf, math.inf))
    with pytest.raises(MessageError, match='angle_increment'):
        scan_of(0.0, [1.0])


def test_noise_makes_no_range_too_short_to_be_one() -> None:
    noise = dataclasses.replace(noise_preset('none'), sonar_error=0.3)
    config = SimulatorConfig.for_arena(Arena(), noise)
    sonar = SonarRing(config, np.random.default_rng(1))
    base = Pose2(x_m=0.3, y_m=2.0, heading_rad=0.0)
    readings = np.array([sonar.read(base, ()) for _ in range(50)])
    assert readings.min() >= config.body_radius_m + NEAREST_M
