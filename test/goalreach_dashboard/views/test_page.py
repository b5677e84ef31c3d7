"""The views, and that the page has a place for everything in them."""

from __future__ import annotations

from importlib import resources
import json
import math
import re

import cv2
import numpy as np
import pytest

from goalreach_dashboard.ros.subscriptions import camera_picture
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_dashboard.views.decision import decide
from goalreach_dashboard.views.page import page_view
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.regions import memberships
from goalreach_msgs_py.topics import (
    CLOCK,
    CMD_VEL,
    CONTROLLER,
    LOCALIZER,
    NODES,
    POSE,
    ROBOT,
    STATE,
)
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    LandmarkObservation,
    PathOutcome,
    Pose2,
    PoseEstimate,
    RegionState,
    Transition,
)

STAMP_NS = 40_000_000


def full_state(x_m: float = 1.778, y_m: float = 1.69, mode: str = 'fuzzy') -> PageState:
    """Return the state after one tick of a robot at a point, facing the goal wall."""
    arena = Arena()
    state = PageState(arena=arena)
    pose = Pose2(x_m=x_m, y_m=y_m, heading_rad=-math.pi / 2)
    regions = arena.regions
    state.state = RegionState(
        region=regions.region_at(x_m, y_m),
        mu_x=memberships(x_m, regions.x_knots_m),
        mu_y=memberships(y_m, regions.y_knots_m),
        pose=pose,
        goal_probability=0.0,
        confidence=Confidence.OK,
    )
    state.poses.add_truth(STAMP_NS, pose)
    state.poses.add_odometry(STAMP_NS, pose)
    covariance = np.diag([4e-4, 1e-4, 1e-4])
    state.add_estimate(STAMP_NS, PoseEstimate(pose=pose, covariance=covariance))
    state.head = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
    state.bumpers = (True, *(False,) * 19)
    q = np.zeros((3, 3, 8))
    q[:, :, 6] = 0.9
    q[0, 1, 7] = q[2, 1, 5] = 1.0
    state.set_q_table(q)
    seen = LandmarkObservation(u_px=320.0, v_px=240.0, peak_dn=200.0)
    state.landmarks = (seen, None, seen)
    state.picture = CameraPicture(
        url='data:,', width_px=640, height_px=480, landmarks=state.landmarks, stamp_ns=STAMP_NS
    )
    state.parameters[CONTROLLER] = {'mode': mode, 'learn': False}
    state.parameters[ROBOT] = {'clock': 'realtime', 'speed': 2.0}
    for topic in (CLOCK, POSE, STATE, CMD_VEL):
        state.health.record_message(topic, 10.0, 1)
    state.clock_ns = STAMP_NS
    return state


def skeleton_names() -> set[str]:
    path = resources.files('goalreach_dashboard') / 'static' / 'page.html'
    return set(re.findall(r'data-testid="([^"]+)"', path.read_text(encoding='utf-8')))


def test_the_page_has_a_place_for_everything() -> None:
    view = page_view(full_state(), 10.1)
    assert set(view) <= skeleton_names()
    assert all(isinstance(v, str) for element in view.values() for v in element.values())
    json.dumps(view)


def test_an_empty_page_can_be_shown() -> None:
    view = page_view(PageState(arena=Arena()), 0.0)
    assert view['status']['text'] == 'waiting for a graph'
    assert view['robot']['visibility'] == 'hidden'
    assert set(view) <= skeleton_names()


def test_the_robot_is_drawn_to_scale() -> None:
    """The arena is 508 cm long: y = 1.69 m is 339 cm below the far wall."""
    view = page_view(full_state(), 10.1)
    assert view['robot']['transform'] == 'translate(177.8 339.0)'
    assert view['drive-heading']['transform'] == 'rotate(90.0)'
    assert view['estimate-x']['text'] == '1.778 m'
    assert view['estimate-heading-text']['text'] == '-90.0°'
    assert view['bumpers']['html'].count('<path') == 1


def test_the_ellipse_holds_95_percent() -> None:
    """Standard deviations of 2 cm and 1 cm, times 2.4477."""
    view = page_view(full_state(), 10.1)
    assert (view['ellipse']['rx'], view['ellipse']['ry']) == ('4.9', '2.4')
    assert view['ellipse']['transform'] in ('rotate(-0.0)', 'rotate(0.0)')


