"""The localizer with the inputs of other people's robots, over DDS."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
import math
import time
from typing import Any

import cv2
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
from numpy.typing import NDArray
import pytest
from rcl_interfaces.msg import Log
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState

from goalreach_msgs_py.image_messages import compressed_image_to_raw, image_to_raw
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_to_raw
from goalreach_msgs_py.ros.messaging import LATCHED_QOS, RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.sensor_messages import camera_to_raw, head_to_raw
from goalreach_msgs_py.topics import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    ODOM,
    POSE,
)
from goalreach_msgs_py.values import HeadAngles, Pose2, Twist2
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig
from graphs import fresh_domain

MS = 1_000_000
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
START = (1.778, 3.6, -math.pi / 2)
GOOD_M = 0.05
KINDS = {
    IMAGE: (Image, RELIABLE_QOS),
    COMPRESSED_IMAGE: (CompressedImage, RELIABLE_QOS),
    CAMERA_INFO: (CameraInfo, RELIABLE_QOS),
    JOINT_STATES: (JointState, RELIABLE_QOS),
    ODOM: (Odometry, RELIABLE_QOS),
}

PATIENT_S = 2.0  # for the samples around an image, also on a machine that is busy


class Driver:
    """A robot's drivers: what they send is up to the test."""

    def __init__(self, robot: dict[str, Any]) -> None:
        config = SimulatorConfig(start_pose=START, camera_rate_hz=1000.0, **robot)
        self.simulator = Simulator(config, np.random.default_rng(2))
        self.node = Node('drivers', enable_rosout=False)
        self.publishers: dict[str, Any] = {}
        self.truth: dict[int, Pose2] = {}
        self.poses: list[PoseWithCovarianceStamped] = []
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.node.create_subscription(PoseWithCovarianceStamped, POSE, self.poses.append, 50)

    def offer(self, **profiles: QoSProfile) -> None:
        """Advertise topics; names are those of KINDS without slashes."""
        for topic, (kind, qos) in KINDS.items():
            profile = profiles.get(topic.split('/')[-1], qos)
            self.publishers[topic] = self.node.create_publisher(kind, topic, profile)

    def send(self, topic: str, raw: bytes) -> None:
        self.publishers[topic].publish(raw)

    @property
    def now_ns(self) -> int:
        return self.simulator.time_ns

    def sleep_until(self, time_ns: int) -> None:
        """Let the robot go on, at its last command."""
        while self.now_ns < time_ns:
            self.simulator.advance()

    def send_odometry(self, stamp_ns: int | None = None) -> None:
        odometry = self.simulator.robot.odometry
        stamp = self.now_ns if stamp_ns is None else stamp_ns
        self.send(ODOM, odometry_to_raw(odometry, stamp, frame_id='odom'))

    def send_joints(self, stamp_ns: int | None = None) -> None:
        pan, tilt = self.simulator.head.read()
        turret = self.simulator.robot.turret_joint_rad
        head = HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)
        self.send(JOINT_STATES, head_to_raw(head, self.now_ns if stamp_ns is None else stamp_ns))

    def send_camera(self, stamp_ns: int | None = None) -> None:
        stamp = self.now_ns if stamp_ns is None else stamp_ns
        self.send(CAMERA_INFO, camera_to_raw(self.simulator.config.calibrated_camera, stamp))

    def shoot(self) -> NDArray[np.uint8]:
        """Take an image, and remember where the robot was."""
        self.truth[self.now_ns] = self.simulator.robot.truth.pose
        return self.simulator.sense().image

    def spin(self, condition: Callable[[], bool], limit_s: float = 5.0) -> bool:
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self.executor.spin_once(timeout_sec=0.01)
        return True

    def has_poses(self, count: int) -> bool:
        return len(self.poses) >= count

    def errors_m(self) -> list[float]:
        """Return the errors of the poses that claim to be good."""
        errors = []
        for message in self.poses:
            estimate = estimate_from_raw(serialize_message(message))
            truth = self.truth[stamp_from_msg(message.header.stamp)]
            if estimate.covariance[0, 0] + estimate.covariance[1, 1] < GOOD_M**2:
                off_m = estimate.pose.x_m - truth.x_m, estimate.pose.y_m - truth.y_m
                errors.append(math.hypot(*off_m))
        return errors


