"""Messages that no localizer can use, through the conversions of its node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

import numpy as np

from goalreach_msgs_py.ros.common_messages import MessageError
from goalreach_msgs_py.ros.sensor_messages import (
    camera_from_msg,
    camera_to_msg,
    head_from_msg,
    head_to_msg,
    image_from_msg,
    image_to_msg,
    odometry_from_msg,
    odometry_to_msg,
)
from goalreach_sim.sensors import SensorFrame


def refused_messages(frame: SensorFrame) -> dict[str, str]:
    """Return what the conversions say of messages that cannot be used: nothing where they can.

    Args:
        frame: What the messages would hold if they were good.
    """
    image = image_to_msg(frame.image, 0)
    camera = camera_to_msg(frame.camera, 0)
    joints = head_to_msg(frame.joints, 0)
    pose = replace(frame.odometry.pose, x_m=math.nan)
    odometry = odometry_to_msg(replace(frame.odometry, pose=pose), 0, frame_id='odom')
    cases: dict[str, tuple[Callable[[Any], object], object]] = {
        'encoding rgb8': (image_from_msg, _changed(image, encoding='rgb8')),
        'encoding mono16': (image_from_msg, _changed(image, encoding='mono16')),
        'data cut off': (image_from_msg, _changed(image, data=image.data[:1000])),
        'image of no size': (image_from_msg, _changed(image, width=0)),
        'lens without focal length': (camera_from_msg, _changed(camera, k=np.zeros(9))),
        'NaN in a joint state': (head_from_msg, _changed(joints, position=[0.0, math.nan, 0.0])),
        'joint missing': (head_from_msg, _changed(joints, name=['pan_joint'], position=[0.0])),
        'NaN in odometry': (odometry_from_msg, odometry),
    }
    return {name: _said(convert, message) for name, (convert, message) in cases.items()}


def _changed(message: Any, **fields: object) -> Any:
    values = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    return type(message)(**{**values, **fields})


def _said(convert: Callable[[Any], object], message: object) -> str:
    try:
        convert(message)
    except MessageError as error:
        return str(error)
    return ''
