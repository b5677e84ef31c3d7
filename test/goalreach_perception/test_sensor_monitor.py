"""Reports of sensor faults, from observations made by hand."""

import math

import numpy as np
from numpy.typing import NDArray
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.tags import Tag, tags_to_flat
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation, Pose2, PoseEstimate
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerCounters, LocalizerOutput
from goalreach_perception.measurement_model import CameraMount
from goalreach_perception.sensor_monitor import SensorMonitor
from tag_images import tag_image

POSE = Pose2(x_m=1.8, y_m=4.0, heading_rad=-np.pi / 2)
CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=np.pi / 3)
SEEN = LandmarkObservation(u_px=1.0, v_px=1.0, peak_dn=200.0)
AHEAD, ASIDE = 0.0, 1.5
DARK: NDArray[np.uint8] = np.zeros((480, 640), np.uint8)


def reported(
    monitor: SensorMonitor,
    images: int,
    *,
    seen: bool,
    pan_rad: float = AHEAD,
    time_ns: int = 0,
    odometry: Pose2 = POSE,
    pose: Pose2 = POSE,
    image: NDArray[np.uint8] = DARK,
    lost: int = 0,
    acquired: int = 0,
    others: LandmarkObservation = SEEN,
    behind: int = 0,
) -> list[str]:
    """Process images in which the first LED is detected or not; return the reports."""
    output = LocalizerOutput(
        estimate=PoseEstimate(pose=pose, covariance=1e-4 * np.eye(3)),
        landmarks=(SEEN if seen else None, others, others, *[None] * behind),
        mode='tracking',
        seen_from=(POSE, HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=0.0)),
        reason='no light',
        counters=LocalizerCounters(lost=lost, acquired=acquired),
    )
    lines = []
    for _ in range(images):
        lines += monitor.check(
            time_ns=time_ns,
            image=image,
            camera=CAMERA,
            odometry=odometry,
            output=output,
        )
    return lines


def light_at(u_px: float, v_px: float) -> NDArray[np.uint8]:
    rows, columns = np.indices(DARK.shape)
    distance2 = (columns - u_px) ** 2 + (rows - v_px) ** 2
    image: NDArray[np.uint8] = (200.0 * np.exp(-distance2 / (2.0 * 1.2**2))).astype(np.uint8)
    return image


def test_a_predicted_led_that_is_not_detected_is_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 11, seen=False) == []
    assert reported(monitor, 1, seen=False) == ['LED 0 is dark or hidden: not seen in 12 images']


def test_an_led_beside_its_place_is_told_from_a_dark_one() -> None:
    config = LocalizerConfig()
    joints = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
    seen_m = CameraMount(config.mount).points_in_camera(config.landmark_array_m, POSE, joints)
    u_px, v_px = CAMERA.project(seen_m)[0]

    def of(away_px: float, others: LandmarkObservation = SEEN) -> list[str]:
        image = light_at(u_px, v_px + away_px)
        return reported(SensorMonitor(config), 12, seen=False, image=image, others=others)

    assert of(6.0) == ['LED 0 is seen 6 px off: check landmarks_m, camera_mount, camera_info']
    dark = ['LED 0 is dark or hidden: not seen in 12 images']
    assert of(14.0) == dark
    assert of(6.0, LandmarkObservation(u_px=u_px, v_px=v_px + 6.3, peak_dn=200.0)) == dark


def test_a_camera_that_looks_aside_expects_leds_there() -> None:
    mount = (0.0, 0.0, 1.1, 0.0, 0.0, ASIDE)
    monitor = SensorMonitor(LocalizerConfig(camera_mount=mount))
    assert reported(monitor, 12, seen=False, pan_rad=AHEAD) == []
    assert len(reported(monitor, 12, seen=False, pan_rad=-ASIDE)) == 1


def test_an_led_that_is_detected_again_is_not_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 11, seen=False) + reported(monitor, 1, seen=True) == []
    assert reported(monitor, 11, seen=False) == []


def test_the_count_of_a_dark_led_goes_on_when_it_is_back_in_view() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 8, seen=False) == []
    assert reported(monitor, 30, seen=False, pan_rad=ASIDE) == []
    assert len(reported(monitor, 4, seen=False)) == 1


def test_a_fault_that_lasts_or_recurs_is_reported_once_a_second() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    here, there = POSE, Pose2(x_m=0.5, y_m=2.0, heading_rad=0.0)
    jump = ['odometry jumped by 2.39 m, 90 degrees']

    def at(milliseconds: int, odometry: Pose2) -> list[str]:
        return reported(monitor, 1, seen=True, time_ns=milliseconds * 1_000_000, odometry=odometry)

    assert at(0, here) == []
    assert at(40, there) == jump
    assert at(1640, here) == jump
    flickering = [
        at(time_ms, there if time_ms % 80 else here) for time_ms in range(1680, 3680, 40)
    ]
    assert [line for lines in flickering for line in lines] == 2 * jump


