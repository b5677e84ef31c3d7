"""Messages received from a robot, and verdicts on them: one line and a correction each."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
import math
import time
from typing import Any, Final

import numpy as np

from goalreach_learning.controller_config import RobotConfig
from goalreach_msgs_py import topics
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import CdrReader, MessageError, stamp_of
from goalreach_msgs_py.image_messages import decoded_image_from_raw, image_from_raw
from goalreach_msgs_py.pose_messages import odometry_from_raw
from goalreach_msgs_py.sensor_messages import bumpers_from_raw, camera_from_raw, head_from_raw
from goalreach_perception.localizer_config import InputConfig

_JOINTS: Final = 'sensor_msgs/msg/JointState'
_LEAST_HZ: Final = 8.0
"""Rate below which the robot overshoots between two images. Chosen."""
_LONGEST_GAP_S: Final = 0.4
"""Gap that comes close to the half second after which robots stop. Chosen."""
_OTHER_CLOCK_S: Final = 1.0
_LATE_S: Final = 0.3
_EPOCH_S: Final = 60.0
"""Stamps that are nearer to the time of this machine are of its clock. Chosen."""
_FIELD_OF_VIEW_RAD: Final = (math.radians(20.0), math.radians(150.0))
_FAR_M: Final = 100.0
_CREPT_M: Final = 0.02
_DISTORTED_PX: Final = 0.5
"""Shift of a corner by the lens over the width of the image that no calibration has. Chosen."""

OK, NOTE, WARN, WRONG = 'ok', 'note', 'warn', 'wrong'
"""Levels of a verdict; with one that is wrong the robot cannot drive."""


@dataclass(frozen=True, kw_only=True)
class End:
    """One end of a topic: node, message type, and quality of service in a few words."""

    node: str
    kind: str
    qos: str = 'reliable'


@dataclass(kw_only=True)
class HeardTopic:
    """Messages and endpoints of one topic.

    Attributes:
        kind: Message type that is expected.
        publishers: Its publishers, but for our own.
        subscribers: Its subscribers, but for our own.
        arrivals_s: Arrival of each message that could be read, by the clock of this machine.
        stamps_s: Its stamp.
        changes: Whether not all values were the same.
        form: Size and encoding of the last image.
        error: Why a message could not be read, or empty.
        kept: All stamps and values, where they are kept.
    """

    kind: str
    read: Callable[[bytes], Any] = bytes
    publishers: tuple[End, ...] = ()
    subscribers: tuple[End, ...] = ()
    arrivals_s: list[float] = field(default_factory=list)
    stamps_s: list[float] = field(default_factory=list)
    first: Any = None
    last: Any = None
    changes: bool = False
    frame: str = ''
    form: str = ''
    error: str = ''
    kept: list[tuple[float, Any]] | None = None

    def add(self, raw: bytes, arrival_s: float | None = None) -> None:
        """Add a message that arrived at a time, seconds since the epoch; None: now."""
        arrival_s = time.time() if arrival_s is None else arrival_s
        try:
            stamp_s, reader = stamp_of(raw) * 1e-9, CdrReader(raw, has_header=False)
            reader.skip('2I')
            self.frame = reader.text()
            if self.kind.endswith('/Image'):
                (height, width), encoding = reader.numbers('2I'), reader.text()
                self.form = f'{width}x{height} {encoding}'
            value = self.read(raw)
        except MessageError as error:
            self.error = str(error)
            return
        self.arrivals_s.append(arrival_s)
        self.stamps_s.append(stamp_s)
        if self.kept is not None:
            self.kept.append((stamp_s, value))
        if self.first is None:
            self.first = self.last = value
        self.changes = self.changes or not np.array_equal(value, self.last)
        self.last = value

    @property
    def rate_hz(self) -> float:
        """Messages per second."""
        span_s = self.arrivals_s[-1] - self.arrivals_s[0]
        return (len(self.arrivals_s) - 1) / span_s if span_s else 0.0

    @property
    def age_s(self) -> float:
        """Median time from stamp to arrival."""
        return float(np.median(np.subtract(self.arrivals_s, self.stamps_s)))

    @property
    def jitter_s(self) -> float:
        """Largest deviation of that time from its median."""
        return float(np.abs(np.subtract(self.arrivals_s, self.stamps_s) - self.age_s).max())


class HeardRobot:
    """Topics and services of a robot, as received.

    Attributes:
        joints: Names of the joints that the head has.
        image: Topic of the images.
        inputs: The inputs of the nodes, by topic.
        outputs: What the nodes command, by topic.
        topics: All topics with a publisher.
    """

    def __init__(self, config: InputConfig, robot: RobotConfig) -> None:
        self.config, self.robot = config, robot
        self.joints = topics.HEAD_KINDS[config.head]
        is_raw = config.image_transport == 'raw'
        self.image = topics.IMAGE if is_raw else topics.COMPRESSED_IMAGE
        kinds: dict[str, tuple[str, Callable[[bytes], Any]]] = {
            topics.IMAGE: (
                'sensor_msgs/msg/Image',
                partial(image_from_raw, bits=config.image_bits),
            ),
            topics.COMPRESSED_IMAGE: ('sensor_msgs/msg/CompressedImage', decoded_image_from_raw),
            topics.CAMERA_INFO: ('sensor_msgs/msg/CameraInfo', camera_from_raw),
            topics.ODOM: ('nav_msgs/msg/Odometry', odometry_from_raw),
            topics.JOINT_STATES: (_JOINTS, partial(head_from_raw, joints=self.joints)),
            topics.BUMPERS: ('sensor_msgs/msg/LaserScan', bumpers_from_raw),
        }
        del kinds[topics.COMPRESSED_IMAGE if is_raw else topics.IMAGE]
        if not self.joints:
            del kinds[topics.JOINT_STATES]
        self.inputs = {t: HeardTopic(kind=kind, read=read) for t, (kind, read) in kinds.items()}
        twist = 'TwistStamped' if robot.stamped_cmd_vel else 'Twist'
        self.outputs = {topics.CMD_VEL: HeardTopic(kind=f'geometry_msgs/msg/{twist}')}
        if self.joints:
            self.outputs[topics.HEAD_COMMAND] = HeardTopic(kind=_JOINTS)
        self.topics: frozenset[str] = frozenset()
        self.services: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One line about a robot.

    Attributes:
        subject: Topic, service or joint.
        level: `ok`, `note`, `warn` or `wrong`.
        text: What was found.
        cure: How to correct it, or empty.
    """

    subject: str
    level: str
    text: str
    cure: str = ''


