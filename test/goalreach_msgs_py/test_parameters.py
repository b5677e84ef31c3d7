"""Configuration dataclasses with ranges."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import (
    Configuration,
    build_config,
    flatten_config,
    parameter,
    parameter_infos,
)


@dataclass(frozen=True, kw_only=True)
class Inner(Configuration):
    rate_hz: float = parameter(25.0, 'Rate, Hz', within=(1.0, 100.0))


@dataclass(frozen=True, kw_only=True)
class Outer(Configuration):
    count: int = parameter(3, 'Count', within=(0, None))
    kind: str = parameter('a', 'Kind', choices=('a', 'b'))
    on: bool = parameter(default=True, description='On')
    pose: tuple[float, ...] = parameter((0.0, 0.0), 'Pose, m', length=2, within=(-9.0, None))
    inner: Inner = field(default_factory=Inner)


def test_flattens_and_builds_back() -> None:
    config = Outer(count=5, pose=(1.0, 2.0), inner=Inner(rate_hz=50.0))
    values = flatten_config(config)
    assert values == {
        'count': 5,
        'kind': 'a',
        'on': True,
        'pose': (1.0, 2.0),
        'inner.rate_hz': 50.0,
    }
    assert build_config(Outer, values) == config


def test_missing_values_keep_their_defaults_and_whole_numbers_serve_as_floats() -> None:
    config = build_config(Outer, {'inner.rate_hz': 10, 'pose': [1, 2]})
    assert config == Outer(inner=Inner(rate_hz=10.0), pose=(1.0, 2.0))
    assert type(config.inner.rate_hz) is float


def test_knows_every_parameter_by_dotted_name() -> None:
    infos = parameter_infos(Outer)
    assert set(infos) == {'count', 'kind', 'on', 'pose', 'inner.rate_hz'}
    assert infos['inner.rate_hz'].maximum == 100.0


@pytest.mark.parametrize(
    ('values', 'line'),
    [
        ({'count': -1}, 'count = -1: must be a whole number >= 0'),
        ({'count': 1.5}, 'count = 1.5: must be a whole number >= 0'),
        ({'count': True}, 'count = True: must be a whole number >= 0'),
        ({'kind': 'c'}, "kind = 'c': must be one of a, b"),
        ({'on': 1}, 'on = 1: must be true or false'),
        ({'pose': (1.0,)}, 'pose = (1.0,): must be 2 numbers, each a number >= -9'),
        ({'pose': (1.0, float('nan'))}, 'pose = nan: must be 2 numbers, each a number >= -9'),
        ({'inner.rate_hz': 0.5}, 'inner.rate_hz = 0.5: must be a number in [1, 100]'),
        ({'inner.rate_hz': 'x'}, "inner.rate_hz = 'x': must be a number in [1, 100]"),
    ],
)
def test_refuses_by_name_value_and_range(values: dict[str, Any], line: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        build_config(Outer, values)
    assert str(caught.value) == line
