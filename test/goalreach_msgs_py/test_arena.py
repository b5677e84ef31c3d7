"""The arena as one checked value."""

from dataclasses import replace
import math

import pytest

from goalreach_msgs_py.arena import ARENA_PARAMETERS, BODY_RADIUS_M, Arena, paper_starts
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.tags import Tag
from goalreach_msgs_py.values import Pose2


def test_the_paper_has_22_starts_at_the_borders() -> None:
    arena = Arena()
    assert len(set(arena.starts)) == 22
    for start in arena.starts:
        to_wall = min(start.x_m, start.y_m, arena.width_m - start.x_m, arena.length_m - start.y_m)
        assert to_wall == pytest.approx(BODY_RADIUS_M + 0.1, abs=1e-3)
        assert arena.regions.region_at(start.x_m, start.y_m) != arena.regions.goal


def test_starts_are_mirror_images_left_and_right() -> None:
    arena = Arena()
    mirrored = {(round(arena.width_m - s.x_m, 2), round(s.y_m, 2)) for s in arena.starts}
    for x, y in mirrored:
        assert any(abs(s.x_m - x) < 0.02 and abs(s.y_m - y) < 0.02 for s in arena.starts)


def test_starts_fit_another_arena() -> None:
    regions = RegionMap(
        x_knots_m=(0.0, 2.0, 2.5, 4.0, 4.5, 6.0), y_knots_m=(0.0, 2.0, 2.5, 4.0, 4.5, 7.0)
    )
    starts = paper_starts(regions)
    arena = Arena(width_m=6.0, length_m=7.0, regions=regions, starts=starts)
    assert len(arena.starts) == 22


@pytest.mark.parametrize(
    ('change', 'field'),
    [
        ({'width_m': 0.5}, 'width_m'),
        ({'landmarks_m': ((1.0, 0.0, 1.4),)}, 'landmarks_m'),
        ({'landmarks_m': ((1.0, 0.0, 1.4),) * 2 + ((9.0, 0.0, 1.4),)}, r'landmarks_m\[2\]'),
        ({'length_m': 6.0}, 'y_knots_m'),
        ({'starts': (Pose2(x_m=0.1, y_m=1.0, heading_rad=0.0),)}, r'starts\[0\]'),
    ],
)
def test_names_the_part_that_does_not_fit(change: dict[str, object], field: str) -> None:
    with pytest.raises(ConfigurationError, match=field):
        Arena(**change)  # type: ignore[arg-type]


PARAMETERS = {
    'arena_width_m': 3.556,
    'arena_length_m': 5.08,
    'landmarks_m': [0.889, 0.0, 1.4224, 1.8, 0.508, 1.8288, 2.667, 0.0, 1.6256],
    'leds': True,
    'tags': [3.0, 0.2, 1.0, 0.0, 1.3, 1.57],
    'tag_family': '36h11',
    'x_knots_m': list(Arena().regions.x_knots_m),
    'y_knots_m': list(Arena().regions.y_knots_m),
    'goal_region': 'FRONT/NEAR',
    'forbidden_regions': 'LEFT-SIDE/FAR',
    'labels': '',
    'obstacles': [1.0, 2.0, 0.0, 0.0, 0.2, 0.0, 0.6, 0.0, 0.0],
}


def test_the_parameters_of_a_robot_describe_its_arena() -> None:
    arena = Arena.from_parameters(PARAMETERS)
    assert set(PARAMETERS) == set(ARENA_PARAMETERS)
    assert (arena.width_m, arena.regions, arena.starts) == (
        3.556,
        replace(Arena().regions, forbidden=((0, 2),)),
        (),
    )
    assert arena.landmarks_m[1] == (1.8, 0.508, 1.8288)
    assert arena.tags == (Tag(id=3, size_m=0.2, x_m=1.0, y_m=0.0, z_m=1.3, facing_rad=1.57),)
    assert Arena.from_parameters({**PARAMETERS, 'leds': False}).landmarks_m == ()


def test_an_obstacle_at_infinity_is_refused() -> None:
    values = {**PARAMETERS, 'obstacles': [1.0, 2.0, 0.0, 0.0, 0.2, 0.0, 0.6, 0.0, math.inf]}
    with pytest.raises(ConfigurationError, match='arena'):
        Arena.from_parameters(values)


@pytest.mark.parametrize(
    ('name', 'value'),
    [('landmarks_m', [1.0, 0.0]), ('landmarks_m', None), ('goal_region', 'NOWHERE')],
)
def test_parameters_that_describe_no_arena_are_refused(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError):
        Arena.from_parameters({**PARAMETERS, name: value})
    with pytest.raises(ConfigurationError, match=name):
        Arena.from_parameters({key: PARAMETERS[key] for key in PARAMETERS if key != name})
