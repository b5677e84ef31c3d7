"""Spots near predicted landmarks: where they are sought, and which are assigned."""

from __future__ import annotations

import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.detection import Spots
from goalreach_perception.landmark_tracking import (
    MatchedLeds,
    correct_by,
    find_predicted,
    tags_near,
)
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import Lens, Optics
from goalreach_perception.measurement_prediction import Prediction
from goalreach_perception.pose_filter import PoseFilter
from tag_images import SIX_TAGS

OPTICS = Optics(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
AT = [(100.0, 100.0), (200.0, 200.0), (300.0, 100.0)]
Pixels = list[tuple[float, float]]


def spots_at(places: Pixels) -> Spots:
    good, pixels_px = [True] * len(places), np.array(places).reshape(-1, 2)
    return Spots(pixels_px, np.ones(len(places)), [99] * len(places), good, good)


def predicted(places: Pixels, uv: float = 0.0, depth_m: float = 2.0) -> Prediction:
    covariance: FloatArray = np.kron(np.eye(len(places)), np.array([[4.0, uv], [uv, 1.0]]))
    return Prediction(np.array(places), [depth_m] * len(places), covariance, covariance)


def find(prediction: Prediction, *seen: Pixels, gate: float = 16.0) -> tuple[MatchedLeds, Mock]:
    """Return what is found where the detector sees these spots first, then those."""
    detector = Mock(**{'in_windows.side_effect': [*map(spots_at, seen), Spots.unknown(1)]})
    options: dict[str, Any] = {
        'gate': gate,
        'window_half_px': 20,
        'streak_px': 0.0,
        'optics': OPTICS,
    }
    image = np.zeros((480, 640), np.uint8)
    return find_predicted(image, prediction, detector=detector, **options), detector.in_windows


@pytest.mark.parametrize(
    ('from_border_px', 'sought', 'expected'),
    [(-8.5, False, 0), (-7.5, True, 0), (13.5, True, 0), (14.5, True, 1)],  # 4 sigmas and 6 px
)
def test_a_landmark_is_sought_where_it_may_be_and_expected_where_it_must_be(
    from_border_px: float, *, sought: bool, expected: int
) -> None:
    b = from_border_px
    for place in ((b, 100.0), (640.0 - b, 100.0), (100.0, b), (100.0, 480.0 - b)):
        found, looked = find(predicted([place]), [place] * sought)
        assert looked.call_args_list[0].args[2] == [28] * sought
        assert found.expected == expected
    assert find(predicted(AT, depth_m=0.06), [])[0].expected == 0


@pytest.mark.parametrize(('across', 'distance2'), [(3.0, 26.0 / 9.0), (-3.0, 50.0 / 9.0)])
def test_the_gate_knows_that_errors_are_correlated(across: float, distance2: float) -> None:
    # With 1 px^2 of the spot itself (5, 1; 1, 2), whose determinant is 9.
    for gate, leds in ((distance2 + 0.01, [0]), (distance2 - 0.01, [])):
        found, _ = find(predicted(AT[:1], uv=1.0), [(100.0 + across, 102.0)], gate=gate)
        assert found.leds.tolist() == leds


def test_where_the_brightest_spot_is_elsewhere_the_second_brightest_counts() -> None:
    found, looked = find(predicted(AT), [AT[0], (215.0, 200.0), AT[2]], [(201.0, 200.0)])
    assert looked.call_args.args[1:] == ([[200.0, 200.0]], [28])
    assert looked.call_args.kwargs['skip_px'] == [[215.0, 200.0]]
    assert found.leds.tolist() == [0, 2, 1]
    assert found.pixels_px[2].tolist() == [201.0, 200.0]


@pytest.mark.parametrize(('apart_px', 'leds'), [(4.0, [2]), (4.1, [0, 1, 2])])
def test_one_spot_of_two_leds_is_that_of_neither(apart_px: float, leds: list[int]) -> None:
    places = [AT[0], (100.0, 100.0 + apart_px), AT[2]]
    assert find(predicted(places), places)[0].leds.tolist() == leds


def test_a_tag_with_a_corner_elsewhere_is_left_out_as_a_whole() -> None:
    places = [(100.0 + 40.0 * k, 100.0 + 9.0 * k) for k in range(8)]
    seen = spots_at([places[0], (150.0, 150.0), *places[2:]])
    near = tags_near(MatchedLeds(np.arange(8), seen, seen.pixels_px, 8), predicted(places), 16.0)
    assert (near.leds.tolist(), near.concatenated(near).expected) == ([4, 5, 6, 7], 16)


def test_of_a_tag_and_a_light_that_contradict_each_other_the_tag_is_right() -> None:
    """A tag carries its number; a lamp beside an LED looks as the LED does."""
    config, lens = LocalizerConfig(), Lens.of_camera(OPTICS.camera)
    known = {'leds_m': np.array([[0.0, 2.2, 1.1]]), 'camera_height_m': 1.1, 'calibrate': True}
    state = PoseFilter(config.filter, config.noise, tags=SIX_TAGS[5:], **known)  # type: ignore[arg-type]
    state.start(Pose2(x_m=2.0, y_m=2.5, heading_rad=math.pi), np.diag([1e-5, 1e-5, 4e-4]))
    ahead = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
    prediction = state.predict_leds(lens, ahead)
    off_px = np.array([[15.0, 0.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, 1.0]])
    seen = spots_at([(u_px, v_px) for u_px, v_px in prediction.pixels_px + off_px])
    found = MatchedLeds(np.arange(5), seen, seen.pixels_px, 5)
    used = correct_by(state, prediction, found, 1)
    assert used is not None
    assert used.leds.tolist() == [1, 2, 3, 4]