@pytest.mark.parametrize('rate_hz', [10, 15, 25, 100])
@pytest.mark.parametrize('seen', [False, True])
def test_a_lasting_fault_is_reported_once_a_second_at_any_rate(
    rate_hz: int, *, seen: bool
) -> None:
    monitor = SensorMonitor(LocalizerConfig())
    image = light_at(100.0, 400.0) if seen else DARK
    times_ns = [k * 1_000_000_000 // rate_hz for k in range(7 * rate_hz)]
    told_ns = [at for at in times_ns if reported(monitor, 1, seen=seen, image=image, time_ns=at)]
    assert len(told_ns) >= 3
    assert min(np.diff(told_ns)) >= 1_000_000_000
    assert max(np.diff(told_ns)) < 2_000_000_000


@pytest.mark.parametrize(
    ('moved_m', 'turned_rad', 'dt_ms', 'told'),
    [
        (0.12, 0.0, 200, ''),  # 0.6 m/s, less than the robot's 24 in/s
        (0.12, 0.0, 40, 'odometry jumped by 0.12 m, 0 degrees'),
        (0.06, 0.0, 10, 'odometry jumped by 0.06 m, 0 degrees'),
        (0.0, 0.2, 200, ''),  # 1 rad/s, less than 60 deg/s
        (0.0, 0.5, 40, 'odometry jumped by 0.00 m, 29 degrees'),
    ],
)
def test_odometry_jumps_where_it_is_faster_than_the_robot(
    moved_m: float, turned_rad: float, dt_ms: int, told: str
) -> None:
    monitor, lines = SensorMonitor(LocalizerConfig()), []
    for k in range(2):
        there = Pose2(x_m=1.8, y_m=4.0 - moved_m * k, heading_rad=math.pi - turned_rad * k)
        at_ns = dt_ms * k * 1_000_000
        lines += reported(monitor, 1, seen=True, odometry=there, pose=there, time_ns=at_ns)
    assert lines == ([told] if told else [])


def test_a_lost_pose_is_reported_with_its_reason_and_a_replaced_one() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 2, seen=True, acquired=1) == []
    assert reported(monitor, 2, seen=True, acquired=1, lost=1) == ['the pose was lost: no light']
    assert reported(monitor, 2, seen=True, acquired=2, lost=1) == []
    replaced = ['the pose was replaced by another that fits the image']
    assert reported(monitor, 1, seen=True, acquired=3, lost=1) == replaced


def test_a_pose_lost_again_and_again_where_the_odometry_stands_tells_of_the_odometry() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    second = 2_000_000_000
    lost = [reported(monitor, 1, seen=True, lost=n, time_ns=n * second)[0] for n in (1, 2, 3, 4)]
    standing = 'odometry stands still while the LEDs show motion'
    first = lost.index(standing)
    assert first > 0
    assert set(lost[:first]) == {'the pose was lost: no light'}
    assert set(lost[first:]) == {standing}
    moved = Pose2(x_m=POSE.x_m, y_m=POSE.y_m - 0.01, heading_rad=POSE.heading_rad)
    again = reported(monitor, 1, seen=True, lost=5, time_ns=5 * second, odometry=moved)
    assert again == ['the pose was lost: no light']


def test_poses_that_move_without_the_odometry_are_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    lines: list[str] = []
    for image in range(20):
        pose = Pose2(x_m=POSE.x_m, y_m=POSE.y_m - 0.02 * image, heading_rad=POSE.heading_rad)
        lines += reported(monitor, 1, seen=True, pose=pose, time_ns=image * 40_000_000)
    assert len(lines) == 1
    assert lines[0].startswith('odometry stands still while the LEDs show 0.2')
    driven = SensorMonitor(LocalizerConfig())
    for image in range(20):
        pose = Pose2(x_m=POSE.x_m, y_m=POSE.y_m - 0.02 * image, heading_rad=POSE.heading_rad)
        at_ns = image * 40_000_000
        assert reported(driven, 1, seen=True, pose=pose, odometry=pose, time_ns=at_ns) == []


def test_a_light_that_stays_where_no_led_is_expected_is_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    spot = light_at(100.0, 400.0)
    lines = [reported(monitor, 1, seen=True, image=spot) for _ in range(120)]
    assert [line for of in lines for line in of] == ['spurious light, no LED, at pixel 100, 400']
    once = SensorMonitor(LocalizerConfig())
    scans = [spot if number < 15 else DARK for number in range(120)]
    assert [line for image in scans for line in reported(once, 1, seen=True, image=image)] == []


def test_a_light_is_told_from_leds_also_where_one_is_behind_the_camera() -> None:
    leds_m = (*LocalizerConfig().landmarks_m, 1.8, 5.0, 1.5)
    monitor = SensorMonitor(LocalizerConfig(landmarks_m=leds_m))
    lines = reported(monitor, 20, seen=True, image=light_at(100.0, 400.0), behind=1)
    assert lines == ['spurious light, no LED, at pixel 100, 400']


def test_the_cells_of_a_tag_far_away_are_no_light() -> None:
    far = Tag(id=3, size_m=0.13, x_m=1.3, y_m=0.0, z_m=1.4, facing_rad=np.pi / 2)
    image = tag_image([far], POSE, np.random.default_rng(1), camera=CAMERA)
    (line,) = reported(SensorMonitor(LocalizerConfig()), 20, seen=True, image=image)
    assert line.startswith('spurious light')
    hung = SensorMonitor(LocalizerConfig(tags=tags_to_flat([far])))
    assert reported(hung, 20, seen=True, image=image) == []
    lamp = np.maximum(image, light_at(100.0, 400.0))
    assert reported(hung, 20, seen=True, image=lamp, time_ns=1) == [
        'spurious light, no LED, at pixel 100, 400'
    ]
