"""The arena's picture: the floor and its regions, the policy, the robot and its estimate."""

from __future__ import annotations

from functools import lru_cache
import math

from goalreach_dashboard.state import PageState
from goalreach_dashboard.views.svg import HIDDEN, VISIBLE, View, arrow, cm, rotate, translate
from goalreach_learning.blending import Vote
from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTION_HEADINGS_RAD
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS
from goalreach_msgs_py.values import Pose2, PoseEstimate

_ARROW_CM = 34.0
_ROSE_CM = 34.0


def policy_view(
    arena: Arena, policy: Policy | None, cast: tuple[Vote, ...]
) -> dict[str, dict[str, str]]:
    """Return arrows and roses.

    Args:
        arena: Where the regions are.
        policy: What is learned, or None.
        cast: The regions that vote now; their arrows are drawn stronger.
    """
    if policy is None:
        return {'cells': {'html': ''}, 'roses': {'html': ''}}
    total = sum(vote.weight for vote in cast)
    share = {vote.region: vote.weight / total for vote in cast} if total > 0 else {}
    parts = []
    for i in range(3):
        for j in range(3):
            action = policy.actions[i][j]
            if action is None:
                continue
            x0, y0, x1, y1 = arena.regions.bounds((i, j))
            x, y = cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)
            angle_rad = ACTION_HEADINGS_RAD[action]
            dx, dy = _ARROW_CM / 2 * math.cos(angle_rad), -_ARROW_CM / 2 * math.sin(angle_rad)
            weight = share.get((i, j), 0.0)
            name = 'arrow votes' if weight else 'arrow'
            style = f' style="stroke-width:{3.5 + 2.5 * weight:.1f}"'
            line = arrow(name, angle_rad, _ARROW_CM, style)
            parts.append(f'<g transform="translate({x - dx:.1f} {y - dy:.1f})">{line}</g>')
    return {'cells': {'html': ''.join(parts)}, 'roses': {'html': _roses(arena, policy)}}


@lru_cache(maxsize=4)
def _roses(arena: Arena, policy: Policy) -> str:
    """Return the Q-values of every region as eight spokes with their figures."""
    scale = max(1e-9, float(abs(policy.q).max()))
    parts = []
    for i in range(3):
        for j in range(3):
            if (i, j) == arena.regions.goal:
                continue
            x0, y0, x1, y1 = arena.regions.bounds((i, j))
            x, y = cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)
            spokes = [f'<g transform="translate({x:.1f} {y:.1f})"><circle r="{_ROSE_CM}"/>']
            for k, value in enumerate(policy.q[i, j].tolist()):
                angle_rad = ACTION_HEADINGS_RAD[k]
                reach = _ROSE_CM * abs(value) / scale
                name = 'plus' if value >= 0 else 'minus'
                end_x, end_y = reach * math.cos(angle_rad), -reach * math.sin(angle_rad)
                spokes.append(f'<line class="{name}" x2="{end_x:.1f}" y2="{end_y:.1f}"/>')
                label_x, label_y = 48 * math.cos(angle_rad), -45 * math.sin(angle_rad) + 3
                spokes.append(f'<text x="{label_x:.1f}" y="{label_y:.1f}">{value:.2f}</text>')
            parts.append(''.join(spokes) + '</g>')
    return ''.join(parts)


_SIGHT_CM = 130.0
_COMMANDED_CM = 62.0
_WALL_CM = 5.0
_CHI_95 = 2.4477
"""Radius of the ellipse that holds 95 % of a planar Gaussian, in standard deviations."""


