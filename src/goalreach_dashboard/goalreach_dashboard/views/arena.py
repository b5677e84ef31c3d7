"""The arena's picture: the floor and its regions, the policy, the robot and its estimate."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
import math
from typing import Final

from goalreach_dashboard.state import PageState
from goalreach_dashboard.views.svg import (
    HIDDEN,
    VISIBLE,
    Elements,
    arrow,
    cm,
    polar,
    rotate,
    translate,
)
from goalreach_learning.blending import Vote
from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTION_HEADINGS_RAD
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS
from goalreach_msgs_py.values import Pose2, PoseEstimate

_ARROW_CM: Final = 34.0
_CHART_CM: Final = 34.0
_CHART_LABEL_CM: Final = (48.0, 45.0)
_VIEW_CM: Final = 130.0
_COMMAND_CM: Final = 62.0
_WALL_CM: Final = 5.0
_BUMPER_CM: Final = 100.0 * BODY_RADIUS_M + 3.0
_BUMPER_RAD: Final = math.radians(18.0)
_CHI_95: Final = 2.4477
"""Radius of the ellipse that holds 95 % of a planar Gaussian, in standard deviations."""


def arena_view(
    state: PageState, votes: tuple[Vote, ...], heading_rad: float | None, *, lost: bool = False
) -> Elements:
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
        'cells': {'html': ''},
        'q-charts': {'html': ''},
        'trail': {'points': poses.trail.text},
        'estimate-trail': {'points': poses.estimate_trail.text},
        **_robot(state),
        **_estimate(poses.estimate, arena.length_m, lost=lost),
        'odometry': dict(HIDDEN),
        'commanded': dict(HIDDEN),
    }
    if state.policy is not None:
        view['cells'] = {'html': _policy_arrows(arena, state.policy, votes)}
        view['q-charts'] = {'html': _q_charts(arena, state.policy)}
    if poses.odometry is not None:
        moved = translate(poses.odometry.x_m, poses.odometry.y_m, arena.length_m)
        rotated = rotate(poses.odometry.heading_rad)
        view['odometry'] = VISIBLE | {'transform': f'{moved} {rotated}'}
    if lost:
        view['sight-lines'] = {'html': ''}
    if heading_rad is not None and poses.estimate is not None:
        pose = poses.estimate.pose
        x, y = cm(pose.x_m, pose.y_m, arena.length_m)
        dx, dy = polar(_COMMAND_CM, heading_rad)
        ends = {'x1': x, 'y1': y, 'x2': x + dx, 'y2': y + dy}
        view['commanded'] = VISIBLE | {name: f'{value:.1f}' for name, value in ends.items()}
    return view


def _cells(arena: Arena) -> Iterator[tuple[tuple[int, int], float, float]]:
    """Yield each region with its centre in the picture."""
    for i in range(len(X_LABELS)):
        for j in range(len(Y_LABELS)):
            x0, y0, x1, y1 = arena.regions.bounds((i, j))
            yield (i, j), *cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)


def _policy_arrows(arena: Arena, policy: Policy, votes: tuple[Vote, ...]) -> str:
    total = sum(vote.weight for vote in votes)
    shares = {vote.region: vote.weight / total for vote in votes} if total > 0 else {}
    parts = []
    for (i, j), x, y in _cells(arena):
        action = policy.actions[i][j]
        if action is None:
            continue
        angle_rad = ACTION_HEADINGS_RAD[action]
        dx, dy = polar(_ARROW_CM / 2, angle_rad)
        share = shares.get((i, j), 0.0)
        style = f' style="stroke-width:{3.5 + 2.5 * share:.1f}"'
        line = arrow('arrow votes' if share else 'arrow', angle_rad, _ARROW_CM, style)
        parts.append(f'<g transform="translate({x - dx:.1f} {y - dy:.1f})">{line}</g>')
    return ''.join(parts)


@lru_cache(maxsize=4)
def _q_charts(arena: Arena, policy: Policy) -> str:
    """Return the Q-values of every region as eight labelled spokes."""
    scale = max(1e-9, float(abs(policy.q).max()))
    label_x_cm, label_y_cm = _CHART_LABEL_CM
    parts = []
    for region, x, y in _cells(arena):
        if region == arena.regions.goal:
            continue
        parts.append(f'<g transform="translate({x:.1f} {y:.1f})"><circle r="{_CHART_CM}"/>')
        for angle_rad, value in zip(ACTION_HEADINGS_RAD, policy.q[region].tolist(), strict=True):
            css_class = 'plus' if value >= 0 else 'minus'
            x2, y2 = polar(_CHART_CM * abs(value) / scale, angle_rad)
            parts.append(f'<line class="{css_class}" x2="{x2:.1f}" y2="{y2:.1f}"/>')
            label_x, label_y = polar(label_x_cm, angle_rad)[0], polar(label_y_cm, angle_rad)[1]
            parts.append(f'<text x="{label_x:.1f}" y="{label_y + 3:.1f}">{value:.2f}</text>')
        parts.append('</g>')
    return ''.join(parts)


@lru_cache(maxsize=4)
def _floor(arena: Arena) -> Elements:
    """Return what does not move: floor, transition areas, borders, names, walls, LEDs."""
    width, length, half = 100.0 * arena.width_m, 100.0 * arena.length_m, _WALL_CM / 2
    x0, y0, x1, y1 = arena.regions.bounds(arena.regions.goal)
    left, top = cm(x0, y1, arena.length_m)
    regions = arena.regions
    borders = [f'M{100 * x_m:.1f} 0V{length:.1f}' for x_m in regions.x_borders_m[1:3]]
    borders += [f'M0 {length - 100 * y_m:.1f}H{width:.1f}' for y_m in regions.y_borders_m[1:3]]
    wall = f'M{-_WALL_CM} {length + half:.1f}H{width + _WALL_CM:.1f}'
    parts = [
        _rect('floor', (0.0, 0.0, width, length)),
        _rect('goal', (left, top, 100 * (x1 - x0), 100 * (y1 - y0)), ' data-testid="goal"'),
        *_transition_areas(arena),
        *(f'<path class="border" d="{border}"/>' for border in borders),
        *_region_names(arena),
        _rect('wall', (-half, -half, width + _WALL_CM, length + _WALL_CM)),
        f'<path class="goal-wall" d="{wall}"/>',
    ]
    return {
        'arena': {'viewBox': f'-12 -12 {width + 24:.0f} {length + 38:.0f}'},
        'floor': {'html': ''.join(parts)},
        'leds': {'html': ''.join(_leds(arena))},
    }


def _rect(css_class: str, box: tuple[float, float, float, float], more: str = '') -> str:
    x, y, width, height = box
    place = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
    return f'<rect class="{css_class}"{more} {place}/>'


def _transition_areas(arena: Arena) -> Iterator[str]:
    width, length = 100.0 * arena.width_m, 100.0 * arena.length_m
    xs, ys = arena.regions.x_knots_m, arena.regions.y_knots_m
    for low, high in ((1, 2), (3, 4)):
        yield _rect('fade', (100 * xs[low], 0.0, 100 * (xs[high] - xs[low]), length))
        yield _rect('fade', (0.0, length - 100 * ys[high], width, 100 * (ys[high] - ys[low])))


def _region_names(arena: Arena) -> Iterator[str]:
    for (i, j), _, _ in _cells(arena):
        x0, _, _, y1 = arena.regions.bounds((i, j))
        x, y = cm(x0, y1, arena.length_m)
        goal = ' · GOAL' if (i, j) == arena.regions.goal else ''
        for name, dy in ((X_LABELS[i], 13), (f'{Y_LABELS[j]}{goal}', 24)):
            yield f'<text class="region" x="{x + 6:.1f}" y="{y + dy:.1f}">{name}</text>'


def _leds(arena: Arena) -> Iterator[str]:
    for number, (x_m, y_m, z_m) in enumerate(arena.landmarks_m, start=1):
        moved = translate(x_m, y_m, arena.length_m)
        yield (
            f'<g class="led" data-testid="led-{number}" transform="{moved}">'
            f'<path d="M0 -6 6 0 0 6 -6 0z"/><text y="19">LED {number}</text>'
            f'<title>LED {number}, {z_m:.2f} m high</title></g>'
        )


def _robot(state: PageState) -> Elements:
    pose = state.poses.truth
    view: Elements = {'camera-view': dict(HIDDEN), 'sight-lines': {'html': ''}}
    if pose is None:
        return view | {'robot': dict(HIDDEN)}
    moved = translate(pose.x_m, pose.y_m, state.arena.length_m)
    view['robot'] = VISIBLE | {'transform': moved}
    view['drive-heading'] = {'transform': rotate(pose.heading_rad)}
    view['bumpers'] = {'html': _bumpers(state.bumpers)}
    if state.head is None:
        return view | {'turret': dict(HIDDEN)}
    azimuth_rad = camera_azimuth(pose.heading_rad, state.head)
    path = _sector(_VIEW_CM, azimuth_rad, state.fov_rad)
    view['camera-view'] = VISIBLE | {'d': f'M0 0L{path}z', 'transform': moved}
    view['turret'] = VISIBLE | {'transform': rotate(azimuth_rad)}
    view['sight-lines'] = {'html': _sight_lines(state, pose)}
    return view


def _sector(radius: float, centre_rad: float, width_rad: float) -> str:
    """Return an arc about the origin, from its start clockwise of the centre, as path data."""
    (x0, y0), (x1, y1) = (polar(radius, centre_rad + side * width_rad / 2) for side in (-1, 1))
    return f'{x0:.1f} {y0:.1f}A{radius:.1f} {radius:.1f} 0 0 0 {x1:.1f} {y1:.1f}'


def _bumpers(pressed: tuple[bool, ...]) -> str:
    numbers = [number for number, on in enumerate(pressed) if on]
    arcs = [_sector(_BUMPER_CM, _BUMPER_RAD * number, _BUMPER_RAD) for number in numbers]
    return ''.join(f'<path d="M{arc}"/>' for arc in arcs)


def _sight_lines(state: PageState, pose: Pose2) -> str:
    length_m = state.arena.length_m
    x0, y0 = cm(pose.x_m, pose.y_m, length_m)
    parts = []
    for led, seen in zip(state.arena.landmarks_m, state.landmarks, strict=False):
        if seen is not None:
            x1, y1 = cm(led[0], led[1], length_m)
            parts.append(f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>')
    return ''.join(parts)


def _estimate(estimate: PoseEstimate | None, length_m: float, *, lost: bool) -> Elements:
    if estimate is None:
        return {'estimate': dict(HIDDEN)}
    pose, covariance = estimate.pose, estimate.covariance
    vxx, vxy, vyy = (float(covariance[i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    mean, half = (vxx + vyy) / 2, math.hypot((vxx - vyy) / 2, vxy)
    rx, ry = (100.0 * _CHI_95 * math.sqrt(max(0.0, mean + sign * half)) for sign in (1, -1))
    moved = translate(pose.x_m, pose.y_m, length_m)
    rotated = rotate(math.atan2(2 * vxy, vxx - vyy) / 2)
    css_class = 'estimate old' if lost else 'estimate'
    return {
        'estimate': VISIBLE | {'transform': moved, 'class': css_class},
        'ellipse': {'rx': f'{rx:.1f}', 'ry': f'{ry:.1f}', 'transform': rotated},
        'estimate-heading': {'transform': rotate(pose.heading_rad)},
    }
