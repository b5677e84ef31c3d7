"""The arena as visualization_msgs/MarkerArray for RViz and Foxglove."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.ros.messaging import header
from goalreach_msgs_py.topics import MAP_FRAME
from goalreach_sim.simulator_config import SimulatorConfig

_WALL_HEIGHT_M = 0.5
_WALL_THICKNESS_M = 0.02
_LED_DIAMETER_M = 0.06
_LINE_WIDTH_M = 0.015
_GREY = ColorRGBA(r=0.55, g=0.55, b=0.55, a=1.0)
_RED = ColorRGBA(r=0.84, g=0.37, b=0.0, a=1.0)
_BLUE = ColorRGBA(r=0.0, g=0.45, b=0.70, a=0.8)
_GREEN = ColorRGBA(r=0.0, g=0.62, b=0.45, a=0.25)


def arena_markers(config: SimulatorConfig, regions: RegionMap) -> MarkerArray:
    """Return walls, LEDs, region borders and the goal region as markers in `map`."""
    width_m, length_m = config.arena_width_m, config.arena_length_m
    half_m = _WALL_THICKNESS_M / 2
    walls = (
        (width_m / 2, -half_m, width_m, _WALL_THICKNESS_M),
        (width_m / 2, length_m + half_m, width_m, _WALL_THICKNESS_M),
        (-half_m, length_m / 2, _WALL_THICKNESS_M, length_m),
        (width_m + half_m, length_m / 2, _WALL_THICKNESS_M, length_m),
    )
    markers = [
        _box('walls', index, (x, y, _WALL_HEIGHT_M / 2), (dx, dy, _WALL_HEIGHT_M), _GREY)
        for index, (x, y, dx, dy) in enumerate(walls)
    ]
    x0, y0, x1, y1 = regions.bounds(regions.goal)
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, 0.0)
    markers.append(_box('goal', 0, centre, (x1 - x0, y1 - y0, 0.002), _GREEN))
    markers.append(_borders(regions, width_m, length_m))
    size = (_LED_DIAMETER_M,) * 3
    leds = config.landmarks_m
    for index in range(len(leds) // 3):
        x, y, z = leds[3 * index : 3 * index + 3]
        markers.append(_box('leds', index, (x, y, z), size, _RED, shape=Marker.SPHERE))
    return MarkerArray(markers=markers)


def _box(
    namespace: str,
    index: int,
    centre: tuple[float, float, float],
    size: tuple[float, ...],
    color: ColorRGBA,
    *,
    shape: int = Marker.CUBE,
) -> Marker:
    marker = _marker(namespace, index, shape, color)
    marker.pose.position = Point(x=centre[0], y=centre[1], z=centre[2])
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def _borders(regions: RegionMap, width_m: float, length_m: float) -> Marker:
    marker = _marker('regions', 0, Marker.LINE_LIST, _BLUE)
    marker.scale.x = _LINE_WIDTH_M
    for x in regions.x_borders_m[1:3]:
        marker.points += [Point(x=x, y=0.0), Point(x=x, y=length_m)]
    for y in regions.y_borders_m[1:3]:
        marker.points += [Point(x=0.0, y=y), Point(x=width_m, y=y)]
    return marker


def _marker(namespace: str, index: int, shape: int, color: ColorRGBA) -> Marker:
    marker = Marker(header=header(0, MAP_FRAME), ns=namespace, id=index, type=shape, color=color)
    marker.header.stamp = Time()
    marker.pose.orientation.w = 1.0
    return marker
