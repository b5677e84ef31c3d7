"""Invalid images, readings and messages: no pose from them, and one clear reason for each."""

from array import array
from collections import Counter
from collections.abc import Callable, Sequence
import copy
from dataclasses import replace
import functools
import math
import re
from typing import Any, Final

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Image, JointState

from goalreach_lab.localization.waypoint_robot import FRAMES_PER_S, WaypointRobot, inputs_of
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.image_messages import image_from_raw, image_to_raw
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.pose_messages import odometry_from_raw, odometry_to_raw
from goalreach_msgs_py.sensor_messages import (
    camera_from_raw,
    camera_to_raw,
    head_from_raw,
    head_to_raw,
)
from goalreach_msgs_py.values import Twist2
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame

_Spoil = Callable[[SensorFrame, np.random.Generator], dict[str, Any]]
_TRACKED_FRAMES: Final = 150
_BAD_FRAMES: Final = 40
_RECOVERY_FRAMES: Final = 250
_FORWARD: Final = Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.0)


def _noise(frame: SensorFrame, rng: np.random.Generator) -> dict[str, Any]:
    grey = 16.0 + 8.0 * rng.standard_normal(frame.image.shape)
    return {'image': np.clip(grey, 0.0, 255.0).astype(np.uint8)}


def _uniform(frame: SensorFrame, rng: np.random.Generator) -> dict[str, Any]:
    return {'image': rng.integers(0, 256, frame.image.shape).astype(np.uint8)}


def _joints(frame: SensorFrame, **change: float) -> dict[str, Any]:
    return {'joints': replace(frame.joints, **change)}


def _odometry(frame: SensorFrame, **change: float) -> dict[str, Any]:
    pose = replace(frame.odometry.pose, **change)
    return {'odometry': replace(frame.odometry, pose=pose)}


_NUMBER = re.compile(r'[-+]?\d[\d.]*')
_STALE = 'odometry that stands still'
BAD_INPUTS: Final[dict[str, _Spoil]] = {
    'noise only, 8 grey values': _noise,
    'noise only, all grey values': _uniform,
    'saturated white': lambda frame, _: {'image': np.full_like(frame.image, 255)},
    'all black': lambda frame, _: {'image': np.zeros_like(frame.image)},
    'half the size': lambda frame, _: {'image': frame.image[::2, ::2]},
    'transposed': lambda frame, _: {'image': np.ascontiguousarray(frame.image.T)},
    'in colour': lambda frame, _: {'image': np.repeat(frame.image[..., None], 3, axis=2)},
    'sixteen bits': lambda frame, _: {'image': frame.image.astype(np.uint16)},
    'floating point': lambda frame, _: {'image': frame.image / 255.0},
    'no image': lambda _frame, _: {'image': None},
    'turret NaN': lambda frame, _: _joints(frame, turret_rad=math.nan),
    'pan NaN': lambda frame, _: _joints(frame, pan_rad=math.nan),
    'tilt infinite': lambda frame, _: _joints(frame, tilt_rad=math.inf),
    'odometry NaN': lambda frame, _: _odometry(frame, x_m=math.nan),
    'odometry heading infinite': lambda frame, _: _odometry(frame, heading_rad=math.inf),
    _STALE: lambda _frame, _: {},
    'a stamp ten seconds old': lambda frame, _: {'time_ns': frame.time_ns - 10_000_000_000},
}
_MESSAGES: Final = 'messages'


def input_study(*, seed: int) -> Study:
    """Return the study of invalid inputs.

    Each replaces 40 images (1.6 s) of a robot that tracks; then valid inputs resume.

    Args:
        seed: Seed of everything random.
    """
    return Study(
        name='inputs',
        key=('input',),
        settings={'seed': seed},
        cases=[{'input': name} for name in (*BAD_INPUTS, _MESSAGES)],
        measure=per_case(functools.partial(_measure, seed=seed)),
        analyse=_analyse,
        rows=_rows,
    )


def _measure(case: Case, *, seed: int) -> Result:
    robot = copy.deepcopy(_tracking_robot(seed))
    if case['input'] == _MESSAGES:
        return {'reasons': refused_messages(robot.step().frame)}
    return _give(robot, case['input'], np.random.default_rng([seed, 61]))


@functools.cache
def _tracking_robot(seed: int) -> WaypointRobot:
    robot = WaypointRobot((seed, 60), noise=noise_preset('nominal'))
    for _ in range(_TRACKED_FRAMES):
        robot.step()
    return robot


