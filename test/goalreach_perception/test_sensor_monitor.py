"""What is told of lights, from observations made by hand."""

import numpy as np

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation, Pose2, PoseEstimate
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerCounters, LocalizerOutput
from goalreach_perception.sensor_monitor import SensorMonitor

POSE = Pose2(x_m=1.8, y_m=4.0, heading_rad=-np.pi / 2)
CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=np.pi / 3)
SEEN = LandmarkObservation(u_px=1.0, v_px=1.0, peak_dn=200.0)
AHEAD, ASIDE = 0.0, 1.5


def told(
    monitor: SensorMonitor,
    images: int,
    *,
    seen: bool,
    pan_rad: float = AHEAD,
    time_ns: int = 0,
    odometry: Pose2 = POSE,
) -> list[str]:
    """Let images pass in which the first LED is seen or not; return what is told."""
    output = LocalizerOutput(
        estimate=PoseEstimate(pose=POSE, covariance=1e-4 * np.eye(3)),
        landmarks=(SEEN if seen else None, SEEN, SEEN),
        head_command=HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0),
        mode='tracking',
        reason='',
        counters=LocalizerCounters(),
    )
    lines = []
    for _ in range(images):
        lines += monitor.check(
            time_ns=time_ns,
            image=np.zeros((480, 640), np.uint8),
            camera=CAMERA,
            joints=HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=0.0),
            odometry=odometry,
            output=output,
        )
    return lines


def test_an_led_that_should_be_seen_and_is_not_is_told() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert told(monitor, 11, seen=False) == []
    assert told(monitor, 1, seen=False) == ['LED 0 is dark or hidden: not seen in 12 images']


def test_an_led_that_is_seen_again_is_not_told() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert told(monitor, 11, seen=False) + told(monitor, 1, seen=True) == []
    assert told(monitor, 11, seen=False) == []


def test_a_dark_led_that_leaves_the_view_is_counted_on_when_it_is_back() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert told(monitor, 8, seen=False) == []
    assert told(monitor, 30, seen=False, pan_rad=ASIDE) == []
    assert len(told(monitor, 4, seen=False)) == 1


def test_what_goes_on_is_told_once_in_a_second_and_what_happens_again_each_time() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    here, there = POSE, Pose2(x_m=0.5, y_m=2.0, heading_rad=0.0)
    jump = ['odometry jumped by 2.39 m']

    def at(milliseconds: int, odometry: Pose2) -> list[str]:
        return told(monitor, 1, seen=True, time_ns=milliseconds * 1_000_000, odometry=odometry)

    assert at(0, here) == []
    assert at(40, there) == jump
    assert at(640, here) == jump
    flickering = [at(time_ms, there if time_ms % 80 else here) for time_ms in range(680, 2680, 40)]
    assert [line for lines in flickering for line in lines] == 2 * jump
