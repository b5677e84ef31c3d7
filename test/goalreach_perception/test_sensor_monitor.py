"""Reports of sensor faults, from observations made by hand."""

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


def reported(
    monitor: SensorMonitor,
    images: int,
    *,
    seen: bool,
    pan_rad: float = AHEAD,
    time_ns: int = 0,
    odometry: Pose2 = POSE,
) -> list[str]:
    """Process images in which the first LED is detected or not; return the reports."""
    output = LocalizerOutput(
        estimate=PoseEstimate(pose=POSE, covariance=1e-4 * np.eye(3)),
        landmarks=(SEEN if seen else None, SEEN, SEEN),
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


def test_a_predicted_led_that_is_not_detected_is_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 11, seen=False) == []
    assert reported(monitor, 1, seen=False) == ['LED 0 is dark or hidden: not seen in 12 images']


def test_an_led_that_is_detected_again_is_not_reported() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 11, seen=False) + reported(monitor, 1, seen=True) == []
    assert reported(monitor, 11, seen=False) == []


def test_the_count_of_a_dark_led_goes_on_when_it_is_back_in_view() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    assert reported(monitor, 8, seen=False) == []
    assert reported(monitor, 30, seen=False, pan_rad=ASIDE) == []
    assert len(reported(monitor, 4, seen=False)) == 1


def test_a_lasting_fault_is_reported_once_a_second_and_a_recurring_one_each_time() -> None:
    monitor = SensorMonitor(LocalizerConfig())
    here, there = POSE, Pose2(x_m=0.5, y_m=2.0, heading_rad=0.0)
    jump = ['odometry jumped by 2.39 m']

    def at(milliseconds: int, odometry: Pose2) -> list[str]:
        return reported(monitor, 1, seen=True, time_ns=milliseconds * 1_000_000, odometry=odometry)

    assert at(0, here) == []
    assert at(40, there) == jump
    assert at(640, here) == jump
    flickering = [at(time_ms, there if time_ms % 80 else here) for time_ms in range(680, 2680, 40)]
    assert [line for lines in flickering for line in lines] == 2 * jump