def _give(robot: WaypointRobot, name: str, rng: np.random.Generator) -> Result:
    """Give an invalid input to the localizer of a robot, then valid ones.

    Returns:
        'good': number of poses published meanwhile; 'reasons': largest number of different
        reasons of one mode; 'reason': the last one, empty where an image has none; 'back_s': time
        to a pose after valid inputs resumed.
    """
    outputs: list[LocalizerOutput] = []
    before = robot.step().frame.odometry
    for _ in range(_BAD_FRAMES):
        robot.simulator.command_drive(_FORWARD)
        robot.simulator.advance()
        frame = robot.simulator.sense()
        stale = {'odometry': before} if name == _STALE else {}
        outputs.append(
            robot.localizer.process(
                **{**inputs_of(frame), **BAD_INPUTS[name](frame, rng), **stale}
            )
        )
    last, refused = outputs[-1], [one for one in outputs if one.mode != 'tracking']
    told = {(one.mode, _NUMBER.sub('#', one.reason)) for one in refused}
    steps = enumerate(robot.run(_RECOVERY_FRAMES))
    back = (frames for frames, step in steps if step.output.mode == 'tracking')
    return {
        'good': sum(output.mode == 'tracking' for output in outputs),
        'reasons': max(Counter(mode for mode, _ in told).values(), default=0),
        'reason': f'{last.mode}: {last.reason}' if all(one.reason for one in refused) else '',
        'back_s': next(back, math.inf) / FRAMES_PER_S,
    }


def refused_messages(frame: SensorFrame) -> dict[str, str]:
    """Return the reason for which each invalid message is refused; empty where it is accepted.

    Args:
        frame: The values of the messages but for the one that is made invalid.
    """
    image = image_to_raw(frame.image, 0)
    camera = camera_to_raw(frame.camera, 0)
    joints = head_to_raw(frame.joints, 0)
    bad = _odometry(frame, x_m=math.nan)['odometry']
    few = _changed(joints, JointState, name=['pan_joint'], position=[0.0])
    nan = _changed(joints, JointState, position=[0.0, math.nan, 0.0])
    cases: dict[str, tuple[Callable[[bytes], object], bytes]] = {
        'encoding 32FC1': (image_from_raw, _changed(image, Image, encoding='32FC1')),
        'encoding rgb8 of mono8': (image_from_raw, _changed(image, Image, encoding='rgb8')),
        'data cut off': (image_from_raw, _changed(image, Image, data=array('B', bytes(1000)))),
        'image of width 0': (image_from_raw, _changed(image, Image, width=0)),
        'lens without focal length': (
            camera_from_raw,
            _changed(camera, CameraInfo, k=np.zeros(9)),
        ),
        'NaN in a joint state': (head_from_raw, nan),
        'joint missing': (head_from_raw, few),
        'NaN in odometry': (odometry_from_raw, odometry_to_raw(bad, 0, frame_id='odom')),
    }
    return {name: _refusal(convert, message) for name, (convert, message) in cases.items()}


def _changed(raw: bytes, message_type: type[Any], **fields: object) -> bytes:
    message = deserialize_message(raw, message_type)
    for name, value in fields.items():
        setattr(message, name, value)
    return bytes(serialize_message(message))


def _refusal(convert: Callable[[bytes], object], message: bytes) -> str:
    try:
        convert(message)
    except MessageError as error:
        return str(error)
    return ''


def _analyse(results: Sequence[Result]) -> dict[str, Any]:
    """Return the results of the inputs by name, and the reasons of the messages."""
    inputs = {result['input']: result for result in results}
    messages = inputs.pop(_MESSAGES, {'reasons': {}})['reasons']
    return {'inputs': inputs, 'messages': messages}


def reasons(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name and reason of every invalid input."""
    inputs = [(name, one['reason']) for name, one in found['inputs'].items()]
    return [*inputs, *found['messages'].items()]


def _rows(found: dict[str, Any]) -> list[BenchRow]:
    inputs, messages = found['inputs'], found['messages']
    good = {name: one['good'] for name, one in inputs.items() if one['good']}
    vague = [name for name, one in inputs.items() if one['reasons'] != 1]
    vague += [name for name, reason in reasons(found) if not reason]
    n = len(inputs) + len(messages)
    return [
        BenchRow.none_allowed(
            'invalid inputs from which a pose was published',
            len(good),
            unit='inputs',
            n=n,
            note=', '.join(f'{name}: {count} images' for name, count in good.items()),
        ),
        BenchRow.none_allowed(
            'invalid inputs without exactly one clear reason',
            len(vague),
            unit='inputs',
            n=n,
            note=', '.join(vague),
        ),
        BenchRow(
            name='longest time to a pose after valid inputs resumed',
            unit='s',
            ours=max(one['back_s'] for one in inputs.values()),
            n=len(inputs),
        ),
    ]
