"""Serialized messages over real DDS: as many bytes as rclpy sends, and bad ones are dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import Status, statuses_to_raw
from goalreach_msgs_py.image_messages import image_to_raw
from goalreach_msgs_py.pose_messages import twist_to_raw
from goalreach_msgs_py.ros.messaging import (
    RELIABLE_QOS,
    StampedReply,
    stamp_from_msg,
    stamp_to_msg,
    subscribe_raw,
)
from goalreach_msgs_py.sensor_messages import (
    bumpers_to_raw,
    camera_to_raw,
    clock_to_raw,
    head_to_raw,
)
from goalreach_msgs_py.values import HeadAngles, Twist2
from graphs import fresh_domain, join
from ros_objects import as_object

STAMP = 1_234_567_890_123
PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
HEAD = HeadAngles(turret_rad=0.1, pan_rad=-0.2, tilt_rad=0.3)
TWIST = Twist2(linear_m_per_s=0.25, steering_rad_per_s=-0.5)
CAMERA = PinholeCamera(
    width_px=320, height_px=200, fx_px=500.0, fy_px=510.0, cx_px=160.0, cy_px=100.0
)
STATUS = Status(name='a', message='bc', hardware_id='def', values={'g': '0.25'})
MESSAGES: list[tuple[type[Any], bytes]] = [
    (Clock, clock_to_raw(STAMP)),
    (Image, image_to_raw(PIXELS, STAMP)),
    (CameraInfo, camera_to_raw(CAMERA, STAMP)),
    (JointState, head_to_raw(HEAD, STAMP)),
    (LaserScan, bumpers_to_raw((False,) * 20, STAMP, body_radius_m=0.2, scan_time_s=0.04)),
    (TwistStamped, twist_to_raw(TWIST, STAMP)),
    (DiagnosticArray, statuses_to_raw([STATUS], STAMP)),
]


@pytest.fixture(name='node')
def _node() -> Iterator[Node]:
    join(fresh_domain())
    node = rclpy.create_node('listener')
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def test_bytes_are_as_many_as_rclpy_sends(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    for message_type, raw in MESSAGES:
        name = message_type.__name__
        heard: list[tuple[int, bytes]] = []
        publisher = node.create_publisher(message_type, name, RELIABLE_QOS)
        subscribe_raw(node, message_type, name, lambda *m, to=heard: to.append(m), RELIABLE_QOS)
        while not publisher.get_subscription_count():
            executor.spin_once(timeout_sec=0.1)
        publisher.publish(as_object(raw, message_type))
        publisher.publish(raw)
        while len(heard) < 2:
            executor.spin_once(timeout_sec=0.1)
        assert [stamp_ns for stamp_ns, _ in heard] == [STAMP, STAMP], name
        assert len(heard[0][1]) == len(heard[1][1]), name
        assert heard[1][1] == raw, name


@pytest.mark.parametrize(
    ('raw', 'reason'),
    [
        (b'\0\1\0\0\0', 'clock: a message of 5 bytes, which is too short'),
        (clock_to_raw(0), 'clock: level = 9: must be OK'),
    ],
)
def test_what_cannot_be_used_is_logged_and_dropped(
    node: Node, capfd: pytest.CaptureFixture[str], raw: bytes, reason: str
) -> None:
    heard: list[int] = []

    def hear(stamp_ns: int, _raw: bytes) -> None:
        if not stamp_ns:
            raise MessageError('level = 9: must be OK')
        heard.append(stamp_ns)

    subscribe_raw(node, Clock, 'clock', hear, RELIABLE_QOS)
    (subscription,) = node.subscriptions
    subscription.callback(raw)
    subscription.callback(clock_to_raw(STAMP))
    assert heard == [STAMP]
    assert reason in capfd.readouterr().err


class Publisher:
    """Keeps what is published."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def publish(self, raw: bytes) -> None:
        self.sent.append(raw)


def test_a_reply_is_sent_again_for_the_same_stamp() -> None:
    reply, first, second = StampedReply(), Publisher(), Publisher()
    publishers: list[Any] = [first, second]
    assert reply.begin(1)
    for publisher in publishers:
        reply.send(publisher, b'one')
    assert not reply.begin(1)
    assert reply.begin(2)
    reply.send(publishers[0], b'two')
    assert not reply.begin(2)
    assert first.sent == [b'one', b'one', b'two', b'two']
    assert second.sent == [b'one', b'one']


def test_stamp() -> None:
    assert (stamp_to_msg(STAMP).sec, stamp_to_msg(STAMP).nanosec) == (1234, 567890123)
    assert stamp_from_msg(stamp_to_msg(STAMP)) == STAMP
