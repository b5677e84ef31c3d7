"""What the camera sends, as bytes: the pairs of `ros_sensor_messages`, quicker.

`x_to_raw` gives the bytes of `x_to_msg`; `x_from_raw` gives, or refuses, what `x_from_msg` does.
"""

from __future__ import annotations

from functools import lru_cache
import struct

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import CdrLayout, Fixed, set_stamp, without_stamp
from goalreach_msgs_py.ros.sensor_messages import (
    IMAGE_ENCODING,
    camera_from_msg,
    camera_to_msg,
    image_from_msg,
)
from goalreach_msgs_py.ros.subscribe_raw import read_message
from goalreach_msgs_py.topics import CAMERA_FRAME

_KEPT = 8
_SIZE = struct.Struct('<II')
_SIZE_END = len(CdrLayout(CAMERA_FRAME, Fixed('2I', 0, 0)).template)


def image_to_raw(image: NDArray[np.uint8], stamp_ns: int) -> bytes:
    """Return a (height, width) grey image as sensor_msgs/Image mono8."""
    height, width = image.shape
    head = bytearray(_image_head(height, width).template)
    set_stamp(head, stamp_ns)
    return b''.join((head, image.data if image.flags.c_contiguous else image.tobytes()))


@lru_cache(maxsize=_KEPT)
def _image_head(height: int, width: int) -> CdrLayout:
    """Return all that precedes the pixels, the number of which comes last."""
    return CdrLayout(
        CAMERA_FRAME,
        Fixed('2I', height, width),
        IMAGE_ENCODING,
        Fixed('B', 0),
        Fixed('2I', width, height * width),
    )


def image_from_raw(raw: bytes) -> NDArray[np.uint8]:
    """Return a sensor_msgs/Image mono8 as a (height, width) array that shares its memory.

    Raises:
        MessageError: Another encoding, or sizes that do not fit the data.
    """
    if len(raw) > _SIZE_END:
        height, width = _SIZE.unpack_from(raw, _SIZE_END - _SIZE.size)
        if 0 < height * width <= len(raw):
            head = _image_head(height, width)
            if head.fits(raw, more=height * width):
                start = len(head.template)
                pixels = np.frombuffer(raw, np.uint8, height * width, start)
                return pixels.reshape(height, width)
    return image_from_msg(read_message(raw, Image))


def camera_to_raw(camera: PinholeCamera, stamp_ns: int) -> bytes:
    """Return the intrinsics as sensor_msgs/CameraInfo, model plumb_bob."""
    return _camera_layout(camera).pack(stamp_ns)


@lru_cache(maxsize=_KEPT)
def _camera_layout(camera: PinholeCamera) -> CdrLayout:
    """Return the message of a camera, which is nearly always the same, but for the stamp."""
    message = camera_to_msg(camera, 0)
    return CdrLayout(
        CAMERA_FRAME,
        Fixed('2I', message.height, message.width),
        message.distortion_model,
        Fixed('I', len(message.d)),
        *(Fixed(f'{len(row)}d', *row) for row in (message.d, message.k, message.r, message.p)),
        Fixed('6I', *bytes(6)),
        Fixed('B', 0),
    )


def camera_from_raw(raw: bytes) -> PinholeCamera:
    """Return the intrinsics of a sensor_msgs/CameraInfo.

    Raises:
        MessageError: Intrinsics that no camera has, or a distortion model other than plumb_bob.
    """
    return _camera(without_stamp(raw))


@lru_cache(maxsize=_KEPT)
def _camera(raw: bytes) -> PinholeCamera:
    """Return the intrinsics; they are the same in nearly every message, but for the stamp."""
    return camera_from_msg(read_message(raw, CameraInfo))