Finding = tuple[str, str, str]
"""Level, text and cure."""


def judge(robot: HeardRobot) -> list[Verdict]:
    """Return the verdicts on a robot, in the order of its topics."""
    findings: list[tuple[str, Finding]] = []
    for topic, heard in robot.inputs.items():
        found = [*_judge_input(topic, heard, robot)]
        if heard.stamps_s and heard.publishers:
            found += [*_judge_clock(topic, heard, robot), *_judge_values(topic, robot)]
            if all(level != WRONG for level, _, _ in found):
                found.insert(0, (OK, _describe(heard), ''))
        findings += [(topic, one) for one in found]
    for topic, heard in robot.outputs.items():
        findings += [(topic, one) for one in _judge_output(topic, heard, robot)]
    if not {topics.RESET_SERVICE, topics.PAUSE_SERVICE} <= robot.services:
        text = 'not there: the robot drives from where it stands'
        findings.append((topics.RESET_SERVICE, (NOTE, text, '')))
    if topics.GROUND_TRUTH not in robot.topics:
        text = 'not there: paths are declared, not judged'
        findings.append((topics.GROUND_TRUTH, (NOTE, text, '')))
    return [Verdict(subject=at, level=a, text=b, cure=c) for at, (a, b, c) in findings]


def can_drive(verdicts: list[Verdict]) -> bool:
    """Return whether a robot with these verdicts can drive."""
    return all(verdict.level != WRONG for verdict in verdicts)


def _describe(heard: HeardTopic) -> str:
    (sender, *_) = heard.publishers
    ages = f'stamps {heard.age_s:.3f} s old, jitter {1e3 * heard.jitter_s:.0f} ms'
    if abs(heard.age_s) > _EPOCH_S:
        ages = f'stamps of another clock, jitter {1e3 * heard.jitter_s:.0f} ms'
    parts = (heard.form, f'{heard.rate_hz:.1f} Hz', ages, sender.qos, heard.frame, sender.node)
    return ', '.join(filter(None, parts))


