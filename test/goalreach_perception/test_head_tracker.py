from __future__ import annotations

import math
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_perception.head_tracker import HeadConfig, HeadTracker
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import Lens, project
from goalreach_perception.pose_filter import PoseFilter
from tag_images import SIX_TAGS

LENS = Lens.of_camera(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
REST = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
LED_PLACES = ArenaConfig().landmark_array_m


def test_for_landmarks_abeam_turret_and_pan_share_the_turn() -> None:
    # Facing +x at (0, 2, 1) with LEDs around (0, 0, 1): 90 deg to the right, not begun yet.
    offsets = [[-0.1, -2.0, 0.0], [0.1, -2.0, 0.0], [0.0, -2.0, 0.0]]
    command = HeadTracker(HeadConfig()).track(
        REST, heading_rad=0.0, offsets_m=offsets, biases_rad=(0.0, 0.0), lens=LENS
    )
    assert command.turret_rad == pytest.approx(-math.pi / 2)
    assert command.pan_rad == pytest.approx(math.radians(-87.0))
    assert command.tilt_rad == pytest.approx(0.0, abs=1e-12)


def test_biases_are_subtracted_from_the_targets() -> None:
    offsets = [[2.0, 0.1, 0.2], [2.0, -0.1, 0.2], [2.0, 0.0, 0.2]]
    command = HeadTracker(HeadConfig()).track(
        REST, heading_rad=0.0, offsets_m=offsets, biases_rad=(0.01, 0.02), lens=LENS
    )
    assert command.pan_rad == pytest.approx(-0.01)
    assert command.tilt_rad == pytest.approx(math.atan2(0.2, 2.0) - 0.02, abs=1e-3)


def test_pan_compensates_the_lag_of_the_turret() -> None:
    tracker = HeadTracker(HeadConfig())
    offsets = [[2.0, 0.1, 0.0], [2.0, -0.1, 0.0], [2.0, 0.0, 0.0]]
    arguments: dict[str, Any] = {
        'heading_rad': 0.0,
        'offsets_m': offsets,
        'biases_rad': (0.0, 0.0),
        'lens': LENS,
    }
    tracker.track(HeadAngles(turret_rad=0.5, pan_rad=0.0, tilt_rad=0.0), **arguments)
    command = tracker.track(HeadAngles(turret_rad=0.45, pan_rad=0.0, tilt_rad=0.0), **arguments)
    # The turret will have gone another -0.05 rad by the next image.
    assert command.turret_rad == pytest.approx(0.0, abs=1e-12)
    assert command.pan_rad == pytest.approx(-0.45 + 0.05)


def test_leds_to_hold_are_centred_even_if_a_wider_pair_fits() -> None:
    offsets = [[2.0, 0.9, 0.0], [2.0, 0.1, 0.0], [2.0, -0.9, 0.0]]
    command = HeadTracker(HeadConfig()).track(
        REST,
        heading_rad=0.0,
        offsets_m=offsets,
        biases_rad=(0.0, 0.0),
        lens=LENS,
        hold=(0, 1),
    )
    # Half way between 24.2 and 2.9 deg in the plane of the image: atan((0.45 + 0.05) / 2).
    assert command.turret_rad == pytest.approx(math.atan2(0.5, 2.0), abs=0.01)


@given(st.floats(0.3, 3.2), st.floats(2.2, 4.8))
@settings(max_examples=60, deadline=None)
def test_all_three_are_in_the_image_beyond_the_near_part_of_the_arena(
    x_m: float, y_m: float
) -> None:
    offsets = LED_PLACES - np.array([x_m, y_m, 1.1])
    azimuth, tilt = HeadTracker(HeadConfig()).centre_leds(offsets.tolist(), LENS)
    pixels = project(offsets, optical_rotation(azimuth, tilt), LENS).pixels_px
    assert (pixels > 20.0).all()
    assert (pixels < [619.0, 459.0]).all()


@given(st.floats(0.3, 3.2), st.floats(0.95, 2.0))
@settings(max_examples=60, deadline=None)
def test_two_are_in_the_image_nearer_than_that(x_m: float, y_m: float) -> None:
    offsets = LED_PLACES - np.array([x_m, y_m, 1.1])
    azimuth, tilt = HeadTracker(HeadConfig()).centre_leds(offsets.tolist(), LENS)
    pixels = project(offsets, optical_rotation(azimuth, tilt), LENS).pixels_px
    inside = (pixels > 20.0).all(axis=1) & (pixels < [620.0, 460.0]).all(axis=1)
    assert inside.sum() >= 2


def test_the_search_covers_every_azimuth() -> None:
    # A robot whose pan turns 90 deg/s and whose turret speeds up by 30 deg/s^2 to 90 deg/s.
    tracker = HeadTracker(HeadConfig())
    dt, turret, pan, speed = 0.04, 0.0, 0.0, 0.0
    seen: set[int] = set()
    for _ in range(int(4.0 / dt)):
        joints = HeadAngles(turret_rad=math.radians(turret), pan_rad=math.radians(pan), tilt_rad=0)
        command = tracker.search(joints)
        speed = min(speed + 30.0 * dt, 90.0) if command.turret_rad > joints.turret_rad else 0.0
        turret += speed * dt
        wanted = math.degrees(command.pan_rad)
        pan += max(-90.0 * dt, min(90.0 * dt, wanted - pan))
        middle = round(turret + pan)
        seen |= {azimuth % 360 for azimuth in range(middle - 28, middle + 29)}
    assert len(seen) == 360


def test_the_search_slows_down_after_a_fruitless_turn_at_each_tilt() -> None:
    tracker = HeadTracker(HeadConfig())
    leads_deg = []
    for turret in range(0, 900, 10):
        joints = HeadAngles(turret_rad=math.radians(turret), pan_rad=0.0, tilt_rad=0.0)
        lead_rad = tracker.search(joints).turret_rad - joints.turret_rad
        leads_deg.append(round(math.degrees(lead_rad)))
    assert leads_deg[:81] == [150] * 81
    assert leads_deg[81:] == [5] * 9


def test_the_search_tilts_higher_every_other_turn() -> None:
    tracker = HeadTracker(HeadConfig())
    tilts = [
        tracker.search(
            HeadAngles(turret_rad=math.radians(turret), pan_rad=0.0, tilt_rad=0.0)
        ).tilt_rad
        for turret in range(0, 1210, 10)
    ]
    assert tilts[30] == tilts[0]
    assert tilts[0] == pytest.approx(math.radians(20.0))
    assert tilts[50] == pytest.approx(math.radians(40.0))
    assert tilts[90] == pytest.approx(math.radians(20.0))


def test_commands_stay_within_the_ranges() -> None:
    config = HeadConfig()
    for height in (-5.0, 5.0):
        offsets = [[0.5, 0.1, height], [0.5, -0.1, height], [0.5, 0.0, height]]
        command = HeadTracker(config).track(
            REST, heading_rad=2.0, offsets_m=offsets, biases_rad=(0.0, 0.0), lens=LENS
        )
        assert config.tilt_minimum_rad <= command.tilt_rad <= config.tilt_maximum_rad
        assert abs(command.pan_rad) <= config.pan_limit_rad


def test_what_is_centred_may_grow_a_little_beyond_what_would_be_chosen() -> None:
    tracker, centred = HeadTracker(HeadConfig()), []
    for aside_m in (1.02, 1.06, 1.07, 1.03):  # to the margin 1.0663 m, of which 96 % are 1.0236 m
        offsets = [[2.0, aside_m, 0.0], [2.0, 0.3, 0.0], [2.0, -aside_m, 0.0]]
        centred.append(abs(tracker.centre_leds(offsets, LENS)[0]) < 1e-9)
    assert centred == [True, True, False, False]


def test_another_pair_must_be_wider_by_five_degrees() -> None:
    tracker, middles = HeadTracker(HeadConfig()), []
    for width_deg in (30.0, 27.0, 26.0):  # 58 degrees of all three do not fit
        azimuths = np.radians([0.0, width_deg, 58.0])
        offsets = [[3.0 * math.cos(a), 3.0 * math.sin(a), 0.0] for a in azimuths]
        middles.append(math.degrees(tracker.centre_leds(offsets, LENS)[0]))
    assert middles == pytest.approx([15.0, 13.5, 42.0])


def test_a_turned_camera_is_aimed_at_the_middle_of_a_tag_that_is_held() -> None:
    config, tags = LocalizerConfig(), SIX_TAGS[:2]
    leds_m, known = config.landmark_array_m, {'camera_height_m': 1.1, 'calibrate': True}
    state = PoseFilter(config.filter, config.noise, leds_m=leds_m, tags=tags, **known)  # type: ignore[arg-type]
    state.start(Pose2(x_m=2.0, y_m=3.0, heading_rad=-1.5), np.eye(3))
    read = HeadAngles(turret_rad=0.1, pan_rad=0.0, tilt_rad=0.05)
    looks = HeadAngles(turret_rad=0.1, pan_rad=0.2, tilt_rad=0.15)
    tracker = HeadTracker(HeadConfig(), tags=2)
    command = tracker.follow(state, read, looks, LENS, held=[7, 8, 9, 10])
    away_m = math.hypot(0.7, 3.0)  # of the second tag, at (2.7, 0, 1.2)
    turn = math.atan2(-3.0, 0.7) + 1.5
    assert command.turret_rad == pytest.approx(turn - 0.2)
    assert command.pan_rad == pytest.approx(turn - 0.1 - 0.2)
    assert command.tilt_rad == pytest.approx(math.atan2(0.1, away_m) - 0.1)


@pytest.mark.parametrize(
    ('joints', 'turns', 'azimuth_deg', 'command_deg'),
    [
        (('pan_joint', 'tilt_joint'), (180.0, 0.0), 180.0, (0.0, 0.0)),
        (('pan_joint', 'tilt_joint'), (90.0, 0.0), 120.0, (30.0, 0.0)),
        (('pan_joint', 'tilt_joint'), (90.0, 0.0), -60.0, (-87.0, 0.0)),
        (('pan_joint', 'tilt_joint'), (0.0, -30.0), 0.0, (0.0, 30.0)),
        (('pan_joint',), (0.0, 25.0), 10.0, (10.0, 0.0)),
    ],
)
def test_the_joints_keep_to_their_limits_however_the_camera_is_turned_on_them(
    joints: tuple[str, ...],
    turns: tuple[float, float],
    azimuth_deg: float,
    command_deg: tuple[float, float],
) -> None:
    config, known = LocalizerConfig(), {'camera_height_m': 1.1, 'calibrate': True}
    led_m = [1.5 * math.cos(math.radians(azimuth_deg)), 1.5 * math.sin(math.radians(azimuth_deg))]
    leds_m = np.array([[2.0 + led_m[0], 2.0 + led_m[1], 1.1]])
    state = PoseFilter(config.filter, config.noise, leds_m=leds_m, **known)  # type: ignore[arg-type]
    state.start(Pose2(x_m=2.0, y_m=2.0, heading_rad=0.0), np.eye(3))
    pan_rad, tilt_rad = (math.radians(turn) for turn in turns)
    looks = HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=tilt_rad)
    command = HeadTracker(HeadConfig(), joints).follow(state, REST, looks, LENS, held=[0])
    assert math.degrees(command.pan_rad) == pytest.approx(command_deg[0], abs=0.1)
    assert math.degrees(command.tilt_rad) == pytest.approx(command_deg[1], abs=0.1)
