import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_sim.drive_config import DriveConfig, HeadConfig


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
