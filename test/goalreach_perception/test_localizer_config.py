from __future__ import annotations

import math
import re

import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_perception.head_tracker import HeadConfig
from goalreach_perception.localizer_config import LocalizerConfig


def test_the_default_is_the_default_arena() -> None:
    assert LocalizerConfig.for_arena(Arena(), NoiseModel()) == LocalizerConfig()
    assert LocalizerConfig().landmark_array_m.shape == (3, 3)
    assert LocalizerConfig().mount == (0.0, 0.0, 1.1, 0.0, 0.0, 0.0)
    assert LocalizerConfig().landmark_array_m[1].tolist() == [1.778, 0.508, 1.8288]


def test_it_survives_the_way_through_parameters() -> None:
    config = LocalizerConfig.for_arena(Arena(), noise_preset('harsh'))
    assert build_config(LocalizerConfig, flatten_config(config)) == config


@pytest.mark.parametrize('places', [(), (1.0,) * 6, (1.0,) * 10])
def test_places_that_are_not_those_of_three_leds_are_refused(places: tuple[float, ...]) -> None:
    with pytest.raises(ConfigurationError, match='landmarks_m'):
        LocalizerConfig(landmarks_m=places)


def test_a_nested_field_is_refused_by_its_whole_name() -> None:
    with pytest.raises(ConfigurationError, match=r'filter\.led_gate'):
        build_config(LocalizerConfig, {'filter.led_gate': -1.0})


@pytest.mark.parametrize(
    ('field', 'value', 'least'),
    [
        ('detection.maximum_spots', 2, 3),  # three LEDs make a pose
        ('detection.window_half_px', 81, 80),
        ('watch.triple_confirmations', 9, 8),  # a pose must be confirmed within 8 images
    ],
)
def test_a_value_that_could_not_work_is_refused(field: str, value: int, least: int) -> None:
    with pytest.raises(ConfigurationError, match=re.escape(field)):
        build_config(LocalizerConfig, {field: value})
    assert flatten_config(build_config(LocalizerConfig, {field: least}))[field] == least


def test_a_tilt_range_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='tilt_minimum_rad'):
        HeadConfig(tilt_minimum_rad=0.5, tilt_maximum_rad=0.1)


def test_a_camera_that_looks_along_the_axis_of_its_head_is_refused() -> None:
    for pitch_rad in (-math.pi / 2, 1.5):
        with pytest.raises(ConfigurationError, match='a pitch below 84 degrees'):
            LocalizerConfig(camera_mount=(0.1, 0.0, 1.0, 0.0, pitch_rad, 0.0))
    assert LocalizerConfig(camera_mount=(0.1, 0.0, 1.0, 0.0, math.pi, 0.0)).mount[0] == 0.1


@pytest.mark.parametrize(
    ('values', 'allowed'),
    [({'camera_mount': (0.1, 0.0, 1.0, 0.0, 0.0)}, 'six numbers'), ({'leds': False}, 'no tags')],
)
def test_half_a_mount_and_an_arena_without_landmarks_are_refused(
    values: dict[str, object], allowed: str
) -> None:
    with pytest.raises(ConfigurationError, match=allowed):
        build_config(LocalizerConfig, values)