def arena_view(
    state: PageState, cast: tuple[Vote, ...], heading_rad: float | None, *, lost: bool = False
) -> View:
    """Return the arena's elements.

    Args:
        state: What is known.
        cast: The regions that vote now.
        heading_rad: The heading they add up to, or None.
        lost: Whether the estimate is old.
    """
    arena, robot = state.arena, state.robot
    view = {
        **_floor(arena),
        **policy_view(arena, state.policy, cast),
        'trail': {'points': robot.trail.text},
        'estimate-trail': {'points': robot.estimate_trail.text},
        **_robot(state),
        **_estimate(robot.estimate, arena.length_m, lost=lost),
        'odometry': _ghost(robot.odometry, arena.length_m),
        'commanded': dict(HIDDEN),
    }
    if lost:
        view['sight-lines'] = {'html': ''}
    if heading_rad is not None and robot.estimate is not None:
        pose = robot.estimate.pose
        x, y = cm(pose.x_m, pose.y_m, arena.length_m)
        view['commanded'] = VISIBLE | {
            'x1': f'{x:.1f}',
            'y1': f'{y:.1f}',
            'x2': f'{x + _COMMANDED_CM * math.cos(heading_rad):.1f}',
            'y2': f'{y - _COMMANDED_CM * math.sin(heading_rad):.1f}',
        }
    return view


@lru_cache(maxsize=4)
def _floor(arena: Arena) -> dict[str, dict[str, str]]:
    """Return what does not move: floor, transition areas, borders, names, walls, LEDs."""
    width, length = 100.0 * arena.width_m, 100.0 * arena.length_m
    parts = [f'<rect class="floor" width="{width:.1f}" height="{length:.1f}"/>']
    x0, y0, x1, y1 = arena.regions.bounds(arena.regions.goal)
    left, top = cm(x0, y1, arena.length_m)
    parts.append(
        f'<rect class="goal" data-testid="goal" x="{left:.1f}" y="{top:.1f}" '
        f'width="{100 * (x1 - x0):.1f}" height="{100 * (y1 - y0):.1f}"/>'
    )
    parts += _transition_areas(arena)
    for x_m in arena.regions.x_borders_m[1:3]:
        parts.append(f'<path class="border" d="M{100 * x_m:.1f} 0V{length:.1f}"/>')
    for y_m in arena.regions.y_borders_m[1:3]:
        parts.append(f'<path class="border" d="M0 {length - 100 * y_m:.1f}H{width:.1f}"/>')
    parts += _names(arena)
    half = _WALL_CM / 2
    parts.append(
        f'<rect class="wall" x="{-half}" y="{-half}" width="{width + _WALL_CM:.1f}" '
        f'height="{length + _WALL_CM:.1f}"/><path class="goal-wall" '
        f'd="M{-_WALL_CM} {length + half:.1f}H{width + _WALL_CM:.1f}"/>'
    )
    leds = []
    for number, (x_m, y_m, z_m) in enumerate(arena.landmarks_m, start=1):
        x, y = cm(x_m, y_m, arena.length_m)
        leds.append(
            f'<g class="led" data-testid="led-{number}" transform="translate({x:.1f} {y:.1f})">'
            f'<path d="M0 -6 6 0 0 6 -6 0z"/><text y="19">LED {number}</text>'
            f'<title>LED {number}, {z_m:.2f} m high</title></g>'
        )
    box = f'-12 -12 {width + 24:.0f} {length + 38:.0f}'
    return {
        'arena': {'viewBox': box},
        'floor': {'html': ''.join(parts)},
        'leds': {'html': ''.join(leds)},
    }


def _transition_areas(arena: Arena) -> list[str]:
    width, length = 100.0 * arena.width_m, 100.0 * arena.length_m
    parts = []
    for low, high in ((1, 2), (3, 4)):
        xs, ys = arena.regions.x_knots_m, arena.regions.y_knots_m
        parts.append(
            f'<rect class="fade" x="{100 * xs[low]:.1f}" y="0" '
            f'width="{100 * (xs[high] - xs[low]):.1f}" height="{length:.1f}"/>'
            f'<rect class="fade" x="0" y="{length - 100 * ys[high]:.1f}" '
            f'width="{width:.1f}" height="{100 * (ys[high] - ys[low]):.1f}"/>'
        )
    return parts


def _names(arena: Arena) -> list[str]:
    parts = []
    for i, x_label in enumerate(X_LABELS):
        for j, y_label in enumerate(Y_LABELS):
            x0, _, _, y1 = arena.regions.bounds((i, j))
            x, y = cm(x0, y1, arena.length_m)
            goal = ' · GOAL' if (i, j) == arena.regions.goal else ''
            parts.append(
                f'<text class="region" x="{x + 6:.1f}" y="{y + 13:.1f}">{x_label}</text>'
                f'<text class="region" x="{x + 6:.1f}" y="{y + 24:.1f}">{y_label}{goal}</text>'
            )
    return parts