def _judge_input(topic: str, heard: HeardTopic, robot: HeardRobot) -> Iterator[Finding]:
    """Judge whether messages come, from one sender, readable and often enough."""
    optional = topic == topics.BUMPERS and robot.robot.bumpers == 'optional'
    if not heard.publishers:
        alone = 'nobody publishes it: only the pose keeps the robot off the walls', ''
        missing = 'nobody publishes it', _cure_of_absence(topic, robot)
        yield (NOTE, *alone) if optional else (WRONG, *missing)
        return
    kinds = {end.kind for end in heard.publishers}
    if kinds != {heard.kind}:
        yield WRONG, f'its type is {" and ".join(sorted(kinds))}', f'send {heard.kind}'
        return
    if len(heard.publishers) > 1:
        names = ' and '.join(sorted(end.node for end in heard.publishers))
        yield WRONG, f'{len(heard.publishers)} publishers: {names}', 'stop or remap all but one'
    if heard.error:
        yield WRONG, heard.error, 'correct what the driver sends'
    elif not heard.stamps_s:
        once = topic == topics.CAMERA_INFO
        cure = 'latch it, or send it now and then' if once else 'start the driver, or unpause it'
        yield WARN if optional else WRONG, 'advertised, but nothing comes', cure
    if topic == topics.CAMERA_INFO or not heard.stamps_s:
        return
    if heard.rate_hz < _LEAST_HZ:
        yield WARN, f'{heard.rate_hz:.1f} Hz is slow', f'raise it to {_LEAST_HZ:.0f} Hz or more'
    elif max(np.diff(heard.arrivals_s)) > _LONGEST_GAP_S:
        gap_s = max(np.diff(heard.arrivals_s))
        yield WARN, f'a gap of {gap_s:.1f} s', 'look for an overloaded machine or network'


def _cure_of_absence(topic: str, robot: HeardRobot) -> str:
    if topic == robot.image and topics.COMPRESSED_IMAGE in robot.topics:
        return f'{topics.COMPRESSED_IMAGE} is there: image_transport: compressed'
    if topic == topics.COMPRESSED_IMAGE and topics.IMAGE in robot.topics:
        return f'{topics.IMAGE} is there: image_transport: raw'
    if topic == topics.BUMPERS:
        return 'without bumpers: bumpers: optional of goal_reaching_controller'
    if topic == topics.JOINT_STATES:
        return 'with a fixed camera: head: none of landmark_localizer'
    return 'start its driver, or remap its topic to this name'


def _judge_clock(topic: str, heard: HeardTopic, robot: HeardRobot) -> Iterator[Finding]:
    """Judge the stamps of a topic, by themselves and against those of the images."""
    stamps_s = np.array(heard.stamps_s)
    held = topic == topics.CAMERA_INFO
    if not stamps_s.all():
        yield WRONG, 'stamps are zero', 'stamp each message when its sample is taken'
        return
    if (np.diff(stamps_s) < 0.0).any():
        yield WRONG, 'stamps go back', 'one sender, one clock; send in order'
    elif len(stamps_s) > 1 and not np.ptp(stamps_s) and not held:
        yield WRONG, 'all stamps are the same', 'stamp each message when its sample is taken'
    image = robot.inputs[robot.image]
    if held or not image.stamps_s:
        return
    behind_s = heard.age_s - image.age_s
    wait_s = robot.config.input_wait_s
    if abs(behind_s) > _OTHER_CLOCK_S:
        where = 'behind' if behind_s > 0.0 else 'ahead of'
        text = f'stamps are {abs(behind_s):.1f} s {where} those of the images'
        yield WRONG, text, 'one clock for all: use_sim_time everywhere or nowhere'
    elif behind_s > wait_s:
        text = f'comes {behind_s:.2f} s later than images of its time'
        enough_s = math.ceil(20 * behind_s) / 20
        yield WARN, text, f'input_wait_s: {enough_s:.2f} of landmark_localizer'
    elif _LATE_S < abs(heard.age_s) < _EPOCH_S:
        text = f'stamps are {heard.age_s:.2f} s old on arrival'
        yield WARN, text, 'lower the delay, or set the clocks of the machines (chrony)'


