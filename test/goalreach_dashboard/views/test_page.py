"""The views, and that the page has a place for everything in them."""

from __future__ import annotations

import json
import math

import cv2
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_dashboard.ros.listener import camera_picture
from goalreach_dashboard.state import CameraPicture, PageState
from goalreach_dashboard.views.page import (
    View,
    decide,
    degrees,
    difference,
    page_view,
    replay,
    run_status,
)
from goalreach_learning.behaviors import Opinion, Proposal
from goalreach_learning.ros.opinions import opinions_to_raw
from goalreach_msgs_py.arena import LENGTH_M, WIDTH_M, Arena
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import Status, statuses_from_raw
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.regions import RegionMap, memberships
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
        url='data:,', width_px=640, height_px=480, landmarks=state.landmarks
    )
    state.parameters[CONTROLLER] = {'mode': mode, 'learn': False}
    state.parameters[ROBOT] = {'clock': 'realtime', 'speed': 2.0}
    for topic in (CLOCK, POSE, STATE, CMD_VEL):
        state.health.record_message(topic, 10.0, 1)
    state.clock_ns = STAMP_NS
    return state


def test_the_view_is_plain_json() -> None:
    view = page_view(full_state(), 10.1)
    assert json.loads(json.dumps(view, allow_nan=False)).keys() == view.keys()


def test_an_empty_page_can_be_shown() -> None:
    view = page_view(PageState(arena=Arena()), 0.0)
    assert view['status'] == 'waiting for a graph'
    assert view['truth'] is view['estimate'] is view['picture'] is None
    json.dumps(view)


def test_what_is_still_coming_up_is_counted() -> None:
    state = PageState(arena=Arena())
    state.health.record_message(CLOCK, 10.0, 1)
    assert run_status(state, 10.1) == 'coming up: 1 of 4 nodes'


def test_the_ellipse_holds_95_percent() -> None:
    """Standard deviations of 2 cm and 1 cm, times 2.4477."""
    estimate = page_view(full_state(), 10.1)['estimate']
    assert estimate['ellipse'] == pytest.approx((0.04895, 0.02448, 0.0), abs=1e-5)
    assert estimate['sigma'][:2] == pytest.approx((0.02, 0.01))
    assert estimate['pose'] == (1.778, 1.69, -90.0)


def test_a_pose_that_is_looked_for_leaves_no_trail() -> None:
    state = full_state()
    trail = state.poses.estimate_trail.text
    anywhere = PoseEstimate(
        pose=Pose2(x_m=0.5, y_m=4.0, heading_rad=0.0), covariance=np.diag([1.0, 1.0, 1.0])
    )
    state.add_estimate(2 * STAMP_NS, anywhere)
    assert state.poses.estimate_trail.text == trail != ''
    assert state.poses.estimate is anywhere


def test_leds_are_given_where_they_were_seen() -> None:
    view = page_view(full_state(), 10.1)
    assert view['picture']['leds'] == [(320.0, 240.0), None, (320.0, 240.0)]
    assert view['seen'] == [0, 2]
    assert view['bumpers'] == [(0, 20)]


def test_memberships_share_one_between_two_regions() -> None:
    """y = 1.69 m is in the middle of the area between NEAR and MEDIUM, 1.4351 to 1.9431 m."""
    assert page_view(full_state(), 10.1)['region']['mu'][1] == pytest.approx(
        (0.5, 0.5, 0.0), abs=3e-3
    )


def test_the_blend_is_what_the_controller_drives() -> None:
    """Left of FRONT/MEDIUM the arrows -45 and -90 vote; in the middle one alone does."""
    view = page_view(full_state(x_m=1.2, y_m=2.5), 10.1)
    assert {vote[0]: vote[3] for vote in view['votes']} == {(0, 1): -45.0, (1, 1): -90.0}
    assert sum(vote[2] for vote in view['votes']) == pytest.approx(1.0)
    assert -90.0 < view['heading'] < -45.0
    cast, heading_rad = decide(full_state(x_m=1.2, y_m=2.5, mode='crisp'))
    assert len(cast) == 1
    assert heading_rad is not None


def test_a_learner_shows_no_heading() -> None:
    state = full_state()
    state.parameters[CONTROLLER] = {'mode': 'fuzzy', 'learn': True}
    view = page_view(state, 10.1)
    assert view['heading'] is None
    assert view['status'] == 'learning'


