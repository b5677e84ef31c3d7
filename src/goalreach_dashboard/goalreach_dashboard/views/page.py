"""What the page shows, as JSON-ready values that its script draws; and their differences.

Lengths are metres, angles degrees in (-180, 180], counter-clockwise.
"""

from collections.abc import Mapping
from functools import lru_cache
from html import escape
import math
from typing import Any, Final

from goalreach_dashboard.health import NodeStatus
from goalreach_dashboard.state import TOPICS_OF, CameraPicture, PageState
from goalreach_learning.blending import MODES, Vote, blend, votes
from goalreach_learning.kinematic_drive import blended_track
from goalreach_learning.policy import Policy, action_headings_rad
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.diagnostic_messages import Status
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.noise import NOISE_PRESETS, noise_parameters
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, ROBOT
from goalreach_msgs_py.values import Confidence, Pose2, PoseEstimate

View = Mapping[str, Any]
"""Values by name."""

CHOICES: Final = {'mode': MODES, 'speed': (0.25, 0.5, 1.0, 2.0, 4.0, 8.0), 'noise': NOISE_PRESETS}
"""What the page offers; speeds are simulated seconds per second."""
_RECENT_S: Final = 0.5
_MIN_LENGTH_TO_APPEND: Final = 32
_CHI_95: Final = 2.4477
"""Radius of the ellipse that holds 95 % of a planar Gaussian, in standard deviations."""
_CONFIDENCE: Final = {
    Confidence.OK: 'pose is certain',
    Confidence.UNCERTAIN: 'pose is uncertain',
    Confidence.STALE: 'pose is outdated',
}
_NOTES: Final = {
    'crisp': 'crisp: one region decides',
    'fuzzy': 'fuzzy: up to four regions vote',
    'fuzzy-eq3': 'equation (3), unit vectors',
    'fuzzy-as-printed': 'equation (3) as printed',
}


def page_view(state: PageState, now_s: float) -> View:
    """Return the values of the whole page, with rates and silences by the monotonic clock."""
    health = state.health
    runs, estimates = (health.status(n, now_s) is NodeStatus.UP for n in (ROBOT, ESTIMATOR))
    lost = runs and not estimates  # the region state that is shown is outdated
    cast, heading_rad = ((), None) if lost else decide(state)
    rates = [(topic, rate.rate_hz(now_s)) for topic, rate in sorted(health.topics.items())]
    return {
        **_summary(state, now_s), **_poses(state), 'arena': _arena(state.arena),
        'nodes': {name: _node(state, name, now_s) for name in health.nodes},
        'topics': [(topic, round(rate_hz, 1)) for topic, rate_hz in rates],
        'picture': _picture(state.picture), 'lost': lost,
        'obstacles': [(*one[:4], degrees(one[4]), one[5]) for one in state.obstacles],
        'behaviors': [_proposal(status) for status in state.behaviors],
        'region': _region(state, lost=lost), 'votes': _votes(cast, state.arena.regions),
        'heading': None if heading_rad is None else degrees(heading_rad), 'note': _note(state),
        'policy': None if state.policy is None else _policy(state.policy),
        'model': _model(state.learner), 'last': _last(state), 'curve': list(state.paths.curve),
        'outcomes': dict(state.paths.outcomes),
    }  # fmt: skip


def _proposal(status: Status) -> tuple[str, float | None, str, bool]:
    """Return a behaviour's name, its direction, what it said in words, whether it was heard."""
    values, said = status.values, []
    if (weight := _number(values, 'weight')) is not None:
        said.append(f'weight {weight:.3g}')
    if (limit := _number(values, 'limit_m_per_s')) is not None:
        said.append(f'at most {limit:.2f} m/s')
    heading_rad = _number(values, 'heading_rad')
    direction = None if heading_rad is None else degrees(heading_rad)
    heard = values.get('heard') == 'true'
    return escape(status.name), direction, ', '.join(said) or 'nothing', heard


def _number(values: Mapping[str, str], key: str) -> float | None:
    """Return a finite number of a status; None where it holds none."""
    try:
        number = float(values[key])
    except (KeyError, ValueError):
        return None
    return number if math.isfinite(number) else None


