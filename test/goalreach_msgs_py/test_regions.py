"""The region map."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, RegionMap, parse_region, region_name

MAP = RegionMap(x_knots_m=(0.0, 1.0, 2.0, 4.0, 5.0, 6.0), y_knots_m=(0.0, 2.0, 3.0, 5.0, 7.0, 9.0))


def test_borders_are_the_middles_of_the_transition_areas() -> None:
    assert MAP.x_borders_m == (0.0, 1.5, 4.5, 6.0)
    assert MAP.y_borders_m == (0.0, 2.5, 6.0, 9.0)


@pytest.mark.parametrize(
    ('point', 'name'),
    [
        ((3.0, 1.0), 'FRONT/NEAR'),
        ((0.5, 1.0), 'LEFT-SIDE/NEAR'),
        ((5.0, 8.0), 'RIGHT-SIDE/FAR'),
        ((1.5, 2.5), 'FRONT/MEDIUM'),
        ((-1.0, 99.0), 'LEFT-SIDE/FAR'),
    ],
)
def test_names_the_region_of_a_point(point: tuple[float, float], name: str) -> None:
    assert region_name(MAP.region_at(*point)) == name


@given(st.floats(0.0, 6.0, exclude_max=True), st.floats(0.0, 9.0, exclude_max=True))
def test_a_point_lies_in_the_bounds_of_its_region(x: float, y: float) -> None:
    x_min, y_min, x_max, y_max = MAP.bounds(MAP.region_at(x, y))
    assert x_min <= x < x_max
    assert y_min <= y < y_max


@pytest.mark.parametrize('i', range(3))
@pytest.mark.parametrize('j', range(3))
def test_names_are_read_back(i: int, j: int) -> None:
    assert parse_region(f'{X_LABELS[i]}/{Y_LABELS[j]}') == (i, j)


@pytest.mark.parametrize('name', ['', 'FRONT', 'NEAR/FRONT', 'FRONT/NEAR/FAR'])
def test_refuses_other_names(name: str) -> None:
    with pytest.raises(ConfigurationError, match='region'):
        parse_region(name)


@pytest.mark.parametrize(
    'knots',
    [
        (0.0, 1.0, 2.0, 3.0, 4.0),
        (0.0, 2.0, 1.0, 3.0, 4.0, 5.0),
        (0.0, 1.0, 2.0, 3.0, float('nan'), 5.0),
        (0.0, 0.0, 0.0, 3.0, 4.0, 5.0),
    ],
)
def test_refuses_knots_that_make_no_regions(knots: tuple[float, ...]) -> None:
    with pytest.raises(ConfigurationError, match='x_knots_m'):
        RegionMap(x_knots_m=knots)