def test_a_dead_node_is_named() -> None:
    state = full_state()
    for topic in (CLOCK, STATE, CMD_VEL):
        state.health.record_message(topic, 11.5, 2)
    view = page_view(state, 11.6)
    assert view['status'] == f'{LOCALIZER} is silent'
    assert view['nodes'][LOCALIZER] == ('down', 'silent for 2 s')
    assert view['nodes'][ROBOT][0] == 'up'


def test_a_paused_run_is_no_dead_run() -> None:
    state = full_state()
    for name in NODES:
        state.health.record_response(name, 12.9)
    view = page_view(state, 13.0)
    assert view['status'] == 'paused'
    assert {view['nodes'][name][0] for name in NODES} == {'quiet'}


def test_where_a_paused_robot_was_placed_is_shown_at_once() -> None:
    state = full_state()
    state.place(Pose2(x_m=1.0, y_m=4.0, heading_rad=math.pi))
    view = page_view(state, 10.1)
    assert view['truth'] == view['compared'] == (1.0, 4.0, 180.0)
    assert view['trail'] == ''
    assert view['estimate'] is None


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
    assert view['outcomes'].get('goal', 0) == goals
    assert view['path'] == 2
    (event,) = state.events.values()
    assert event['outcome'] == ('goal' if goals else 'false-goal')


@pytest.mark.parametrize(('suffix', 'start'), [('.jpg', 'jpeg;base64,/9j/'), ('.png', 'png;')])
def test_images_are_shown_as_they_were_compressed(suffix: str, start: str) -> None:
    encoded = cv2.imencode(suffix, np.zeros((48, 64), dtype=np.uint8))[1].tobytes()
    picture = camera_picture(encoded, ())
    assert picture.url.startswith(f'data:image/{start}')
    assert (picture.width_px, picture.height_px) == (64, 48)


@pytest.mark.parametrize('encoded', [b'abc', b''])
def test_bytes_that_are_no_image_are_refused(encoded: bytes) -> None:
    with pytest.raises(MessageError, match=f'data of {len(encoded)} bytes'):
        camera_picture(encoded, ())


def test_an_old_state_does_not_look_like_a_new_one() -> None:
    state = full_state()
    state.health.record_message(CLOCK, 11.5, 2)
    view = page_view(state, 11.6)
    assert view['lost']
    assert view['heading'] is None
    assert view['votes'] == []
    assert view['region']['confidence'] == 'no state received'


def test_the_last_path_is_driven_again_from_its_start() -> None:
    """From the far left both modes reach the goal, the fuzzy one by another way."""
    state = full_state(x_m=1.2, y_m=4.0)
    with pytest.raises(CommandError, match='no path has ended'):
        replay(state)
    state.add_event({'event': 'end', 'reason': 'stopped'})
    found = replay(state)
    assert found['driven'] == '120.0,108.0 '
    fuzzy, crisp = found['paths']
    assert fuzzy['m'][0] == crisp['m'][0] == [1.2, 4.0]
    assert fuzzy['outcome'] == crisp['outcome'] == 'goal'
    assert fuzzy['m'] != crisp['m']


def test_a_new_run_discards_the_one_before() -> None:
    state = full_state()
    state.add_event({'event': 'end', 'reason': 'stopped', 'bag': '/bag'})
    assert (state.ended, state.bag) == (True, '/bag')
    last = max(state.events)
    state.add_event({'event': 'begin', 'arena': 'paper'})
    assert (state.ended, state.bag) == (False, '')
    assert list(state.events) == [last + 1]
    assert state.poses.truth is None


def test_of_a_run_without_end_the_last_paths_are_kept() -> None:
    state = PageState(arena=Arena())
    state.add_event({'event': 'begin'})
    state.add_event({'event': 'record', 'on': True})
    for _ in range(1100):
        state.add_event({'event': 'path', 'outcome': 'goal'})
    assert len(state.events) == 1000
    first, recording, second, *_, last = state.events.values()
    assert (first['event'], recording['event']) == ('begin', 'record')
    assert (second['number'], last['number']) == (103, 1100)
    state.add_event({'event': 'begin'})
    state.add_event({'event': 'path', 'outcome': 'goal'})
    assert [event.get('number') for event in state.events.values()] == [None, 1]