def _robot(state: PageState) -> dict[str, dict[str, str]]:
    robot, length_m = state.robot, state.arena.length_m
    hidden = {'camera-view': dict(HIDDEN), 'sight-lines': {'html': ''}}
    pose = robot.truth
    if pose is None:
        return {'robot': dict(HIDDEN), **hidden}
    moved = translate(pose.x_m, pose.y_m, length_m)
    view: dict[str, dict[str, str]] = {
        'robot': VISIBLE | {'transform': moved},
        'drive-heading': {'transform': rotate(pose.heading_rad)},
        'bumpers': {'html': _bumpers(robot.bumpers)},
        **hidden,
    }
    if robot.head is None:
        return view | {'turret': dict(HIDDEN)}
    azimuth_rad = camera_azimuth(pose.heading_rad, robot.head)
    half_rad = state.fov_rad / 2
    corners = [
        (_SIGHT_CM * math.cos(a), -_SIGHT_CM * math.sin(a))
        for a in (azimuth_rad - half_rad, azimuth_rad + half_rad)
    ]
    (x0, y0), (x1, y1) = corners
    path = f'M0 0L{x0:.1f} {y0:.1f}A{_SIGHT_CM} {_SIGHT_CM} 0 0 0 {x1:.1f} {y1:.1f}z'
    view['camera-view'] = VISIBLE | {'d': path, 'transform': moved}
    view['turret'] = VISIBLE | {'transform': rotate(azimuth_rad)}
    view['sight-lines'] = {'html': _sight_lines(state, pose)}
    return view


def _sight_lines(state: PageState, pose: Pose2) -> str:
    length_m = state.arena.length_m
    x0, y0 = cm(pose.x_m, pose.y_m, length_m)
    parts = []
    for led, seen in zip(state.arena.landmarks_m, state.landmarks, strict=False):
        if seen is not None:
            x1, y1 = cm(led[0], led[1], length_m)
            parts.append(f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>')
    return ''.join(parts)


def _bumpers(pressed: tuple[bool, ...]) -> str:
    radius, half_rad = 100.0 * BODY_RADIUS_M + 3.0, math.radians(9.0)
    parts = []
    for index, on in enumerate(pressed):
        if on:
            low, high = (math.radians(18.0 * index) + side * half_rad for side in (-1, 1))
            parts.append(
                f'<path d="M{radius * math.cos(low):.1f} {-radius * math.sin(low):.1f}'
                f'A{radius} {radius} 0 0 0 '
                f'{radius * math.cos(high):.1f} {-radius * math.sin(high):.1f}"/>'
            )
    return ''.join(parts)


def _estimate(
    estimate: PoseEstimate | None, length_m: float, *, lost: bool
) -> dict[str, dict[str, str]]:
    if estimate is None:
        return {'estimate': dict(HIDDEN)}
    pose, covariance = estimate.pose, estimate.covariance
    vxx, vxy, vyy = (float(covariance[i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    mean, half = (vxx + vyy) / 2, math.hypot((vxx - vyy) / 2, vxy)
    axes = [100.0 * _CHI_95 * math.sqrt(max(0.0, mean + sign * half)) for sign in (1, -1)]
    return {
        'estimate': VISIBLE
        | {
            'transform': translate(pose.x_m, pose.y_m, length_m),
            'class': 'estimate old' if lost else 'estimate',
        },
        'ellipse': {
            'rx': f'{axes[0]:.1f}',
            'ry': f'{axes[1]:.1f}',
            'transform': rotate(math.atan2(2 * vxy, vxx - vyy) / 2),
        },
        'estimate-heading': {'transform': rotate(pose.heading_rad)},
    }


def _ghost(pose: Pose2 | None, length_m: float) -> dict[str, str]:
    if pose is None:
        return dict(HIDDEN)
    moved = translate(pose.x_m, pose.y_m, length_m)
    return VISIBLE | {'transform': f'{moved} {rotate(pose.heading_rad)}'}
