import math

import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_sim.simulator_config import DriveConfig, HeadConfig, SimulatorConfig


def test_for_arena_takes_over_the_arena() -> None:
    arena = Arena()
    config = SimulatorConfig.for_arena(arena, noise_preset('harsh'))
    assert config.landmark_array_m.tolist() == [*map(list, arena.landmarks_m)]
    assert (config.arena_width_m, config.arena_length_m) == (arena.width_m, arena.length_m)
    assert config.start == arena.starts[0]
    assert config.noise.read_noise_dn == 3.0
    nowhere = SimulatorConfig.for_arena(Arena(starts=()), noise_preset('none')).start_pose
    assert nowhere == pytest.approx((1.778, 2.54, -math.pi / 2))


def test_calibrated_camera_has_the_nominal_field_of_view() -> None:
    camera = SimulatorConfig(distortion=(0.1, 0.0, 0.0, 0.0, 0.0)).calibrated_camera
    # 320 / tan 30 deg
    assert camera.fx_px == pytest.approx(554.2562584)
    assert (camera.cx_px, camera.cy_px) == (319.5, 239.5)
    assert camera.distortion[0] == 0.1


def test_period_of_25_images_per_second() -> None:
    assert SimulatorConfig().period_ns == 40_000_000


def test_survives_the_way_through_ros_parameters() -> None:
    config = SimulatorConfig(watchdog_s=0.75, noise=noise_preset('harsh'))
    assert build_config(SimulatorConfig, flatten_config(config)) == config


@pytest.mark.parametrize(
    ('values', 'line'),
    [
        ({'landmarks_m': (1.0, 2.0)}, 'landmarks_m'),
        ({'tags': (1.0, 2.0, 0.1)}, 'tags'),
        ({'tag_family': '36h12'}, 'tag_family'),
        ({'start_pose': (0.1, 2.0, 0.0)}, 'start_pose'),
        ({'start_pose': (1.0, 2.0)}, 'start_pose'),
        ({'start_pose': (1.0, math.nan, 0.0)}, 'start_pose'),
        ({'body_radius_m': 0.9, 'arena_width_m': 1.5}, 'arena_width_m = 1.5'),
        ({'noise.read_noise_dn': -1.0}, r'noise\.read_noise_dn = -1\.0'),
        ({'drive.steering_speed_rad_per_s': 0.0}, r'drive\.steering_speed_rad_per_s'),
        ({'camera_rate_hz': 0.0}, 'camera_rate_hz'),
        ({'watchdog_s': 0.1}, 'watchdog_s = 0.1: must be longer than braking from full speed'),
    ],
)
def test_bad_values_are_refused_by_name(values: dict[str, object], line: str) -> None:
    with pytest.raises(ConfigurationError, match=line):
        build_config(SimulatorConfig, values)


def test_defaults_are_those_of_the_machine() -> None:
    config = DriveConfig()
    assert config.translation_speed_m_per_s == pytest.approx(0.508)
    assert config.translation_acceleration_m_per_s2 == pytest.approx(0.762)
    assert config.steering_speed_rad_per_s == pytest.approx(1.0471975512)
    assert config.turret_speed_rad_per_s == pytest.approx(1.5707963268)


def test_more_than_the_hard_limit_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='translation_speed_m_per_s'):
        DriveConfig(translation_speed_m_per_s=0.7)


def test_a_range_must_not_be_empty() -> None:
    with pytest.raises(ConfigurationError, match='tilt_maximum_rad'):
        HeadConfig(tilt_minimum_rad=0.0, tilt_maximum_rad=0.0)