@contextmanager
def listening(driver_of: Callable[[], Driver], **parameters: object) -> Iterator[Driver]:
    """Run the localizer with parameters, and the drivers; wait until they know each other."""
    words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    arguments = ['--ros-args', *words] if words else []
    rclpy.init(args=arguments, domain_id=fresh_domain())
    driver = driver_of()
    localizer = LandmarkLocalizerNode()
    driver.executor.add_node(localizer)
    try:
        taken = [sub.topic_name for sub in localizer.subscriptions if sub.topic_name in KINDS]
        assert driver.spin(
            lambda: (
                all(driver.publishers[topic].get_subscription_count() for topic in taken)
                and driver.node.count_publishers(POSE) > 0
            )
        )
        yield driver
    finally:
        driver.executor.shutdown()
        for node in (localizer, driver.node):
            node.destroy_node()
        rclpy.try_shutdown()


def offering(robot: dict[str, Any], **profiles: QoSProfile) -> Callable[[], Driver]:
    def make() -> Driver:
        driver = Driver(robot)
        driver.offer(**profiles)
        return driver

    return make


def foreign_image(encoding: str, grey: NDArray[np.uint8], stamp_ns: int) -> bytes:
    """Return a grey scene as a camera of that encoding sends it."""
    message = deserialize_message(image_to_raw(grey, stamp_ns), Image)
    pixels: NDArray[Any] = grey
    if encoding in ('bgr8', 'rgb8'):
        pixels = np.repeat(grey[..., None], 3, axis=2)
    elif encoding == 'mono16':
        pixels, message.is_bigendian = (grey.astype(np.uint16) << 8).astype('>u2'), 1
    elif encoding == 'yuv422':
        pixels = np.stack([np.full_like(grey, 128), grey], axis=2)
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(grey), -1)
    message.encoding, message.step = encoding, rows.shape[1]
    message.data = array('B', rows.tobytes())
    return bytes(serialize_message(message))


def stand_and_look(
    driver: Driver, picture: Callable[[NDArray[np.uint8], int], bytes], topic: str = IMAGE
) -> list[float]:
    """Send ten images, with all else at their stamps; return the errors of the good poses."""
    for tick in range(1, 11):
        driver.sleep_until(40 * MS * tick)
        stamp = driver.now_ns
        driver.send_camera()
        driver.send_odometry()
        if JOINT_STATES in driver.publishers:
            driver.send_joints()
        driver.send(topic, picture(driver.shoot(), stamp))
        assert driver.spin(partial(driver.has_poses, tick))
    return driver.errors_m()


@pytest.mark.parametrize(
    'encoding',
    ['mono8', '8UC1', 'mono16', 'bgr8', 'rgb8', 'yuv422', 'bayer_rggb8'],
)
def test_images_of_other_encodings(encoding: str) -> None:
    with listening(offering({})) as driver:
        errors = stand_and_look(driver, lambda grey, at: foreign_image(encoding, grey, at))
    assert len(errors) >= 7
    assert max(errors) < 0.04


def test_compressed_images() -> None:
    def png(grey: NDArray[np.uint8], stamp_ns: int) -> bytes:
        return compressed_image_to_raw(bytes(cv2.imencode('.png', grey)[1]), stamp_ns)

    with listening(offering({}), image_transport='compressed') as driver:
        lines: list[str] = []
        driver.node.create_subscription(Log, '/rosout', lambda log: lines.append(log.msg), 50)
        errors = stand_and_look(driver, png, COMPRESSED_IMAGE)
        silent = f'{COMPRESSED_IMAGE} (drivers): nothing for'

        def is_told() -> bool:
            driver.sleep_until(driver.now_ns + 1)
            driver.send_odometry()
            return any(line.startswith(silent) for line in lines)

        assert driver.spin(is_told), lines
    assert len(errors) >= 7
    assert max(errors) < 0.04


