import pytest

from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import build_config, flatten_config


def test_flattens_and_builds_with_its_learning_part() -> None:
    values = flatten_config(ControllerConfig(mode='crisp'))
    assert values['learning.alpha'] == 0.3
    assert build_config(ControllerConfig, values) == ControllerConfig(mode='crisp')


@pytest.mark.parametrize(
    ('field', 'value'),
    [
        ('mode', 'blurred'),
        ('goal', 'FOO/BAR'),
        ('cruise_speed_m_per_s', 0.6),
        ('goal_confidence', 1.5),
    ],
)
def test_refuses_values_out_of_range(field: str, value: object) -> None:
    with pytest.raises(ConfigurationError, match=field):
        build_config(ControllerConfig, {field: value})
