import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_dashboard.ros.commands import (
    checked_choice,
    checked_pose,
    checked_speed,
)
from goalreach_learning.blending import MODES
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NOISE_PRESETS

ARENA = Arena()
_anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


@pytest.mark.parametrize(
    ('heading_deg', 'heading_rad'),
    [(-90, -math.pi / 2), (-180, math.pi), (270, -math.pi / 2), (45.0, math.pi / 4)],
)
def test_a_pose_is_given_in_metres_and_degrees(heading_deg: float, heading_rad: float) -> None:
    pose = checked_pose([1, 4.0, heading_deg], ARENA)
    assert (pose.x_m, pose.y_m) == (1.0, 4.0)
    assert pose.heading_rad == pytest.approx(heading_rad)


@given(_anything)
def test_whatever_a_browser_sends_is_refused_or_a_pose_on_the_floor(sent: object) -> None:
    try:
        pose = checked_pose(sent, ARENA)
    except ConfigurationError:
        return
    assert ARENA.is_free(pose.x_m, pose.y_m)


@pytest.mark.parametrize('speed', [None, '1', True, math.nan, math.inf, 0.0, 101.0, -1.0, [1.0]])
def test_a_bad_speed_is_refused(speed: object) -> None:
    with pytest.raises(ConfigurationError, match='speed'):
        checked_speed(speed)


def test_a_whole_speed_is_a_double() -> None:
    """A parameter of type double refuses an integer."""
    assert type(checked_speed(2)) is float


def test_names_must_be_known() -> None:
    for name, choices in (('mode', MODES), ('noise', NOISE_PRESETS)):
        assert checked_choice(name, choices[0], choices) == choices[0]
        for wrong in ('bold', '', None, 3, ['crisp']):
            with pytest.raises(ConfigurationError, match=name):
                checked_choice(name, wrong, choices)


def test_a_place_in_the_wall_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='on the free floor'):
        checked_pose([0.1, 2.0, 0.0], ARENA)