@pytest.mark.parametrize(
    ('angle_rad', 'shown'),
    [(-math.pi, 180.0), (math.pi, 180.0), (1.5 * math.pi, -90.0), (-1e-9, 0.0), (0.7, 40.11)],
)
def test_angles_have_one_sign_convention(angle_rad: float, shown: float) -> None:
    assert str(degrees(angle_rad)) == str(shown)


def test_a_difference_holds_what_has_changed() -> None:
    trail = '10.0,20.0 ' * 8
    old = {'a': 1, 'trail': trail, 'list': [1, 2]}
    assert difference(old, {}) == old
    assert difference(old, old) == {}
    new = {'a': None, 'trail': trail + '1,2 ', 'list': [1, 2]}
    assert difference(new, old) == {'a': None, '+trail': '1,2 '}
    assert difference({'trail': 'x'}, old) == {'trail': 'x'}


_views = st.dictionaries(st.sampled_from('abc'), st.text('ab ', max_size=60) | st.integers())


@given(_views, _views, st.booleans())
def test_a_patched_page_shows_the_new_view(old: View, new: View, grows: bool) -> None:  # noqa: FBT001
    new = {**old, **({name: value * 2 for name, value in old.items()} if grows else new)}
    shown = dict(old)
    for name, value in difference(new, old).items():
        if name.startswith('+'):
            shown[name[1:]] += value
        else:
            shown[name] = value
    assert shown == new


def test_values_of_another_grid_wait_for_its_arena() -> None:
    """A latched Q-table arrives before the parameters that describe the arena."""
    state, q = PageState(arena=Arena()), np.zeros((2, 4, 16))
    q[:, :, 12] = 1.0
    state.set_q_table(q)
    assert state.policy is None
    assert page_view(state, 0.0)['policy'] is None
    regions = RegionMap(
        x_knots_m=(0.0, 1.6, 1.9, WIDTH_M),
        y_knots_m=(0.0, 1.2, 1.3, 2.4, 2.5, 3.6, 3.7, LENGTH_M),
        own_labels=(('west', 'east'), ('a', 'b', 'c', 'd')),
        goal=(0, 0),
        forbidden=((1, 1),),
    )
    state.set_arena(Arena(regions=regions, starts=()))
    view = page_view(state, 0.0)
    assert len(view['policy']['headings']) == 16
    assert view['policy']['actions'][1][3] == 12
    assert view['arena']['labels'][0] == ('west', 'east')
    assert view['arena']['forbidden'] == ((1, 1),)


def test_the_model_of_a_planner_is_shown_and_no_other() -> None:
    state = full_state()
    assert page_view(state, 10.1)['model'] is None
    known = {'walls': [[1, 0, 3.3]], 'spans_m': [[[0, [0.3, 1.0]]], []], 'entered': []}
    state.learner = {'name': 'planner', 'state': {**known, 'more': 1}}
    assert page_view(state, 10.1)['model'] == known
    state.learner = {'name': 'dyna-q', 'state': known}
    assert page_view(state, 10.1)['model'] is None


def test_who_proposes_what_and_who_is_heard() -> None:
    state = full_state()
    opinions = (
        Opinion(name='escape', proposal=None, heard=False),
        Opinion(
            name='avoid',
            proposal=Proposal(heading_rad=-math.pi / 4, weight=2.5, limit_m_per_s=0.3),
            heard=True,
        ),
        Opinion(name='goal', proposal=Proposal(heading_rad=-math.pi / 2), heard=False),
    )
    state.behaviors = statuses_from_raw(opinions_to_raw(opinions, STAMP_NS))
    state.obstacles = [(1.0, 2.0, 0.4, 0.3, math.pi / 2, False)]
    view = page_view(state, 1.0)
    assert view['behaviors'] == [
        ('escape', None, 'nothing', False),
        ('avoid', -45.0, 'weight 2.5, at most 0.30 m/s', True),
        ('goal', -90.0, 'weight 1', False),
    ]
    assert view['obstacles'] == [(1.0, 2.0, 0.4, 0.3, 90.0, False)]


def test_what_another_node_proposes_cannot_end_the_page() -> None:
    state = full_state()
    values = {'weight': 'high', 'heading_rad': 'nan', 'limit_m_per_s': 'inf'}
    state.behaviors = [Status(name='<b>', message='', hardware_id='', values=values)]
    assert page_view(state, 1.0)['behaviors'] == [('&lt;b&gt;', None, 'nothing', False)]
