from __future__ import annotations

from collections.abc import Iterator
import math
import time
from typing import Any

from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import Odometry
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from visualization_msgs.msg import ImageMarker

from goalreach_msgs_py.diagnostic_messages import WARN, statuses_from_raw
from goalreach_msgs_py.image_messages import image_to_raw
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_to_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.sensor_messages import camera_to_raw, head_to_raw, landmarks_from_raw
from goalreach_msgs_py.topics import CAMERA_INFO, IMAGE, JOINT_STATES, LANDMARK_MARKERS, ODOM
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig
from graphs import fresh_domain, join

GOOD_M2 = 0.3**2
PERIOD_NS = 40_000_000


class Publisher:
    """Keeps what a node publishes."""

    def __init__(self) -> None:
        self.sent: list[Any] = []

    def publish(self, message: object) -> None:
        self.sent.append(message)


class Bench:
    """A node, and what it says when it is handed messages."""

    def __init__(self, node: LandmarkLocalizerNode) -> None:
        self.node = node
        self.pose, self.diagnostics = Publisher(), Publisher()
        node._pose = self.pose
        node._diagnostics._publisher = self.diagnostics
        self.simulator = Simulator(SimulatorConfig(), np.random.default_rng(1))

    def messages(self) -> tuple[SensorFrame, dict[str, Any]]:
        self.simulator.advance()
        frame = self.simulator.sense()
        stamp_ns = frame.time_ns
        return frame, {
            topic: deserialize_message(raw, message_type)
            for topic, message_type, raw in (
                (IMAGE, Image, image_to_raw(frame.image, stamp_ns)),
                (CAMERA_INFO, CameraInfo, camera_to_raw(frame.camera, stamp_ns)),
                (JOINT_STATES, JointState, head_to_raw(frame.joints, stamp_ns)),
                (ODOM, Odometry, odometry_to_raw(frame.odometry, stamp_ns, frame_id='odom')),
            )
        }

    def hand(self, messages: dict[str, Any]) -> None:
        for topic, message in messages.items():
            stamp_ns = stamp_from_msg(message.header.stamp)
            self.node._collector(topic)(stamp_ns, serialize_message(message))

    def good_poses(self) -> int:
        spreads = [estimate_from_raw(raw).covariance[0, 0] for raw in self.pose.sent]
        return sum(int(spread < GOOD_M2) for spread in spreads)


@pytest.fixture(name='bench')
def _bench() -> Iterator[Bench]:
    join(fresh_domain())
    node = LandmarkLocalizerNode()
    try:
        yield Bench(node)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def spoil_encoding(messages: dict[str, Any]) -> None:
    messages[IMAGE].encoding = '32FC1'


def spoil_size(messages: dict[str, Any]) -> None:
    messages[IMAGE].height = 240


def spoil_joints(messages: dict[str, Any]) -> None:
    messages[JOINT_STATES].position = [0.0, math.nan, 0.0]


def spoil_odometry(messages: dict[str, Any]) -> None:
    messages[ODOM].pose.pose.position.x = math.inf


def test_good_messages_make_a_good_pose(bench: Bench) -> None:
    for _ in range(3):
        bench.hand(bench.messages()[1])
    assert len(bench.pose.sent) == 3
    assert bench.good_poses() >= 1


@pytest.mark.parametrize(
    ('spoil', 'reason'),
    [
        (spoil_encoding, "input refused: encoding = '32FC1': must be one of mono8"),
        (spoil_size, 'input refused: image of 640 x 240'),
        (spoil_joints, 'input refused: pan_joint = nan'),
        (spoil_odometry, 'input refused: pose = (inf'),
    ],
)
def test_messages_that_cannot_be_used_make_no_pose_and_one_diagnostic(
    bench: Bench, spoil: Any, reason: str
) -> None:
    for _ in range(25):
        _, messages = bench.messages()
        spoil(messages)
        bench.hand(messages)
    assert bench.pose.sent == []
    (raw,) = bench.diagnostics.sent
    (status,) = statuses_from_raw(raw)
    assert status.message.startswith(reason)
    assert status.level == WARN


def test_a_repeated_stamp_gets_its_reply_again_but_not_what_was_refused_since(
    bench: Bench,
) -> None:
    _, good = bench.messages()
    bench.hand(good)
    reply = bench.diagnostics.sent.copy()
    assert len(reply) == 1
    _, bad = bench.messages()
    spoil_odometry(bad)
    for _ in range(50):
        bench.hand({ODOM: bad[ODOM]})
    refused = bench.diagnostics.sent[1:]
    assert len(refused) == 2
    bench.hand(good)
    assert bench.pose.sent == 2 * bench.pose.sent[:1]
    assert bench.diagnostics.sent == reply + refused + reply


@pytest.mark.parametrize(
    ('remapped', 'heard'),
    [
        ((), '/robot1/camera/image_raw/compressed'),
        (('-r', 'camera/image_raw:=/usb_cam/image_raw'), '/usb_cam/image_raw/compressed'),
        (('-r', 'camera/image_raw:=/robot10/image'), '/robot10/image/compressed'),
        (('-r', 'camera/image_raw:=front/image'), '/robot1/front/image/compressed'),
    ],
)
def test_compressed_images_are_beside_the_images_wherever_these_are(
    remapped: tuple[str, ...], heard: str
) -> None:
    given = ['-r', '__ns:=/robot1', *remapped, '-p', 'image_transport:=compressed']
    rclpy.init(args=['--ros-args', *given], domain_id=fresh_domain())
    try:
        node = LandmarkLocalizerNode()
        kinds = {end.topic_name: end.msg_type for end in node.subscriptions}
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    assert [topic for topic, kind in kinds.items() if kind is CompressedImage] == [heard]
    assert Image not in kinds.values()


def test_without_odometry_of_its_time_an_image_makes_no_pose(bench: Bench) -> None:
    _, stale = bench.messages()
    bench.hand(stale)
    said = len(bench.pose.sent)
    for _ in range(30):
        _, messages = bench.messages()
        messages[ODOM] = stale[ODOM]
        bench.hand(messages)
    assert len(bench.pose.sent) <= said + 2  # those within the stated wait
    assert bench.node._inputs.missing[ODOM] > 20


def test_viewers_get_a_dot_for_each_detected_led(bench: Bench) -> None:
    seen = Publisher()
    bench.node._landmarks = seen
    heard: list[ImageMarker] = []
    viewer = Node('viewer', enable_rosout=False)
    viewer.create_subscription(ImageMarker, LANDMARK_MARKERS, heard.append, RELIABLE_QOS)
    executor = SingleThreadedExecutor()
    executor.add_node(viewer)
    try:
        deadline_s = time.monotonic() + 10.0
        while not bench.node._markers.get_subscription_count() and time.monotonic() < deadline_s:
            executor.spin_once(timeout_sec=0.05)
        for _ in range(3):
            bench.hand(bench.messages()[1])
        while len(heard) < len(seen.sent) and time.monotonic() < deadline_s:
            executor.spin_once(timeout_sec=0.05)
    finally:
        executor.shutdown()
        viewer.destroy_node()
    assert len(heard) == len(seen.sent) == 3
    for marker, raw in zip(heard, seen.sent, strict=True):
        message = deserialize_message(raw, PolygonStamped)
        leds = [led for led in landmarks_from_raw(raw) if led is not None]
        assert marker.header == message.header
        assert [(dot.x, dot.y) for dot in marker.points] == [
            (pytest.approx(led.u_px, abs=1e-3), pytest.approx(led.v_px, abs=1e-3)) for led in leds
        ]
        assert len(marker.outline_colors) == len(leds) > 0
