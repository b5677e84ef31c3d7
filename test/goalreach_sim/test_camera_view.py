import math

import numpy as np
import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.camera_view import (
    CameraPose,
    CameraView,
    emission,
    emission_axes,
    emission_exponent,
    is_hidden,
)

Distortion = tuple[float, float, float, float, float]
IDEAL: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)


def post(x_m: float, y_m: float, radius_m: float, height_m: float) -> list[Obstacle]:
    return [Obstacle(x_m=x_m, y_m=y_m, radius_m=radius_m, height_m=height_m)]


def make_camera(distortion: Distortion = IDEAL) -> PinholeCamera:
    return PinholeCamera(fx_px=500.0, fy_px=500.0, cx_px=320.0, cy_px=240.0, distortion=distortion)


def make_pose(
    azimuth_rad: float = 0.0,
    *,
    azimuth_rad_per_s: float = 0.0,
    tilt_rad_per_s: float = 0.0,
    speed_m_per_s: float = 0.0,
) -> CameraPose:
    """Return the pose at the origin, 1 m high, in the direction of +x."""
    return CameraPose(
        centre_m=np.array([0.0, 0.0, 1.0]),
        azimuth_rad=azimuth_rad,
        tilt_rad=0.0,
        velocity_m_per_s=np.array([speed_m_per_s, 0.0, 0.0]),
        azimuth_rad_per_s=azimuth_rad_per_s,
        tilt_rad_per_s=tilt_rad_per_s,
    )


def led(y_m: float, z_m: float) -> FloatArray:
    return np.array([[2.0, y_m, 1.0 + z_m]])


def test_left_and_up_by_hand() -> None:
    # 0.4 m to the left and 0.2 m up at 2 m: 100 px left of and 50 px over the middle.
    view = CameraView(make_camera(), led(0.4, 0.2))
    assert view.pixels(make_pose())[0] == pytest.approx((220.0, 190.0), abs=1e-9)


def test_a_base_that_is_not_level_by_hand() -> None:
    # Leaning 0.01 rad forward, about +y, the camera sees what is 2 m ahead 0.02 m further up;
    # leaning to the right, about +x, what is 0.2 m up is 0.002 m further left.
    view, pose = CameraView(make_camera(), led(0.0, 0.2)), make_pose()
    forward, right = pose._replace(level_rad=(0.0, 0.01)), pose._replace(level_rad=(0.01, 0.0))
    depth_m = 2.0 - 0.01 * 0.2
    assert view.pixels(forward)[0] == pytest.approx((320.0, 240.0 - 500.0 * 0.22 / depth_m))
    assert view.pixels(right)[0] == pytest.approx((320.0 - 500.0 * 0.002 / 2.0, 190.0))


def test_distortion_by_hand() -> None:
    # x = -0.2, y = -0.1: r^2 = 0.05, so 1 + 0.1 r^2 = 1.005.
    view = CameraView(make_camera((0.1, 0.0, 0.0, 0.0, 0.0)), led(0.4, 0.2))
    assert view.pixels(make_pose())[0] == pytest.approx((219.5, 189.75), abs=1e-9)


def test_a_barrel_lens_hides_points_far_outside() -> None:
    # With k1 = -0.3 the radius turns back at tan = sqrt(1 / 0.9) = 1.05; at tan = 1.8 it would
    # be 1.8 (1 - 0.972) = 0.05, in the middle of the image.
    view = CameraView(make_camera((-0.3, 0.0, 0.0, 0.0, 0.0)), led(3.6, 0.0))
    assert math.isnan(view.pixels(make_pose())[0][0])


def test_points_behind_are_invisible() -> None:
    view = CameraView(make_camera(), led(0.0, 0.0))
    assert all(math.isnan(value) for value in view.pixels(make_pose(math.pi))[0])


def test_hidden_led() -> None:
    view = CameraView(make_camera(), led(0.0, 0.0))
    view.obstacles = post(1.0, 0.0, 0.1, 2.0)
    assert math.isnan(view.pixels(make_pose())[0][0])


def test_a_moving_camera_at_another_time_than_the_stamp() -> None:
    # 20 ms before the stamp: at 1 rad/s the camera looked 20 mrad further right, so that the LED
    # straight ahead lies further left; at 0.5 m/s it was 10 mm further away.
    ahead = CameraView(make_camera(), led(0.0, 0.0))
    u_px, v_px = ahead.pixels(make_pose(azimuth_rad_per_s=1.0), -0.02)[0]
    assert u_px == pytest.approx(320.0 - 500.0 * math.tan(0.02), abs=1e-9)
    assert v_px == pytest.approx(240.0, abs=1e-9)
    _, v_px = ahead.pixels(make_pose(tilt_rad_per_s=1.0), -0.02)[0]
    assert v_px == pytest.approx(240.0 - 500.0 * math.tan(0.02), abs=1e-9)
    aside = CameraView(make_camera(), led(0.4, 0.2))
    u_px, v_px = aside.pixels(make_pose(speed_m_per_s=0.5), -0.02)[0]
    assert u_px == pytest.approx(320.0 - 500.0 * 0.4 / 2.01, abs=1e-9)
    assert v_px == pytest.approx(240.0 - 500.0 * 0.2 / 2.01, abs=1e-9)


def test_leds_of_the_goal_wall_shine_along_y() -> None:
    arena = Arena()
    axes = emission_axes(np.array(arena.landmarks_m), arena.width_m, arena.length_m)
    assert axes.tolist() == [[0.0, 1.0, 0.0]] * 3


def test_leds_of_the_other_walls_shine_inwards() -> None:
    leds = np.array([[0.1, 3.0, 1.0], [3.9, 3.0, 1.0], [2.0, 5.9, 1.0]])
    axes = emission_axes(leds, 4.0, 6.0)
    assert axes.tolist() == [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


def test_half_as_strong_at_the_half_angle() -> None:
    half_rad = math.radians(60)
    exponent = emission_exponent(half_rad)
    assert emission(1.0, exponent) == 1.0
    assert emission(math.cos(half_rad), exponent) == pytest.approx(0.5, abs=1e-12)
    assert emission(-1.0, exponent) == 0.0
    # At a right angle: cos(45 deg)^4.819 with 4.819 = ln 2 / -ln cos 30 deg.
    assert emission(0.0, exponent) == pytest.approx(0.1882, abs=1e-4)


CAMERA_M = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ('place', 'hidden'),
    [
        ((2.0, 0.0, 0.1, 2.0), True),
        ((2.0, 0.09, 0.1, 2.0), True),
        ((2.0, 0.11, 0.1, 2.0), False),
        ((-2.0, 0.0, 0.1, 2.0), False),
        ((5.0, 0.0, 0.1, 2.0), False),
        # The line of sight rises 0.25 m per metre: 1.475 m high where it meets the post.
        ((2.0, 0.0, 0.1, 1.48), True),
        ((2.0, 0.0, 0.1, 1.47), False),
    ],
)
def test_post_by_hand(place: tuple[float, float, float, float], hidden: bool) -> None:  # noqa: FBT001 - a parameter of the test
    assert is_hidden(CAMERA_M, (4.0, 0.0, 2.0), post(*place)) is hidden


def test_an_led_straight_above_is_not_hidden() -> None:
    assert not is_hidden(CAMERA_M, (0.0, 0.0, 2.0), post(0.0, 0.0, 0.1, 3.0))
