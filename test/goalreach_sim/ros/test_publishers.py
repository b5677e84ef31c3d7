"""The markers of an arena, by hand."""

import math

import pytest

from goalreach_msgs_py.obstacles import Obstacle, obstacles_to_flat
from goalreach_msgs_py.regions import RegionMap
from goalreach_sim.ros.publishers import arena_markers
from goalreach_sim.simulator_config import SimulatorConfig


def test_markers_are_where_things_are() -> None:
    post = Obstacle(x_m=1.0, y_m=2.0, radius_m=0.2)
    box = Obstacle(x_m=3.0, y_m=4.0, length_m=1.0, width_m=0.4, heading_rad=1.0, height_m=0.8)
    obstacles = obstacles_to_flat([post, box])
    config = SimulatorConfig(arena_width_m=4.0, arena_length_m=6.0, obstacles=obstacles)
    x_knots_m, y_knots_m = (0.0, 1.0, 1.4, 2.6, 3.0, 4.0), (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)
    regions = RegionMap(x_knots_m=x_knots_m, y_knots_m=y_knots_m, forbidden=((2, 2),))
    markers = arena_markers(config, regions, 'one/').markers
    at = [(one.pose.position.x, one.pose.position.y, one.pose.position.z) for one in markers]
    size = [(one.scale.x, one.scale.y, one.scale.z) for one in markers]
    names = [*['walls'] * 4, 'goal', 'forbidden', 'regions', *['leds'] * 3, *['obstacles'] * 2]
    assert [one.ns for one in markers] == names
    assert at[:4] == [(2.0, -0.01, 0.25), (2.0, 6.01, 0.25), (-0.01, 3.0, 0.25), (4.01, 3.0, 0.25)]
    assert size[:4] == [(4.0, 0.02, 0.5)] * 2 + [(0.02, 6.0, 0.5)] * 2
    assert (*at[4], *size[4]) == pytest.approx((2.0, 0.75, 0.0, 1.6, 1.5, 0.002))
    assert (*at[5], *size[5]) == pytest.approx((3.4, 4.75, 0.0, 1.2, 2.5, 0.002))
    assert [[p.x, p.y] for p in markers[6].points[::3]] == [[1.2, 0.0], [2.8, 6.0], [0.0, 3.5]]
    assert [list(place) for place in at[7:10]] == config.landmark_array_m.tolist()
    assert at[10:] == [(1.0, 2.0, 0.3), (3.0, 4.0, 0.4)]
    assert size[7:] == [(0.06,) * 3] * 3 + [(0.4, 0.4, 0.6), (1.0, 0.4, 0.8)]
    turn = markers[-1].pose.orientation
    assert (turn.z, turn.w) == pytest.approx((math.sin(0.5), math.cos(0.5)))