def replay(state: PageState) -> dict[str, Any]:
    """Return the last path, and those of a point from the same start, fuzzy and crisp.

    Raises:
        CommandError: No path has ended since the page was opened, or no policy was received.
    """
    poses, arena = state.poses, state.arena
    driven = poses.trail.text if state.ended else poses.last_trail
    if not driven or state.policy is None:
        raise CommandError('no path has ended since the page was opened')
    x_cm, y_cm = map(float, driven.partition(' ')[0].split(','))
    start = Pose2(x_m=x_cm / 100.0, y_m=arena.length_m - y_cm / 100.0, heading_rad=0.0)
    paths = []
    for mode in ('fuzzy', 'crisp'):
        track = blended_track(arena, state.policy, start, mode=mode)
        length_m, points_m = track.length_m, track.points_m.round(3).tolist()
        outcome = track.outcome.value
        paths.append({'mode': mode, 'length_m': length_m, 'outcome': outcome, 'm': points_m})
    return {'driven': driven, 'paths': paths}


def run_status(state: PageState, now_s: float) -> str:
    """Return the status of the run in a few words."""
    health = state.health
    found = {name: health.status(name, now_s) for name in health.nodes}
    down = [name for name, status in found.items() if status is NodeStatus.DOWN]
    if down:
        first = max(down, key=lambda name: health.silence_s(name, now_s))
        return f'{first} is silent' if len(down) < len(found) else 'the graph is silent'
    up = sum(status is not NodeStatus.UNSEEN for status in found.values())
    if up < len(found):
        return f'coming up: {up} of {len(found)} nodes' if up else 'waiting for a graph'
    if state.is_paused or found[ROBOT] is NodeStatus.QUIET:
        return 'paused'
    return 'learning' if state.learning else 'driving'


def _summary(state: PageState, now_s: float) -> dict[str, Any]:
    robot, last = state.parameters[ROBOT], state.paths.last
    path = None if last is None else last.path + (1 if last.outcome is None else 2)
    matching = (p for p in NOISE_PRESETS if noise_parameters(p).items() <= robot.items())
    return {
        'status': run_status(state, now_s),
        'mode': state.parameters[CONTROLLER].get('mode'),
        'learning': state.learning,
        'path': path,
        'time_s': round(state.clock_ns * 1e-9, 1),
        'clock': robot.get('clock'),
        'speed': robot.get('speed'),
        'noise': next(matching, None),
    }


def _node(state: PageState, name: str, now_s: float) -> tuple[str, str]:
    """Return the status of a node, and the words for it and for who started it."""
    health = state.health
    status, silence_s = health.status(name, now_s), health.silence_s(name, now_s)
    words = 'responds, publishes nothing' if status is NodeStatus.QUIET else 'not seen'
    if status is NodeStatus.UP:
        rate = health.topics.get(TOPICS_OF[name][0])
        words = f'{rate.rate_hz(now_s):.0f} Hz' if rate else 'up'
    elif status is NodeStatus.DOWN:
        words = f'silent for {silence_s:.0f} s'
        words = 'was silent, is back' if silence_s < _RECENT_S else words
    return status.value, f'external, {words}' if name in state.external else words


@lru_cache(maxsize=4)
def _arena(arena: Arena) -> dict[str, Any]:
    """Return what does not move: floor, regions and LEDs."""
    regions = arena.regions
    return {
        'size': (arena.width_m, arena.length_m),
        'knots': (regions.x_knots_m, regions.y_knots_m),
        'borders': (regions.x_borders_m, regions.y_borders_m),
        'labels': regions.labels,
        'goal': regions.goal,
        'forbidden': regions.forbidden,
        'leds': arena.landmarks_m,
        'body_m': BODY_RADIUS_M,
    }


def _poses(state: PageState) -> dict[str, Any]:
    poses, azimuth = state.poses, None
    if poses.truth is not None and state.head is not None:
        azimuth = degrees(camera_azimuth(poses.truth.heading_rad, state.head))
    error = poses.error and (round(poses.error[0], 4), degrees(poses.error[1]))
    return {
        'truth': _pose(poses.truth),
        'compared': _pose(poses.compared or poses.truth),
        'odometry': _pose(poses.odometry),
        'estimate': None if poses.estimate is None else _estimate(poses.estimate),
        'estimate_s': poses.estimate_ns * 1e-9,
        'stamp': str(poses.estimate_ns),
        'error': error,
        'trail': poses.trail.text,
        'estimate_trail': poses.estimate_trail.text,
        'camera': azimuth,
        'fov': math.degrees(state.fov_rad),
        'bumpers': [(n, len(state.bumpers)) for n, pressed in enumerate(state.bumpers) if pressed],
        'seen': [number for number, led in enumerate(state.landmarks) if led is not None],
    }


def _pose(pose: Pose2 | None) -> tuple[float, float, float] | None:
    return None if pose is None else (pose.x_m, pose.y_m, degrees(pose.heading_rad))