@pytest.mark.parametrize(
    'lens',
    [
        {'distortion_model': 'equidistant', 'distortion': (-0.02, 0.01, -0.004, 0.001)},
        {
            'distortion_model': 'rational_polynomial',
            'distortion': (1.2, 0.3, 0.001, -0.002, 0.01, 1.5, 0.5, 0.05),
        },
        {'image_width_px': 1920, 'image_height_px': 1080},
        {'image_width_px': 320, 'image_height_px': 240},
    ],
    ids=['equidistant', 'rational_polynomial', '1920x1080', '320x240'],
)
def test_other_lenses_and_sizes(lens: dict[str, Any]) -> None:
    with listening(offering(lens)) as driver:
        errors = stand_and_look(driver, image_to_raw)
    assert len(errors) >= 7
    assert max(errors) < 0.04


def test_a_fixed_camera_without_joint_states() -> None:
    with listening(offering({}), head='none') as driver:
        del driver.publishers[JOINT_STATES]
        errors = stand_and_look(driver, image_to_raw)
        commanders = driver.node.count_publishers(HEAD_COMMAND)
    assert len(errors) >= 7
    assert max(errors) < 0.04
    assert commanders == 0


def drive_by_own_clocks(
    driver: Driver, *, camera_late_ns: int = 0, info_beside_ns: int | None = None
) -> list[float]:
    """Drive 2.4 s in a bend: images at 25 Hz, odometry at 50 Hz, joints at 100 Hz, out of phase.

    Args:
        driver: The drivers.
        camera_late_ns: How much later than the exposure the stamps of the images are.
        info_beside_ns: Time from an image to its CameraInfo; None where it is sent once, latched.
    """
    simulator, film = driver.simulator, dict[int, bytes]()
    rng, answered = np.random.default_rng(5), 0
    due = {'image': 40 * MS, 'odom': 17 * MS, 'joints': 3 * MS}
    while simulator.time_ns < 2400 * MS:
        simulator.advance()
        now, moving = simulator.time_ns, simulator.time_ns > 600 * MS
        simulator.command_drive(
            Twist2(linear_m_per_s=0.4 * moving, steering_rad_per_s=0.3 * moving)
        )
        simulator.robot.turret.go(0.2 * moving)
        if now >= due['odom']:
            driver.send_odometry()
            due['odom'] += int(rng.integers(16, 25)) * MS
        if now >= due['joints']:
            driver.send_joints()
            due['joints'] += int(rng.integers(7, 14)) * MS
        if now >= due['image']:
            film[now + camera_late_ns] = image_to_raw(driver.shoot(), now + camera_late_ns)
            due['image'] += 40 * MS
        driver.truth[now] = simulator.robot.truth.pose
        if now - 30 * MS in film:  # the image comes later than the samples after its exposure
            driver.send(IMAGE, film.pop(now - 30 * MS))
            if info_beside_ns is not None:
                driver.send_camera(now - 30 * MS + info_beside_ns)
            assert driver.spin(partial(driver.has_poses, answered))
            answered += 1
    return driver.errors_m()


@pytest.mark.parametrize('info_beside_ns', [1000, -1000, 0])
def test_every_sensor_has_a_clock_of_its_own(info_beside_ns: int) -> None:
    drivers = offering({}, odom=BEST_EFFORT, joint_states=BEST_EFFORT)
    with listening(drivers, input_wait_s=PATIENT_S) as driver:
        errors = drive_by_own_clocks(driver, info_beside_ns=info_beside_ns)
    assert len(errors) >= 50
    assert np.percentile(errors, 95) < 0.033


def test_a_lens_that_was_latched_before_the_localizer_came() -> None:
    def make() -> Driver:
        driver = offering({}, camera_info=LATCHED_QOS)()
        driver.send_camera(0)
        return driver

    with listening(make, input_wait_s=PATIENT_S) as driver:
        errors = drive_by_own_clocks(driver)
    assert len(errors) >= 50
    assert np.percentile(errors, 95) < 0.033


def test_a_camera_whose_stamps_are_late() -> None:
    for told_s in (0.06, 0.0):
        given = {'camera_delay_s': told_s, 'input_wait_s': PATIENT_S}
        with listening(offering({}), **given) as driver:
            errors = drive_by_own_clocks(driver, camera_late_ns=60 * MS, info_beside_ns=0)
        assert len(errors) >= 40
        assert float(np.median(errors[-20:])) < 0.018