def test_a_pose_that_is_looked_for_leaves_no_trail() -> None:
    state = full_state()
    trail = state.poses.estimate_trail.text
    anywhere = PoseEstimate(
        pose=Pose2(x_m=0.5, y_m=4.0, heading_rad=0.0), covariance=np.diag([1.0, 1.0, 1.0])
    )
    state.add_estimate(2 * STAMP_NS, anywhere)
    assert state.poses.estimate_trail.text == trail != ''
    assert state.poses.estimate is anywhere


def test_leds_are_marked_where_they_were_seen() -> None:
    html = page_view(full_state(), 10.1)['detections']['html']
    assert 'LED 1' in html
    assert 'LED 2' not in html
    assert 'x="300.0" y="220.0" width="40"' in html


def test_memberships_stand_on_the_trapezoids() -> None:
    """y = 1.69 m is in the middle of the area between NEAR and MEDIUM, 1.4351 to 1.9431 m."""
    html = page_view(full_state(), 10.1)['values-y']['html']
    assert html.count('>0.50<') == 2


def test_the_blend_is_what_the_controller_drives() -> None:
    """Left of FRONT/MEDIUM the arrows 315 and 270 vote; in the middle one alone does."""
    cast, heading_rad = decide(full_state(x_m=1.2, y_m=2.5))
    assert {vote.region for vote in cast} == {(0, 1), (1, 1)}
    assert heading_rad is not None
    assert -90.0 < math.degrees(heading_rad) < -45.0
    cast, heading_rad = decide(full_state(x_m=1.2, y_m=2.5, mode='crisp'))
    assert len(cast) == 1
    assert heading_rad is not None


def test_a_learner_shows_no_heading() -> None:
    state = full_state()
    state.parameters[CONTROLLER] = {'mode': 'fuzzy', 'learn': True}
    assert decide(state)[1] is None
    assert page_view(state, 10.1)['status']['text'] == 'learning'


def test_a_dead_node_is_named() -> None:
    state = full_state()
    for topic in (CLOCK, STATE, CMD_VEL):
        state.health.record_message(topic, 11.5, 2)
    view = page_view(state, 11.6)
    assert view['status']['text'] == f'{LOCALIZER} is silent'
    assert view[f'node-{LOCALIZER}']['class'] == 'node down'
    assert view[f'word-{LOCALIZER}']['text'] == 'silent for 2 s'
    assert view[f'node-{ROBOT}']['class'] == 'node up'


def test_a_paused_run_is_no_dead_run() -> None:
    state = full_state()
    for name in NODES:
        state.health.record_response(name, 12.9)
    view = page_view(state, 13.0)
    assert view['status']['text'] == 'paused'
    assert {view[f'node-{name}']['class'] for name in NODES} == {'node quiet'}


@pytest.mark.parametrize(('x_m', 'goals'), [(1.778, 1), (0.5, 0)])
def test_success_is_judged_by_the_truth_of_the_stamp(x_m: float, goals: int) -> None:
    state = full_state(x_m=x_m, y_m=1.0)
    transition = Transition(
        state=(1, 1),
        action=6,
        reward=1.0,
        next_state=(1, 0),
        temperature=0.0,
        trial=0,
        path=0,
        outcome=PathOutcome.GOAL,
    )
    state.add_transition(STAMP_NS, transition)
    view = page_view(state, 10.1)
    assert view['success']['text'] == f'{goals} of 1'
    assert view['path']['text'] == '2'


@pytest.mark.parametrize(('suffix', 'start'), [('.jpg', 'jpeg;base64,/9j/'), ('.png', 'png;')])
def test_images_are_shown_as_they_were_compressed(suffix: str, start: str) -> None:
    encoded = cv2.imencode(suffix, np.zeros((48, 64), dtype=np.uint8))[1].tobytes()
    picture = camera_picture(encoded, (), STAMP_NS)
    assert picture.url.startswith(f'data:image/{start}')
    assert (picture.width_px, picture.height_px) == (64, 48)


def test_bytes_that_are_no_image_are_refused() -> None:
    with pytest.raises(MessageError, match='compressed image of 3 bytes'):
        camera_picture(b'abc', (), STAMP_NS)


def test_an_old_state_does_not_look_like_a_new_one() -> None:
    state = full_state()
    state.health.record_message(CLOCK, 11.5, 2)
    view = page_view(state, 11.6)
    assert view['estimate']['class'] == 'estimate old'
    assert view['commanded']['visibility'] == 'hidden'
    assert view['votes']['html'] == ''
    assert view['confidence']['text'] == 'no state received'
