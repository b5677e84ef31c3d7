"""What the robot senses and believes: camera image, poses in figures, memberships."""

from __future__ import annotations

from functools import lru_cache
import math

from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_dashboard.views.svg import View, degrees, lines, metres
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, region_name
from goalreach_msgs_py.values import Confidence, Pose2

_WINDOW_PX = 20
"""Half-width of the drawn window: the smallest in which the localizer tracks an LED."""

_LEFT, _RIGHT, _TOP, _FLOOR = 8.0, 392.0, 20.0, 74.0
_BELOW = _TOP + 15.0
"""Figures stand below the sets' upper edge, clear of their names."""

_WORDS = {
    Confidence.OK: 'sure of its place',
    Confidence.UNCERTAIN: 'not sure of its place',
    Confidence.STALE: 'its pose is old',
}


def camera_view(picture: CameraPicture | None) -> View:
    """Return the camera image with the LEDs detected in this very image."""
    if picture is None:
        return {}
    parts = []
    for number, seen in enumerate(picture.landmarks, start=1):
        if seen is None:
            continue
        half = _WINDOW_PX
        parts.append(
            f'<g data-testid="detection-{number}">'
            f'<rect x="{seen.u_px - half:.1f}" y="{seen.v_px - half:.1f}" '
            f'width="{2 * half}" height="{2 * half}"/>'
            f'<text x="{min(max(seen.u_px, 36.0), picture.width_px - 36.0):.1f}" '
            f'y="{max(seen.v_px - half - 8.0, 20.0):.1f}">LED {number}</text></g>'
        )
    seen_count = sum(seen is not None for seen in picture.landmarks)
    note = f'{seen_count} of {len(picture.landmarks)} LEDs'
    if not picture.landmarks:
        note = 'no detections are heard'
    width, height = str(picture.width_px), str(picture.height_px)
    return {
        'camera': {'viewBox': f'0 0 {width} {height}'},
        'image': {'href': picture.url, 'width': width, 'height': height},
        'detections': {'html': ''.join(parts)},
        'camera-note': {'text': note},
    }


def pose_view(state: PageState) -> View:
    """Return truth and estimate of one stamp, and odometry, in figures."""
    robot = state.robot
    view = {
        **_pose('truth', 'truth-heading', robot.compared or robot.truth),
        **_pose('odometry', 'odometry-heading', robot.odometry),
    }
    if robot.estimate is not None:
        view |= _pose('estimate', 'estimate-heading-text', robot.estimate.pose)
        view['estimate-row'] = {'data-stamp': str(robot.estimate_ns)}
        sigma = [math.sqrt(max(0.0, robot.estimate.covariance[k, k])) for k in range(3)]
        view['sigma-x'] = {'text': metres(sigma[0])}
        view['sigma-y'] = {'text': metres(sigma[1])}
        view['sigma-heading'] = {'text': degrees(sigma[2])}
    if robot.error_m is not None and robot.error_rad is not None:
        view['error-position'] = {'text': metres(robot.error_m)}
        view['error-heading'] = {'text': degrees(robot.error_rad)}
    return view


def _pose(name: str, heading: str, pose: Pose2 | None) -> dict[str, dict[str, str]]:
    if pose is None:
        return {}
    return {
        f'{name}-x': {'text': metres(pose.x_m)},
        f'{name}-y': {'text': metres(pose.y_m)},
        heading: {'text': degrees(pose.heading_rad)},
    }


def membership_view(state: PageState, *, lost: bool = False) -> View:
    """Return the trapezoids of the paper's Fig. 5 with the present values on them.

    Args:
        state: What is known.
        lost: Whether the state is old.
    """
    regions = state.arena.regions
    view = {
        'sets-x': {'html': _sets(regions.x_knots_m, X_LABELS)},
        'sets-y': {'html': _sets(regions.y_knots_m, Y_LABELS)},
    }
    now = state.state
    if now is None:
        return view
    view['values-x'] = {'html': _values('x', now.pose.x_m, now.mu_x, regions.x_knots_m)}
    view['values-y'] = {'html': _values('y', now.pose.y_m, now.mu_y, regions.y_knots_m)}
    view['region'] = {'text': f'in {region_name(now.region)}'}
    view['confidence'] = {'text': 'no state is heard' if lost else _WORDS[now.confidence]}
    return view


@lru_cache(maxsize=8)
def _sets(knots_m: tuple[float, ...], labels: tuple[str, ...]) -> str:
    x = [_place(knot_m, knots_m) for knot_m in knots_m]
    shapes = (
        ((x[0], _TOP), (x[1], _TOP), (x[2], _FLOOR)),
        ((x[1], _FLOOR), (x[2], _TOP), (x[3], _TOP), (x[4], _FLOOR)),
        ((x[3], _FLOOR), (x[4], _TOP), (x[5], _TOP)),
    )
    centres = ((x[0] + x[1]) / 2, (x[2] + x[3]) / 2, (x[4] + x[5]) / 2)
    parts = [f'<path class="axis" d="M{_LEFT} {_FLOOR}H{_RIGHT}"/>']
    for index, shape in enumerate(shapes):
        parts.append(f'<polyline class="set set-{index}" points="{lines(shape)}"/>')
    for centre, label in zip(centres, labels, strict=True):
        parts.append(f'<text class="label" x="{centre:.1f}" y="13">{label}</text>')
    for knot_m, place in zip(knots_m, x, strict=True):
        parts.append(f'<text class="knot" x="{place:.1f}" y="88">{knot_m:.2f}</text>')
    return ''.join(parts)


def _place(value_m: float, knots_m: tuple[float, ...]) -> float:
    share = (value_m - knots_m[0]) / (knots_m[-1] - knots_m[0])
    return _LEFT + (_RIGHT - _LEFT) * min(1.0, max(0.0, share))


def _values(
    axis: str, value_m: float, mu: tuple[float, float, float], knots_m: tuple[float, ...]
) -> str:
    x = _place(value_m, knots_m)
    parts = [f'<path class="now" d="M{x:.1f} {_TOP - 4}V{_FLOOR}"/>']
    middle = (_LEFT + _RIGHT) / 2
    voices = [index for index, share in enumerate(mu) if share > 0.0]
    for index in voices:
        share = mu[index]
        right = index == voices[-1] if len(voices) > 1 else x < middle
        side, anchor = (1, 'start') if right else (-1, 'end')
        y = _FLOOR - (_FLOOR - _TOP) * share
        below = min(max(y + 4, _BELOW), _FLOOR - 3)
        parts.append(
            f'<circle class="mu set-{index}" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
            f'<text class="mu" data-testid="mu-{axis}-{index}" x="{x + 9 * side:.1f}" '
            f'y="{below:.1f}" text-anchor="{anchor}">{share:.2f}</text>'
        )
    return ''.join(parts)