def _estimate(estimate: PoseEstimate) -> dict[str, Any]:
    """Return pose, standard deviations, and the ellipse that holds 95 % of positions."""
    covariance = estimate.covariance
    vxx, vxy, vyy = (float(covariance[i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    mean, half = (vxx + vyy) / 2, math.hypot((vxx - vyy) / 2, vxy)
    radii = [_CHI_95 * math.sqrt(max(0.0, mean + sign * half)) for sign in (1, -1)]
    sigma_x, sigma_y, sigma_heading = (math.sqrt(max(0.0, covariance[k, k])) for k in range(3))
    return {
        'pose': _pose(estimate.pose),
        'sigma': (sigma_x, sigma_y, math.degrees(sigma_heading)),
        'ellipse': (*radii, degrees(math.atan2(2 * vxy, vxx - vyy) / 2)),
    }


def _picture(picture: CameraPicture | None) -> dict[str, Any] | None:
    """Return the camera image and the LEDs detected in this very image."""
    if picture is None:
        return None
    leds = [None if led is None else (led.u_px, led.v_px) for led in picture.landmarks]
    return {'url': picture.url, 'size': (picture.width_px, picture.height_px), 'leds': leds}


def _region(state: PageState, *, lost: bool) -> dict[str, Any] | None:
    now = state.state
    if now is None:
        return None
    return {
        'name': state.arena.regions.name(now.region),
        'at': (now.pose.x_m, now.pose.y_m),
        'mu': (now.mu_x, now.mu_y),
        'confidence': 'no state received' if lost else _CONFIDENCE[now.confidence],
    }


def decide(state: PageState) -> tuple[tuple[Vote, ...], float | None]:
    """Return the votes in the present state and the heading they blend into.

    A learning controller explores at random and publishes an action only when it has ended: then
    the votes are those of the policy so far, and there is no heading.
    """
    now, policy = state.state, state.policy
    if now is None or policy is None or now.confidence is not Confidence.OK:
        return (), None
    if state.learning:
        return votes('crisp', now.mu_x, now.mu_y, policy), None
    cast = votes(state.mode, now.mu_x, now.mu_y, policy)
    return cast, blend(state.mode, cast)


def _votes(cast: tuple[Vote, ...], regions: RegionMap) -> list[tuple[Any, ...]]:
    """Return region, its name, share and heading of each vote, the largest first."""
    total = sum(vote.weight for vote in cast)
    return [
        (v.region, regions.name(v.region), v.weight / total, _heading(v.action, v.actions))
        for v in sorted(cast, key=lambda vote: -vote.weight)
    ]


def _note(state: PageState) -> str:
    if state.policy is None:
        return 'no policy received'
    return 'learning: explores at random' if state.learning else _NOTES.get(state.mode, state.mode)


@lru_cache(maxsize=4)
def _policy(policy: Policy) -> dict[str, Any]:
    headings = [degrees(heading) for heading in action_headings_rad(policy.regions.actions)]
    return {'q': policy.q.tolist(), 'actions': policy.actions, 'headings': headings}


def _model(learner: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return what a planner knows of the floor: walls felt, extents crossed, regions entered."""
    if learner.get('name') != 'planner':
        return None
    return {name: learner['state'].get(name, []) for name in ('walls', 'spans_m', 'entered')}


def _last(state: PageState) -> dict[str, Any] | None:
    last, policy = state.paths.last, state.policy
    if last is None:
        return None
    return {
        'trial': last.trial + 1,
        'temperature': last.temperature,
        'heading': _heading(last.action, policy.regions.actions if policy else 8),
        'region': state.arena.regions.name(last.state),
        'outcome': None if last.outcome is None else last.outcome.value,
    }


def _heading(action: int, count: int) -> float:
    return degrees(action_headings_rad(count)[action % count])


def degrees(angle_rad: float) -> float:
    """Return an angle in degrees in (-180, 180], to a hundredth; zero has no sign."""
    angle_deg = round(math.degrees(wrap_angle(angle_rad)), 2) + 0.0
    return 180.0 if angle_deg == -180.0 else angle_deg  # noqa: PLR2004 - the other name of 180


def difference(new: View, old: View) -> dict[str, Any]:
    """Return what turns a page that shows `old` into one that shows `new`.

    A text that has only grown at its end is given as `+name` with the text to append.
    """
    patch: dict[str, Any] = {}
    for name, value in new.items():
        before = old.get(name)
        if value == before and name in old:
            continue
        shown = before if isinstance(before, str) and isinstance(value, str) else ''
        if len(shown) > _MIN_LENGTH_TO_APPEND and value.startswith(shown):
            patch[f'+{name}'] = value[len(shown) :]
        else:
            patch[name] = value
    return patch
