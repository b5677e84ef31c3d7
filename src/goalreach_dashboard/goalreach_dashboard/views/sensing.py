"""Camera image, poses in figures, and the memberships of the region state."""

from __future__ import annotations

from functools import lru_cache
import math
from typing import Final

from goalreach_dashboard.pose_history import PoseHistory
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_dashboard.views.svg import Elements, degrees, metres, polyline_points
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, region_name
from goalreach_msgs_py.values import Confidence, Pose2

_WINDOW_PX: Final = 20
"""Half-width of the drawn window: the smallest in which the localizer tracks an LED."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 8.0, 392.0, 20.0, 74.0
_HIGHEST_FIGURE: Final = _TOP + 15.0
"""Figures stay below the sets' upper edge, clear of the labels."""
_CONFIDENCE: Final = {
    Confidence.OK: 'pose is certain',
    Confidence.UNCERTAIN: 'pose is uncertain',
    Confidence.STALE: 'pose is outdated',
}


def camera_view(picture: CameraPicture | None) -> Elements:
    """Return the camera image with the LEDs detected in this very image."""
    if picture is None:
        return {}
    parts, half = [], _WINDOW_PX
    for number, seen in enumerate(picture.landmarks, start=1):
        if seen is None:
            continue
        label_x = min(max(seen.u_px, 36.0), picture.width_px - 36.0)
        label_y = max(seen.v_px - half - 8.0, 20.0)
        parts.append(
            f'<g data-testid="detection-{number}">'
            f'<rect x="{seen.u_px - half:.1f}" y="{seen.v_px - half:.1f}" '
            f'width="{2 * half}" height="{2 * half}"/>'
            f'<text x="{label_x:.1f}" y="{label_y:.1f}">LED {number}</text></g>'
        )
    note = f'{len(parts)} of {len(picture.landmarks)} LEDs'
    if not picture.landmarks:
        note = 'no detections received'
    width, height = str(picture.width_px), str(picture.height_px)
    return {
        'camera': {'viewBox': f'0 0 {width} {height}'},
        'image': {'href': picture.url, 'width': width, 'height': height},
        'detections': {'html': ''.join(parts)},
        'camera-note': {'text': note},
    }


def pose_view(poses: PoseHistory) -> Elements:
    """Return truth and estimate of one stamp, and odometry, in figures."""
    view = {
        **_pose('truth', 'truth-heading', poses.compared or poses.truth),
        **_pose('odometry', 'odometry-heading', poses.odometry),
    }
    if poses.estimate is not None:
        view |= _pose('estimate', 'estimate-heading-text', poses.estimate.pose)
        view['estimate-row'] = {'data-stamp': str(poses.estimate_ns)}
        sigma = [math.sqrt(max(0.0, poses.estimate.covariance[k, k])) for k in range(3)]
        view['sigma-x'] = {'text': metres(sigma[0])}
        view['sigma-y'] = {'text': metres(sigma[1])}
        view['sigma-heading'] = {'text': degrees(sigma[2])}
    if poses.error_m is not None and poses.error_rad is not None:
        view['error-position'] = {'text': metres(poses.error_m)}
        view['error-heading'] = {'text': degrees(poses.error_rad)}
    return view


def _pose(name: str, heading: str, pose: Pose2 | None) -> Elements:
    if pose is None:
        return {}
    return {
        f'{name}-x': {'text': metres(pose.x_m)},
        f'{name}-y': {'text': metres(pose.y_m)},
        heading: {'text': degrees(pose.heading_rad)},
    }


def membership_view(state: PageState, *, lost: bool = False) -> Elements:
    """Return the trapezoids of the paper's Fig. 5 with the present values on them.

    Args:
        state: The page's state.
        lost: Whether the region state is outdated.
    """
    regions, now = state.arena.regions, state.state
    view = {
        'sets-x': {'html': _sets(regions.x_knots_m, X_LABELS)},
        'sets-y': {'html': _sets(regions.y_knots_m, Y_LABELS)},
    }
    if now is None:
        return view
    view['values-x'] = {'html': _values('x', now.pose.x_m, now.mu_x, regions.x_knots_m)}
    view['values-y'] = {'html': _values('y', now.pose.y_m, now.mu_y, regions.y_knots_m)}
    view['region'] = {'text': f'in {region_name(now.region)}'}
    view['confidence'] = {'text': 'no state received' if lost else _CONFIDENCE[now.confidence]}
    return view


@lru_cache(maxsize=8)
def _sets(knots_m: tuple[float, ...], labels: tuple[str, ...]) -> str:
    x = [_abscissa(knot_m, knots_m) for knot_m in knots_m]
    shapes = (
        ((x[0], _TOP), (x[1], _TOP), (x[2], _BOTTOM)),
        ((x[1], _BOTTOM), (x[2], _TOP), (x[3], _TOP), (x[4], _BOTTOM)),
        ((x[3], _BOTTOM), (x[4], _TOP), (x[5], _TOP)),
    )
    centres = ((x[0] + x[1]) / 2, (x[2] + x[3]) / 2, (x[4] + x[5]) / 2)
    parts = [f'<path class="axis" d="M{_LEFT} {_BOTTOM}H{_RIGHT}"/>']
    for index, shape in enumerate(shapes):
        parts.append(f'<polyline class="set set-{index}" points="{polyline_points(shape)}"/>')
    for centre, label in zip(centres, labels, strict=True):
        parts.append(f'<text class="label" x="{centre:.1f}" y="13">{label}</text>')
    for knot_m, knot_x in zip(knots_m, x, strict=True):
        parts.append(f'<text class="knot" x="{knot_x:.1f}" y="88">{knot_m:.2f}</text>')
    return ''.join(parts)


def _abscissa(value_m: float, knots_m: tuple[float, ...]) -> float:
    share = (value_m - knots_m[0]) / (knots_m[-1] - knots_m[0])
    return _LEFT + (_RIGHT - _LEFT) * min(1.0, max(0.0, share))


def _values(
    axis: str, value_m: float, mu: tuple[float, float, float], knots_m: tuple[float, ...]
) -> str:
    """Return the present value, with its figures left and right where two sets share it."""
    x = _abscissa(value_m, knots_m)
    parts = [f'<path class="now" d="M{x:.1f} {_TOP - 4}V{_BOTTOM}"/>']
    active = [index for index, share in enumerate(mu) if share > 0.0]
    for index in active:
        right = index == active[-1] if len(active) > 1 else x < (_LEFT + _RIGHT) / 2
        side, anchor = (1, 'start') if right else (-1, 'end')
        y = _BOTTOM - (_BOTTOM - _TOP) * mu[index]
        text_y = min(max(y + 4, _HIGHEST_FIGURE), _BOTTOM - 3)
        parts.append(
            f'<circle class="mu set-{index}" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
            f'<text class="mu" data-testid="mu-{axis}-{index}" x="{x + 9 * side:.1f}" '
            f'y="{text_y:.1f}" text-anchor="{anchor}">{mu[index]:.2f}</text>'
        )
    return ''.join(parts)
