"""Camera image, poses in figures, and the memberships of the region state."""

from functools import lru_cache
import math
from typing import Final

from goalreach_dashboard.pose_history import PoseHistory
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_dashboard.views.svg import Elements, degrees, fragment, metres
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, region_name
from goalreach_msgs_py.values import Confidence, Pose2

_LEFT, _RIGHT = 8.0, 392.0
_CONFIDENCE: Final = {
    Confidence.OK: 'pose is certain',
    Confidence.UNCERTAIN: 'pose is uncertain',
    Confidence.STALE: 'pose is outdated',
}


def camera_view(picture: CameraPicture | None) -> Elements:
    """Return the camera image with the LEDs detected in this very image."""
    if picture is None:
        return {}
    seen = sum(landmark is not None for landmark in picture.landmarks)
    note = f'{seen} of {len(picture.landmarks)} LEDs'
    if not picture.landmarks:
        note = 'no detections received'
    width, height = str(picture.width_px), str(picture.height_px)
    return {
        'camera': {'viewBox': f'0 0 {width} {height}'},
        'image': {'href': picture.url, 'width': width, 'height': height},
        'detections': fragment('detections', picture.landmarks, picture.width_px),
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
        'sets-x': _sets(regions.x_knots_m, X_LABELS),
        'sets-y': _sets(regions.y_knots_m, Y_LABELS),
    }
    if now is None:
        return view
    view['values-x'] = _values('x', now.pose.x_m, now.mu_x, regions.x_knots_m)
    view['values-y'] = _values('y', now.pose.y_m, now.mu_y, regions.y_knots_m)
    view['region'] = {'text': f'in {region_name(now.region)}'}
    view['confidence'] = {'text': 'no state received' if lost else _CONFIDENCE[now.confidence]}
    return view


@lru_cache(maxsize=8)
def _sets(knots_m: tuple[float, ...], labels: tuple[str, ...]) -> dict[str, str]:
    return fragment('sets', [_abscissa(knot_m, knots_m) for knot_m in knots_m], knots_m, labels)


def _abscissa(value_m: float, knots_m: tuple[float, ...]) -> float:
    share = (value_m - knots_m[0]) / (knots_m[-1] - knots_m[0])
    return _LEFT + (_RIGHT - _LEFT) * min(1.0, max(0.0, share))


def _values(
    axis: str, value_m: float, mu: tuple[float, float, float], knots_m: tuple[float, ...]
) -> dict[str, str]:
    active = [(index, share) for index, share in enumerate(mu) if share > 0.0]
    return fragment('membership_values', axis, _abscissa(value_m, knots_m), active)