def _judge_values(topic: str, robot: HeardRobot) -> Iterator[Finding]:
    heard = robot.inputs[topic]
    if topic == robot.image:
        yield from _judge_image(heard, robot)
    elif topic == topics.CAMERA_INFO:
        yield from _judge_camera(heard.last)
    elif topic == topics.ODOM:
        pose, first = heard.last.pose, heard.first.pose
        if max(abs(pose.x_m), abs(pose.y_m)) > _FAR_M:
            text = f'the robot is at {pose.x_m:.0f}, {pose.y_m:.0f}'
            yield WARN, text, 'positions are metres; begin at zero'
        if math.hypot(pose.x_m - first.x_m, pose.y_m - first.y_m) > _CREPT_M:
            yield WARN, 'the robot moves by itself', 'let it stand while it is checked'
    elif topic == topics.JOINT_STATES:
        angles = vars(heard.last)
        largest = max(angles, key=lambda name: abs(angles[name]))
        if abs(angles[largest]) > math.tau:
            name = f'{largest.removesuffix("_rad")}_joint'
            yield WRONG, f'{name} is at {angles[largest]:.1f}: degrees?', 'send radians'
    elif any(heard.last):
        which = ', '.join(str(ray) for ray, pressed in enumerate(heard.last) if pressed)
        yield WARN, f'bumper {which} is pressed', 'free it; +inf where none is pressed'


def _judge_image(heard: HeardTopic, robot: HeardRobot) -> Iterator[Finding]:
    image, camera = heard.last, robot.inputs[topics.CAMERA_INFO].last
    if image.min() == image.max():
        text = f'all pixels are {image.min()}'
        deep = heard.form.endswith('16') or heard.form.endswith('16UC1')
        dim = 'image_bits: 10 or 12 of landmark_localizer, or ' if deep else ''
        yield WARN, text, f'{dim}take off the lens cap, or raise the exposure'
    elif not heard.changes and len(heard.stamps_s) > 1:
        yield WARN, 'all images are the same', 'does the driver repeat one image?'
    if camera is not None and image.shape != (camera.height_px, camera.width_px):
        text = f'{image.shape[1]}x{image.shape[0]}, but {topics.CAMERA_INFO} says '
        size = f'{camera.width_px}x{camera.height_px}'
        yield WRONG, text + size, 'calibrate at this size, or set binning and roi'


def _judge_camera(camera: PinholeCamera) -> Iterator[Finding]:
    view_rad = 2.0 * math.atan(camera.width_px / 2.0 / camera.fx_px)
    least, most = _FIELD_OF_VIEW_RAD
    if not least <= view_rad <= most and camera.distortion_model != 'equidistant':
        text = f'K gives a field of view of {math.degrees(view_rad):.0f} deg'
        yield WRONG, text, 'calibrate the camera at the size of its images'
    if not 1 / 1.1 < camera.fx_px / camera.fy_px < 1.1:  # noqa: PLR2004
        text = f'K has pixels of {camera.fx_px / camera.fy_px:.2f} times their height'
        yield WARN, text, 'calibrate the camera at the size of its images'
    centre = camera.cx_px / camera.width_px, camera.cy_px / camera.height_px
    if max(abs(part - 0.5) for part in centre) > 0.2:  # noqa: PLR2004
        text = f'K has its centre at {camera.cx_px:.0f}, {camera.cy_px:.0f}'
        yield WRONG, text, 'calibrate the camera at the size of its images'
        return
    corner = np.array([[-camera.cx_px / camera.fx_px, -camera.cy_px / camera.fy_px, 1.0]])
    shift_px = float(np.hypot(*camera.project(corner)[0]))
    if shift_px > _DISTORTED_PX * camera.width_px and camera.distortion_model != 'equidistant':
        yield WARN, f'the lens moves a corner by {shift_px:.0f} px', 'recalibrate the camera'


def _judge_output(topic: str, heard: HeardTopic, robot: HeardRobot) -> Iterator[Finding]:
    names = ', '.join(sorted(end.node for end in heard.subscribers))
    kinds = {end.kind for end in heard.subscribers}
    if heard.kind in kinds:
        yield OK, f'{names} listens', ''
    elif kinds:
        twist = {f'geometry_msgs/msg/Twist{end}' for end in ('', 'Stamped')} & kinds
        stamped = str(not robot.robot.stamped_cmd_vel).lower()
        name = f'stamped_cmd_vel: {stamped} of goal_reaching_controller'
        cure = name if topic == topics.CMD_VEL and twist else f'take {heard.kind}'
        yield WRONG, f'{names} expects {" and ".join(sorted(kinds))}', cure
    elif topic == topics.HEAD_COMMAND:
        cure = 'subscribe the head to it; with a fixed camera: head: none'
        yield WRONG, 'nobody listens', cure
    else:
        yield WRONG, 'nobody listens', 'remap the topic of the base to it'
    if heard.publishers:
        names = ' and '.join(sorted(end.node for end in heard.publishers))
        yield WRONG, f'{names} commands already', 'stop it, or remap it'
