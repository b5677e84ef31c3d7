"""The region map."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import (
    X_LABELS,
    Y_LABELS,
    RegionConfig,
    RegionMap,
    parse_region,
    region_name,
)

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


@pytest.mark.parametrize(
    ('region', 'shape', 'name'),
    [
        ((1, 0), (3, 3), 'FRONT/NEAR'),
        ((4, 6), (5, 7), 'X5/Y7'),
        ((2, 1), (3, 2), 'RIGHT-SIDE/Y2'),
        ((0, 0), (1, 9), 'X1/Y1'),
    ],
)
def test_names_of_any_grid_are_read_again(
    region: tuple[int, int], shape: tuple[int, int], name: str
) -> None:
    assert region_name(region, shape) == name
    assert parse_region(name) == parse_region(name, shape) == region


def test_a_name_of_another_grid_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r'X1\|X2\|X3\|X4\|X5'):
        parse_region('FRONT/NEAR', (5, 3))


def test_regions_and_memberships_of_five_columns_and_one_row() -> None:
    regions = RegionMap(
        x_knots_m=(0.0, 0.9, 1.1, 1.9, 2.1, 2.9, 3.1, 3.9, 4.1, 5.0), y_knots_m=(0.0, 2.0),
        goal=(4, 0), actions=16,
    )  # fmt: skip
    assert regions.shape == (5, 1)
    assert regions.x_borders_m == pytest.approx((0.0, 1.0, 2.0, 3.0, 4.0, 5.0))
    assert [regions.region_at(x, 1.0)[0] for x in (-1.0, 0.5, 1.5, 3.5, 9.0)] == [0, 0, 1, 3, 4]
    mu_x, mu_y = regions.memberships_at(2.95, 1.0)
    assert mu_x == pytest.approx((0.0, 0.0, 0.75, 0.25, 0.0))
    assert mu_y == (1.0,)
    assert len(regions.cells) == 5


def test_crisp_and_fuzzy_agree_where_one_region_ends_and_the_next_begins() -> None:
    knots_m = (0.0, 1.0, 1.0, 2.0, 2.0, 3.0)
    regions = RegionMap(x_knots_m=knots_m, y_knots_m=knots_m)
    for x_m in (0.5, 1.0, 1.5, 2.0, 2.5):
        mu_x, _ = regions.memberships_at(x_m, 0.5)
        assert mu_x.index(1.0) == regions.region_at(x_m, 0.5)[0]


@pytest.mark.parametrize(
    'fields', [{'actions': 6}, {'actions': 8.0}, {'x_knots_m': (0.0, 1.0, 2.0)}, {'goal': (3, 0)}]
)
def test_an_impossible_task_is_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(fields))):
        RegionMap(**fields)


@pytest.mark.parametrize(
    ('fields', 'line'),
    [
        ({'forbidden_regions': 'LEFT-SIDE/FRA'}, "forbidden_regions = 'LEFT-SIDE/FRA'"),
        ({'goal_region': 'X7/NEAR'}, "goal_region = 'X7/NEAR'"),
        ({'forbidden_regions': 'FRONT/NEAR'}, "forbidden_regions = 'FRONT/NEAR'"),
    ],
)
def test_errors_name_the_parameter_and_its_text(fields: dict[str, str], line: str) -> None:
    with pytest.raises(ConfigurationError, match=line):
        RegionConfig(**fields)  # type: ignore[arg-type]


def test_a_list_of_regions_may_have_blanks() -> None:
    regions = RegionConfig(forbidden_regions='LEFT-SIDE/FAR, FRONT/FAR').region_map
    assert regions.forbidden == ((0, 2), (1, 2))
