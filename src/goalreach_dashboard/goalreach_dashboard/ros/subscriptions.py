"""Subscriptions that the live page polls when it draws, and the camera image among them.

The page draws 20 frames a second, whatever the graph's rate. The middleware keeps the newest
messages of each topic: messages that are never shown are never deserialized, and rates are
computed from the publishers' sequence numbers.
"""

import base64
from collections import OrderedDict
import math
import time
from typing import Any, Final

import cv2
import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CompressedImage, Image

from goalreach_dashboard.state import CameraPicture, Landmarks
from goalreach_msgs_py import topics
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.sensor_messages import (
    compressed_image_from_raw,
    image_from_raw,
    landmarks_from_raw,
)


def best_effort(depth: int) -> QoSProfile:
    """Return the profile of a subscription that keeps the newest messages and may lose some."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


class PolledSubscription:
    """A subscription whose messages are taken on demand, without an executor.

    Use it where only the newest messages matter and the reader has a rate of its own.

    Args:
        node: A node that no executor spins.
        message_type: Type of the messages.
        topic: Name of the topic.
        qos: Quality of service; its depth is the number of messages kept.

    Attributes:
        topic: Name of the topic.
        number: Sequence number of the last message, as its publisher counts; where a topic has
            several publishers, the number of messages taken.
    """

    def __init__(self, node: Node, message_type: type[Any], topic: str, qos: QoSProfile) -> None:
        self.topic = topic
        self.number = 0
        self._node = node
        self._taken = 0
        self._subscription = node.create_subscription(message_type, topic, _ignore, qos, raw=True)

    def take(self) -> list[bytes]:
        """Return the serialized messages received since the last call, oldest first."""
        messages: list[bytes] = []
        subscription = self._subscription
        with subscription.handle:
            while True:
                taken = subscription.handle.take_message(subscription.msg_type, True)
                if taken is None:
                    break
                message, info = taken
                messages.append(message)
                self.number = info.get('publication_sequence_number')
        self._taken += len(messages)
        if not self.number or subscription.get_publisher_count() > 1:
            self.number = self._taken
        return messages

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)


def _ignore(_message: object) -> None:
    """Satisfy rclpy, which requires a callback; no executor ever calls it."""


_JPEG_QUALITY: Final = 70
_LANDMARK_STAMPS: Final = 128
_IMAGE_PERIOD_S: Final = 0.1
_IMAGE_TOLERANCE_S: Final = 0.03
"""Images arrive ten times a second; which 50 ms frame of the page finds one varies."""
_LANDMARK_TIMEOUT_S: Final = 0.5
"""Longest wait for the detections of an image. Chosen."""
_PNG_SIGNATURE: Final = b'\x89PNG'


def camera_picture(encoded: bytes, landmarks: Landmarks, stamp_ns: int) -> CameraPicture:
    """Return an encoded image as the page shows it.

    Args:
        encoded: JPEG or PNG.
        landmarks: LEDs detected in this image; empty where unknown.
        stamp_ns: Stamp of the image, nanoseconds.

    Raises:
        MessageError: OpenCV cannot decode the image.
    """
    image = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise MessageError(f'compressed image of {len(encoded)} bytes: not JPEG or PNG')
    kind = 'png' if encoded.startswith(_PNG_SIGNATURE) else 'jpeg'
    height_px, width_px = image.shape
    return CameraPicture(
        url=f'data:image/{kind};base64,{base64.b64encode(encoded).decode("ascii")}',
        width_px=width_px,
        height_px=height_px,
        landmarks=landmarks,
        stamp_ns=stamp_ns,
    )


class CameraReader:
    """Joins camera images with the landmarks detected in them, at most ten a second.

    Subscribes: `/camera/image_raw/compressed`; where nobody publishes that, as in a replayed bag,
    `/camera/image_raw`.

    Args:
        node: A node that no executor spins.

    Attributes:
        subscription: The subscription of the images.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._landmarks: OrderedDict[int, bytes] = OrderedDict()
        self._image: bytes | None = None
        self._image_s = -math.inf
        self.subscription = self._subscribe(topics.COMPRESSED_IMAGE)

    def _subscribe(self, topic: str) -> PolledSubscription:
        message_type = CompressedImage if topic == topics.COMPRESSED_IMAGE else Image
        return PolledSubscription(self._node, message_type, topic, best_effort(1))

    def add_landmarks(self, raw: bytes) -> None:
        """Keep detections until the image of their stamp arrives."""
        self._landmarks[stamp_of(raw)] = raw
        while len(self._landmarks) > _LANDMARK_STAMPS:
            self._landmarks.popitem(last=False)

    def read(self) -> CameraPicture | None:
        """Return a new picture once its landmarks are known, or have not come in time.

        Raises:
            MessageError: The image or its landmarks cannot be used.
        """
        self._select_topic()
        now_s = time.monotonic()
        if self._image is None and now_s - self._image_s >= _IMAGE_PERIOD_S - _IMAGE_TOLERANCE_S:
            images = self.subscription.take()
            if images:
                self._image, self._image_s = images[-1], now_s
        raw = self._image
        if raw is None:
            return None
        stamp_ns = stamp_of(raw)
        landmarks = self._landmarks.get(stamp_ns)
        if landmarks is None and now_s - self._image_s < _LANDMARK_TIMEOUT_S:
            return None
        self._image = None
        detected = () if landmarks is None else landmarks_from_raw(landmarks)
        return camera_picture(self._encoded(raw), detected, stamp_ns)

    def _select_topic(self) -> None:
        count = self._node.count_publishers
        raw_only = count(topics.IMAGE) and not count(topics.COMPRESSED_IMAGE)
        topic = topics.IMAGE if raw_only else topics.COMPRESSED_IMAGE
        if topic != self.subscription.topic:
            self.close()
            self._image = None
            self.subscription = self._subscribe(topic)

    def _encoded(self, raw: bytes) -> bytes:
        if self.subscription.topic == topics.COMPRESSED_IMAGE:
            return compressed_image_from_raw(raw)
        quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
        return bytes(cv2.imencode('.jpg', image_from_raw(raw), quality)[1])

    def close(self) -> None:
        """Unsubscribe."""
        self.subscription.close()
