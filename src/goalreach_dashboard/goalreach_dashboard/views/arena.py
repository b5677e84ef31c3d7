"""The arena's picture: the floor and its regions, the policy, the robot and its estimate."""

from functools import lru_cache
import itertools
import math
from typing import Final

from goalreach_dashboard.state import PageState
from goalreach_dashboard.views import svg
from goalreach_learning.blending import Vote
from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTION_HEADINGS_RAD
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS
from goalreach_msgs_py.values import Pose2, PoseEstimate

_VIEW_CM: Final = 130.0
_COMMAND_CM: Final = 62.0
_BUMPER_CM: Final = 100.0 * BODY_RADIUS_M + 3.0
_BUMPER_RAD: Final = math.radians(18.0)
_CHI_95: Final = 2.4477
"""Radius of the ellipse that holds 95 % of a planar Gaussian, in standard deviations."""


def arena_view(
    state: PageState, votes: tuple[Vote, ...], heading_rad: float | None, *, lost: bool = False
) -> svg.Elements:
    """Return the elements of the arena's picture.

    Args:
        state: The page's state.
        votes: The present votes of the regions; their arrows are drawn stronger.
        heading_rad: The commanded heading, or None.
        lost: Whether the estimate is outdated.
    """
    arena, poses = state.arena, state.poses
    view = {
        **_floor(arena),
        **_policy(arena, state.policy, votes),
        'trail': {'points': poses.trail.text},
        'estimate-trail': {'points': poses.estimate_trail.text},
        **_robot(state),
        **_estimate(poses.estimate, arena.length_m, lost=lost),
        'odometry': dict(svg.HIDDEN),
        'commanded': dict(svg.HIDDEN),
    }
    if poses.odometry is not None:
        moved = svg.translate(poses.odometry.x_m, poses.odometry.y_m, arena.length_m)
        rotated = svg.rotate(poses.odometry.heading_rad)
        view['odometry'] = svg.VISIBLE | {'transform': f'{moved} {rotated}'}
    if lost:
        view['sight-lines'] = {'html': ''}
    if heading_rad is not None and poses.estimate is not None:
        pose = poses.estimate.pose
        x, y = svg.cm(pose.x_m, pose.y_m, arena.length_m)
        dx, dy = svg.polar(_COMMAND_CM, heading_rad)
        ends = {'x1': x, 'y1': y, 'x2': x + dx, 'y2': y + dy}
        view['commanded'] = svg.VISIBLE | {name: f'{value:.1f}' for name, value in ends.items()}
    return view


@lru_cache(maxsize=4)
def _cells(arena: Arena) -> list[tuple[tuple[int, int], float, float]]:
    """Return each region with its centre in the picture."""
    cells = []
    for region in itertools.product(range(3), range(3)):
        x0, y0, x1, y1 = arena.regions.bounds(region)
        cells.append((region, *svg.cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)))
    return cells


@lru_cache(maxsize=4)
def _floor(arena: Arena) -> svg.Elements:
    """Return what does not move: floor, transition areas, borders, names, walls, LEDs."""
    width, length = 100.0 * arena.width_m, 100.0 * arena.length_m
    return {
        'arena': {'viewBox': f'-12 -12 {width + 24:.0f} {length + 38:.0f}'},
        'floor': svg.fragment('floor', arena, _cells(arena), (X_LABELS, Y_LABELS)),
        'leds': svg.fragment('leds', arena),
    }


def _policy(arena: Arena, policy: Policy | None, votes: tuple[Vote, ...]) -> svg.Elements:
    if policy is None:
        return {'cells': {'html': ''}, 'q-charts': {'html': ''}}
    total = sum(vote.weight for vote in votes)
    shares = {vote.region: vote.weight / total for vote in votes} if total > 0 else {}
    arrows = svg.fragment('policy_arrows', _cells(arena), policy, shares, ACTION_HEADINGS_RAD)
    return {'cells': arrows, 'q-charts': _q_charts(arena, policy)}


@lru_cache(maxsize=4)
def _q_charts(arena: Arena, policy: Policy) -> dict[str, str]:
    """Return the Q-values of every region as eight labelled spokes."""
    goal, scale = arena.regions.goal, max(1e-9, float(abs(policy.q).max()))
    return svg.fragment('q_charts', _cells(arena), policy, goal, ACTION_HEADINGS_RAD, scale)


def _robot(state: PageState) -> svg.Elements:
    pose = state.poses.truth
    view: svg.Elements = {'camera-view': dict(svg.HIDDEN), 'sight-lines': {'html': ''}}
    if pose is None:
        return view | {'robot': dict(svg.HIDDEN)}
    moved = svg.translate(pose.x_m, pose.y_m, state.arena.length_m)
    numbers = [number for number, pressed in enumerate(state.bumpers) if pressed]
    arcs = [_arc(_BUMPER_CM, _BUMPER_RAD * number, _BUMPER_RAD) for number in numbers]
    view['robot'] = svg.VISIBLE | {'transform': moved}
    view['drive-heading'] = {'transform': svg.rotate(pose.heading_rad)}
    view['bumpers'] = svg.fragment('paths', [f'M{arc}' for arc in arcs])
    if state.head is None:
        return view | {'turret': dict(svg.HIDDEN)}
    azimuth_rad = camera_azimuth(pose.heading_rad, state.head)
    sector = f'M0 0L{_arc(_VIEW_CM, azimuth_rad, state.fov_rad)}z'
    view['camera-view'] = svg.VISIBLE | {'d': sector, 'transform': moved}
    view['turret'] = svg.VISIBLE | {'transform': svg.rotate(azimuth_rad)}
    view['sight-lines'] = svg.fragment('paths', _sight_lines(state, pose))
    return view


def _arc(radius: float, centre_rad: float, width_rad: float) -> str:
    """Return a counter-clockwise arc about the origin as path data, from its first point."""
    (x0, y0), (x1, y1) = (svg.polar(radius, centre_rad + side * width_rad / 2) for side in (-1, 1))
    return f'{x0:.1f} {y0:.1f}A{radius:.1f} {radius:.1f} 0 0 0 {x1:.1f} {y1:.1f}'


def _sight_lines(state: PageState, pose: Pose2) -> list[str]:
    length_m = state.arena.length_m
    x0, y0 = svg.cm(pose.x_m, pose.y_m, length_m)
    pairs = zip(state.arena.landmarks_m, state.landmarks, strict=False)
    ends = [svg.cm(led[0], led[1], length_m) for led, seen in pairs if seen is not None]
    return [f'M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}' for x1, y1 in ends]


def _estimate(estimate: PoseEstimate | None, length_m: float, *, lost: bool) -> svg.Elements:
    if estimate is None:
        return {'estimate': dict(svg.HIDDEN)}
    pose, covariance = estimate.pose, estimate.covariance
    vxx, vxy, vyy = (float(covariance[i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    mean, half = (vxx + vyy) / 2, math.hypot((vxx - vyy) / 2, vxy)
    rx, ry = (100.0 * _CHI_95 * math.sqrt(max(0.0, mean + sign * half)) for sign in (1, -1))
    moved = svg.translate(pose.x_m, pose.y_m, length_m)
    rotated = svg.rotate(math.atan2(2 * vxy, vxx - vyy) / 2)
    css_class = 'estimate old' if lost else 'estimate'
    return {
        'estimate': svg.VISIBLE | {'transform': moved, 'class': css_class},
        'ellipse': {'rx': f'{rx:.1f}', 'ry': f'{ry:.1f}', 'transform': rotated},
        'estimate-heading': {'transform': svg.rotate(pose.heading_rad)},
    }
