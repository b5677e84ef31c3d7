"""The camera's image on the page, together with what was detected in this very image."""

from __future__ import annotations

import base64
from collections import OrderedDict
from collections.abc import Callable
import math
import time
from typing import Final

import cv2
from geometry_msgs.msg import PolygonStamped
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import Image

from goalreach_dashboard.ros.taps import Tap
from goalreach_dashboard.state import CameraPicture
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.estimate_messages import landmarks_from_msg
from goalreach_msgs_py.ros.raw_camera import image_from_raw
from goalreach_msgs_py.ros.subscribe_raw import read_message
from goalreach_msgs_py.topics import IMAGE, ROBOT, picture_topic
from goalreach_msgs_py.values import LandmarkObservation

_QUALITY = 70


def data_url(image: NDArray[np.uint8]) -> str:
    """Return a grey image as a `data:` URL that holds it as JPEG.

    Args:
        image: (height, width), grey values.
    """
    _, encoded = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return 'data:image/jpeg;base64,' + base64.b64encode(encoded.tobytes()).decode('ascii')


_STAMPS: Final = 128
_PERIOD_S: Final = 0.1
_SLACK_S: Final = 0.03
"""An image comes ten times a second; which look of 50 ms finds it varies."""
_PATIENCE_S: Final = 0.5

Landmarks = tuple[LandmarkObservation | None, ...]


def landmarks_from_raw(raw: bytes) -> Landmarks:
    """Return the detections of a geometry_msgs/PolygonStamped.

    Raises:
        MessageError: It cannot be read.
    """
    return landmarks_from_msg(read_message(raw, PolygonStamped))


class CameraLook:
    """Takes ten images a second at most, and none while nobody looks.

    Args:
        node: A node that is on no executor.
        note: Called with the topic and each image's number, where they come one by one.
    """

    def __init__(self, node: Node, note: Callable[[str, int], None]) -> None:
        """Do not listen yet."""
        self._node = node
        self._note = note
        self._landmarks: OrderedDict[int, bytes] = OrderedDict()
        self._image: bytes | None = None
        self._image_s = -math.inf
        self._tap: Tap | None = None
        self._topic = ''

    def detected(self, raw: bytes) -> None:
        """Keep detections until the image of their stamp comes."""
        self._landmarks[stamp_of(raw) or 0] = raw
        while len(self._landmarks) > _STAMPS:
            self._landmarks.popitem(last=False)

    def look(self, *, watched: bool, glimpsed: bool) -> CameraPicture | None:
        """Return a picture if there is a new one.

        Args:
            watched: Whether somebody looks.
            glimpsed: Whether the robot shows images now and then on a topic of its own.

        Raises:
            MessageError: The image or its detections cannot be used.
        """
        topic = picture_topic(f'/{ROBOT}') if glimpsed else IMAGE
        if self._tap is not None and (not watched or topic != self._topic):
            self._tap.close()
            self._tap = self._image = None
        if not watched:
            return None
        if self._tap is None:
            note = None if glimpsed else self._note  # glimpses tell how many there were
            self._tap = Tap(self._node, Image, topic, note=note, raw=True)
            self._topic = topic
        self._take(self._tap)
        return self._picture()

    def _take(self, tap: Tap) -> None:
        now_s = time.monotonic()
        if self._image is None and now_s - self._image_s >= _PERIOD_S - _SLACK_S:
            taken = tap.take()
            if taken:
                self._image, self._image_s = taken[-1], now_s

    def _picture(self) -> CameraPicture | None:
        """Return the image taken, once what was detected in it is known."""
        raw = self._image
        if raw is None:
            return None
        stamp_ns = stamp_of(raw) or 0
        landmarks = self._landmarks.get(stamp_ns)
        if landmarks is None and time.monotonic() - self._image_s < _PATIENCE_S:
            return None
        self._image = None
        image = image_from_raw(raw)
        height_px, width_px = image.shape
        return CameraPicture(
            url=data_url(image),
            width_px=width_px,
            height_px=height_px,
            landmarks=() if landmarks is None else landmarks_from_raw(landmarks),
            stamp_ns=stamp_ns,
        )
