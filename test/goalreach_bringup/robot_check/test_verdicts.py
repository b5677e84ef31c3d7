"""Sound robots of six kinds, and a table of faults, each planted in what one of them sends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
import math
import struct
from typing import Any

import cv2
import numpy as np
import pytest

from goalreach_bringup.robot_check.moves import DRIVE, TURN, Measurement, judge_motion
from goalreach_bringup.robot_check.verdicts import End, HeardRobot, Verdict, can_drive, judge
from goalreach_learning.controller_config import RobotConfig
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import CdrWriter
from goalreach_msgs_py.image_messages import compressed_image_to_raw, image_to_raw
from goalreach_msgs_py.pose_messages import odometry_to_raw
from goalreach_msgs_py.sensor_messages import bumpers_to_raw, camera_to_raw, head_to_raw
from goalreach_msgs_py.topics import (
    BUMPERS,
    CAMERA_INFO,
    CMD_VEL,
    COMPRESSED_IMAGE,
    GROUND_TRUTH,
    HEAD_COMMAND,
    HEAD_JOINTS,
    IMAGE,
    JOINT_STATES,
    ODOM,
    PAUSE_SERVICE,
    RESET_SERVICE,
)
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2, Twist2
from goalreach_perception.localizer_config import InputConfig

NOW_S = 1_700_000_000.0
TICKS = 125
SIZE = (40, 30)
CAMERA = PinholeCamera.from_field_of_view(width_px=40, height_px=30, horizontal_fov_rad=1.05)
LEVEL = HeadAngles(turret_rad=0.1, pan_rad=0.2, tilt_rad=-0.05)
ORIGIN = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
PLACE = Pose2(x_m=1.0, y_m=-2.0, heading_rad=0.0)
TWIST, STAMPED = 'geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped'
WRONG, WARN = 'wrong', 'warn'
TURN_RAD = math.radians(10.0)


def picture(stamp_ns: int, encoding: str = 'mono8', channels: int = 1) -> bytes:
    width, height = SIZE
    writer = CdrWriter(stamp_ns, 'camera')
    writer.numbers('2I', height, width)
    writer.text(encoding)
    writer.zeros('B')
    writer.numbers('2I', width * channels, width * height * channels)
    pixels = np.random.default_rng(stamp_ns).integers(0, 99, width * height * channels, np.uint8)
    return writer.raw(pixels.tobytes())


def jpeg(stamp_ns: int) -> bytes:
    pixels = np.random.default_rng(stamp_ns).integers(0, 99, SIZE[::-1], np.uint8)
    return compressed_image_to_raw(cv2.imencode('.jpg', pixels)[1].tobytes(), stamp_ns)


def soon(time_s: float) -> float:
    return time_s + 0.01


def unchanged(raw: bytes) -> bytes:
    return raw


@dataclass
class Robot:
    """A sound robot that stands; a test changes one thing of what it sends."""

    inputs: InputConfig = field(default_factory=InputConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    image: Callable[[int], bytes] = picture
    camera: PinholeCamera = CAMERA
    head: HeadAngles = LEVEL
    joints: tuple[str, ...] = HEAD_JOINTS
    pose: Pose2 = PLACE
    crept_m: tuple[float, float] = (-0.01, 0.01)
    pressed: tuple[bool, ...] = (False,) * 20
    stamps: dict[str, Callable[[float], float]] = field(default_factory=dict)
    arrivals: dict[str, Callable[[float], float]] = field(default_factory=dict)
    raw: dict[str, Callable[[bytes], bytes]] = field(default_factory=dict)
    ticks: dict[str, range] = field(default_factory=dict)
    publishers: dict[str, tuple[End, ...]] = field(default_factory=dict)
    drive: tuple[End, ...] = (End(node='base', kind=STAMPED),)
    heads: tuple[End, ...] = (End(node='head', kind='sensor_msgs/msg/JointState'),)
    drivers: tuple[End, ...] = ()
    topics: frozenset[str] = frozenset({GROUND_TRUTH})
    services: frozenset[str] = frozenset({RESET_SERVICE, PAUSE_SERVICE})

    def verdicts(self) -> list[Verdict]:
        heard = HeardRobot(self.inputs, self.robot)
        for topic, one in heard.inputs.items():
            one.publishers = self.publishers.get(topic, (End(node='driver', kind=one.kind),))
            for tick in self.ticks.get(topic, range(TICKS)) if one.publishers else ():
                time_s = NOW_S + 0.04 * tick
                stamp_ns = round(self.stamps.get(topic, float)(time_s) * 1e9)
                change = self.raw.get(topic, unchanged)
                raw = change(self.message(topic, stamp_ns))
                one.add(raw, self.arrivals.get(topic, soon)(time_s))
        heard.outputs[CMD_VEL].subscribers = self.drive
        heard.outputs[CMD_VEL].publishers = self.drivers
        if HEAD_COMMAND in heard.outputs:
            heard.outputs[HEAD_COMMAND].subscribers = self.heads
        heard.topics, heard.services = self.topics, self.services
        return judge(heard)

    def message(self, topic: str, stamp_ns: int) -> bytes:
        if topic in (IMAGE, COMPRESSED_IMAGE):
            return self.image(stamp_ns)
        standing = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)
        x_m, y_m = self.crept_m if stamp_ns > 1e9 * (NOW_S + 1.0) else (0.0, 0.0)
        pose = replace(self.pose, x_m=self.pose.x_m + x_m, y_m=self.pose.y_m + y_m)
        makers: dict[str, Callable[[], bytes]] = {
            CAMERA_INFO: lambda: camera_to_raw(self.camera, stamp_ns),
            ODOM: lambda: odometry_to_raw(
                Odometry(pose=pose, twist=standing), stamp_ns, frame_id='odom'
            ),
            JOINT_STATES: lambda: head_to_raw(self.head, stamp_ns, joints=self.joints),
            BUMPERS: lambda: bumpers_to_raw(
                self.pressed, stamp_ns, body_radius_m=0.2, scan_time_s=0.04
            ),
        }
        return makers[topic]()


TOPICS = (IMAGE, CAMERA_INFO, ODOM, JOINT_STATES, BUMPERS)


def simulated(time_s: float) -> float:
    return time_s - NOW_S + 5.0


SOUND = {
    'nomad200': Robot(),
    'webcam on a twist base, no bumpers': Robot(
        inputs=InputConfig(head='none', image_transport='compressed'),
        robot=RobotConfig(stamped_cmd_vel=False, bumpers='optional'),
        image=jpeg,
        drive=(End(node='turtlebot', kind=TWIST),),
        publishers={BUMPERS: ()},
        topics=frozenset(),
        services=frozenset(),
    ),
    'pan and tilt, colour, own clocks and rates': Robot(
        inputs=InputConfig(head='pan_tilt'),
        image=lambda ns: picture(ns, 'bgr8', 3),
        stamps={ODOM: lambda s: s - 0.007, JOINT_STATES: lambda s: s + 0.005},
        ticks={JOINT_STATES: range(0, TICKS, 2)},
    ),
    'simulated clock': Robot(
        stamps=dict.fromkeys(TOPICS, simulated),
        services=frozenset({RESET_SERVICE, PAUSE_SERVICE, '/talker/get_parameters'}),
    ),
    'calibration stamped long ago': Robot(stamps={CAMERA_INFO: lambda _: NOW_S - 100.0}),
    'fisheye, calibration once': Robot(
        camera=replace(
            CAMERA, fx_px=2.0, fy_px=2.0, distortion=(0.01, 0.0, 0.0, 0.0),
            distortion_model='equidistant',
        ),
        ticks={CAMERA_INFO: range(1)},
    ),
    'pan only, 8 Hz': Robot(
        inputs=InputConfig(head='pan'), ticks={IMAGE: range(0, TICKS, 3)}
    ),
}  # fmt: skip


@pytest.mark.parametrize('robot', SOUND.values(), ids=SOUND)
def test_a_sound_robot_has_no_fault(robot: Robot) -> None:
    verdicts = robot.verdicts()
    assert [v for v in verdicts if v.level not in ('ok', 'note')] == []
    assert can_drive(verdicts)
    missing = [BUMPERS, RESET_SERVICE, GROUND_TRUTH] if robot.topics == frozenset() else []
    assert [v.subject for v in verdicts if v.level == 'note'] == missing


@pytest.mark.parametrize(
    ('name', 'ages'),
    [('nomad200', 'stamps 0.010 s old'), ('simulated clock', 'stamps of another clock')],
)
def test_a_sound_topic_is_described(name: str, ages: str) -> None:
    robot = replace(SOUND[name], arrivals={IMAGE: lambda s: s + 0.01 + 0.02 * (s == NOW_S + 2.0)})
    (found,) = [v for v in robot.verdicts() if v.subject == IMAGE]
    assert found.text == f'40x30 mono8, 25.0 Hz, {ages}, jitter 20 ms, reliable, camera, driver'


def two(kind: str) -> tuple[End, ...]:
    return tuple(End(node=name, kind=kind) for name in ('one', 'other'))


def lens(**changes: Any) -> PinholeCamera:  # noqa: ANN401 - fields of any type
    return replace(CAMERA, **changes)


def replaced(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    return lambda raw: raw.replace(old, new)


def number(value: float) -> bytes:
    return struct.pack('<d', value)


def slowly(time_s: float) -> float:
    return NOW_S + 1.1 * (time_s - NOW_S)


def dark(encoding: str, step: int) -> Callable[[int], bytes]:
    def image(stamp_ns: int) -> bytes:
        head = picture(stamp_ns, encoding, step)[: -step * SIZE[0] * SIZE[1]]
        return head + bytes(step * SIZE[0] * SIZE[1])

    return image


def seeing(degrees: float) -> PinholeCamera:
    fov_rad = math.radians(degrees)
    return PinholeCamera.from_field_of_view(width_px=40, height_px=30, horizontal_fov_rad=fov_rad)


def bent(widths: float) -> PinholeCamera:
    """Return the camera whose lens moves the corner by so many times the width."""
    x, y = CAMERA.cx_px / CAMERA.fx_px, CAMERA.cy_px / CAMERA.fy_px
    factor = widths * CAMERA.width_px / math.hypot(CAMERA.cx_px, CAMERA.cy_px)
    return lens(distortion=(factor / (x * x + y * y), 0.0, 0.0, 0.0, 0.0))


def frozen(stamp_ns: int) -> bytes:
    return image_to_raw((np.arange(1200) % 200).reshape(30, 40).astype(np.uint8), stamp_ns)


FAULTS: dict[str, tuple[Robot, str, str, str]] = {
    'no camera': (Robot(publishers={IMAGE: ()}), IMAGE, WRONG, 'publishes it; start its driver'),
    'no odometry, bumpers are optional': (
        Robot(
            robot=RobotConfig(bumpers='optional'),
            publishers={ODOM: ()},
            topics=frozenset({GROUND_TRUTH, IMAGE, COMPRESSED_IMAGE}),
        ),
        ODOM, WRONG, 'publishes it; start its driver',
    ),
    'no joint states': (
        Robot(publishers={JOINT_STATES: ()}), JOINT_STATES, WRONG, 'head: none of landmark',
    ),
    'only compressed images': (
        Robot(publishers={IMAGE: ()}, topics=frozenset({COMPRESSED_IMAGE})),
        IMAGE, WRONG, 'image_transport: compressed',
    ),
    'only raw images': (
        Robot(
            inputs=InputConfig(image_transport='compressed'),
            publishers={COMPRESSED_IMAGE: ()},
            topics=frozenset({IMAGE}),
        ),
        COMPRESSED_IMAGE, WRONG, 'image_transport: raw',
    ),
    'advertised, silent': (
        Robot(ticks={ODOM: range(0)}), ODOM, WRONG, 'nothing comes; start the driver',
    ),
    'silent bumpers': (
        Robot(ticks={BUMPERS: range(0)}), BUMPERS, WRONG, 'nothing comes; start the driver',
    ),
    'a silent calibration': (
        Robot(ticks={CAMERA_INFO: range(0)}), CAMERA_INFO, WRONG, 'nothing comes; latch it',
    ),
    'one message': (Robot(ticks={BUMPERS: range(1)}), BUMPERS, WARN, '0.0 Hz is slow'),
    'one image': (Robot(ticks={IMAGE: range(1)}), IMAGE, WARN, '0.0 Hz is slow'),
    'another type': (
        Robot(publishers={ODOM: (End(node='base', kind='geometry_msgs/msg/PoseStamped'),)}),
        ODOM, WRONG, 'send nav_msgs/msg/Odometry',
    ),
    'two publishers': (
        Robot(publishers={IMAGE: two('sensor_msgs/msg/Image')}), IMAGE, WRONG, 'one and other',
    ),
    'unknown encoding': (
        Robot(image=lambda ns: picture(ns, 'h264')), IMAGE, WRONG, "encoding = 'h264'",
    ),
    'cut images': (Robot(raw={IMAGE: lambda raw: raw[:-8]}), IMAGE, WRONG, 'too short'),
    'dark images': (Robot(image=dark('mono8', 1)), IMAGE, WARN, 'all pixels are 0; take off'),
    'dark deep images': (
        Robot(image=dark('mono16', 2)), IMAGE, WARN, '0; image_bits: 10 or 12 of landmark',
    ),
    'dark deep images by another name': (
        Robot(image=dark('16UC1', 2)), IMAGE, WARN, '0; image_bits: 10 or 12 of landmark',
    ),
    'frozen images': (Robot(image=frozen), IMAGE, WARN, 'all images are the same'),
    'slow images': (
        Robot(
            ticks={IMAGE: range(0, TICKS, 3)}, stamps={IMAGE: slowly}, arrivals={IMAGE: slowly}
        ),
        IMAGE, WARN, '7.6 Hz is slow',
    ),
    'a gap': (
        Robot(
            stamps={ODOM: lambda s: s + 0.6 * (s > NOW_S + 2.0)},
            arrivals={ODOM: lambda s: s + 0.6 * (s > NOW_S + 2.0)},
        ),
        ODOM, WARN, 'a gap of 0.6 s',
    ),
    'zero stamps': (Robot(stamps={ODOM: lambda _: 0.0}), ODOM, WRONG, 'stamps are zero'),
    'one stamp for all': (
        Robot(stamps={JOINT_STATES: lambda _: NOW_S + 2.5}), JOINT_STATES, WRONG, 'the same',
    ),
    'stamps that go back': (
        Robot(stamps={ODOM: lambda s: s - 0.1 * (round(25 * s) % 2)}),
        ODOM, WRONG, 'stamps go back',
    ),
    'two clocks': (Robot(stamps={ODOM: simulated}), ODOM, WRONG, 'use_sim_time'),
    'a clock behind': (
        Robot(stamps={BUMPERS: lambda s: s - 1.5}), BUMPERS, WRONG, '1.5 s behind those',
    ),
    'a clock ahead': (Robot(stamps={ODOM: lambda s: s + 1.5}), ODOM, WRONG, '1.5 s ahead of'),
    'late odometry': (
        Robot(arrivals={ODOM: lambda s: s + 0.22}), ODOM, WARN, 'input_wait_s: 0.25',
    ),
    'later odometry': (
        Robot(arrivals={ODOM: lambda s: s + 0.255}), ODOM, WARN, 'input_wait_s: 0.25',
    ),
    'old images': (Robot(arrivals={IMAGE: lambda s: s + 0.7}), IMAGE, WARN, '0.70 s old'),
    'no calibration': (
        Robot(raw={CAMERA_INFO: replaced(number(CAMERA.fx_px), number(0.0))}),
        CAMERA_INFO, WRONG, 'fx_px = 0.0',
    ),
    'calibrated at another size': (
        Robot(camera=lens(width_px=80, height_px=60, cx_px=39.5, cy_px=29.5)),
        IMAGE, WRONG, 'says 80x60',
    ),
    'calibrated at half the size': (
        Robot(camera=lens(width_px=20, height_px=15, cx_px=9.5, cy_px=7.0)),
        IMAGE, WRONG, 'says 20x15',
    ),
    'a field of view that is too small': (
        Robot(camera=seeing(19.4)), CAMERA_INFO, WRONG, 'view of 19 deg',
    ),
    'a field of view that is too large': (
        Robot(camera=seeing(150.6)), CAMERA_INFO, WRONG, 'view of 151 deg',
    ),
    'an absurd field of view': (
        Robot(camera=lens(fx_px=500.0, fy_px=500.0)), CAMERA_INFO, WRONG, 'view of 5 deg',
    ),
    'pixels that are not square': (
        Robot(camera=lens(fy_px=1.3 * CAMERA.fy_px)),
        CAMERA_INFO, WARN, 'K has pixels of 0.77 times their height',
    ),
    'pixels that are wide': (
        Robot(camera=lens(fy_px=CAMERA.fy_px / 1.3)),
        CAMERA_INFO, WARN, 'K has pixels of 1.30 times their height',
    ),
    'a centre elsewhere': (Robot(camera=lens(cx_px=3.0)), CAMERA_INFO, WRONG, 'centre at 3, 14'),
    'an absurd lens': (
        Robot(camera=lens(distortion=(30.0, 0.0, 0.0, 0.0, 0.0))),
        CAMERA_INFO, WARN, 'moves a corner by',
    ),
    'a lens that is too strong': (
        Robot(camera=bent(0.55)), CAMERA_INFO, WARN, 'moves a corner by 22 px',
    ),
    'an unknown lens model': (
        Robot(
            camera=lens(distortion=(0.1, 0.0, 0.0, 0.0, 0.0)),
            raw={CAMERA_INFO: replaced(b'plumb_bob', b'thin_lens')},
        ),
        CAMERA_INFO, WRONG, "distortion_model = 'thin_lens'",
    ),
    'a joint without its name': (
        Robot(joints=('turret_joint', 'tilt_joint')), JOINT_STATES, WRONG, 'pan_joint is missing',
    ),
    'degrees': (Robot(head=replace(LEVEL, turret_rad=90.0)), JOINT_STATES, WRONG, 'send radians'),
    'a position that is not finite': (
        Robot(pose=Pose2(x_m=math.nan, y_m=0.0, heading_rad=0.0)), ODOM, WRONG, 'nan',
    ),
    'far away': (
        Robot(pose=Pose2(x_m=0.0, y_m=-100.5, heading_rad=0.0)), ODOM, WARN, 'is at -0, -100',
    ),
    'a robot that moves': (Robot(crept_m=(0.015, 0.015)), ODOM, WARN, 'moves by itself'),
    'millimetres': (
        Robot(pose=Pose2(x_m=1500.0, y_m=0.0, heading_rad=0.0)),
        ODOM, WARN, 'positions are metres',
    ),
    'no bumpers': (Robot(publishers={BUMPERS: ()}), BUMPERS, WRONG, 'bumpers: optional'),
    'a pressed bumper': (
        Robot(pressed=tuple(i == 4 for i in range(20))), BUMPERS, WARN, 'bumper 4 is pressed',
    ),
    'nobody drives': (Robot(drive=()), CMD_VEL, WRONG, 'nobody listens; remap the topic of'),
    'a base that takes something else': (
        Robot(drive=(End(node='base', kind='std_msgs/msg/String'),)),
        CMD_VEL, WRONG, f'base expects std_msgs/msg/String; take {STAMPED}',
    ),
    'a head that takes something else': (
        Robot(heads=(End(node='head', kind=TWIST),)),
        HEAD_COMMAND, WRONG, 'take sensor_msgs/msg/JointState',
    ),
    'a base that takes a Twist': (
        Robot(drive=(End(node='base', kind=TWIST),)), CMD_VEL, WRONG, 'stamped_cmd_vel: false',
    ),
    'a base that takes a TwistStamped': (
        Robot(robot=RobotConfig(stamped_cmd_vel=False)), CMD_VEL, WRONG, 'stamped_cmd_vel: true',
    ),
    'another driver': (
        Robot(drivers=(End(node='joystick', kind=STAMPED),)), CMD_VEL, WRONG, 'joystick commands',
    ),
    'a head that does not listen': (
        Robot(heads=()), HEAD_COMMAND, WRONG, 'nobody listens; subscribe the head to it',
    ),
}  # fmt: skip


@pytest.mark.parametrize(('robot', 'subject', 'level', 'words'), FAULTS.values(), ids=FAULTS)
def test_a_planted_fault_is_named_with_its_cure(
    robot: Robot, subject: str, level: str, words: str
) -> None:
    verdicts = robot.verdicts()
    (fault,) = [v for v in verdicts if v.level in (WARN, WRONG)]
    assert (fault.subject, fault.level) == (subject, level)
    assert words in f'{fault.text}; {fault.cure}'
    assert fault.cure
    assert can_drive(verdicts) == (level == WARN)
    if subject in TOPICS:
        ok = ['ok'] if level == WARN else []
        assert [v.level for v in verdicts if v.subject == subject] == [*ok, level]


def test_optional_bumpers_that_have_sent_nothing_yet_keep_no_robot_from_driving() -> None:
    robot = Robot(robot=RobotConfig(bumpers='optional'), ticks={BUMPERS: range(0)})
    (fault,) = [v for v in robot.verdicts() if v.level not in ('ok', 'note')]
    assert (fault.subject, fault.level) == (BUMPERS, WARN)
    assert fault.text == 'advertised, but nothing comes'
    assert can_drive(robot.verdicts())


@pytest.mark.parametrize(
    'robot',
    [
        *(Robot(camera=camera) for camera in (seeing(20.5), seeing(149.5), bent(0.45))),
        Robot(pose=Pose2(x_m=99.5, y_m=0.0, heading_rad=0.0)),
        Robot(arrivals=dict.fromkeys(TOPICS, lambda s: s + 60.5)),
    ],
)
def test_what_is_just_within_the_limits_is_no_fault(robot: Robot) -> None:
    assert [v for v in robot.verdicts() if v.level not in ('ok', 'note')] == []


def test_stamps_of_a_minute_ago_are_of_a_slow_network() -> None:
    robot = Robot(arrivals=dict.fromkeys(TOPICS, lambda s: s + 59.5))
    late = [v.subject for v in robot.verdicts() if 'stamps are 59.50 s old' in v.text]
    assert late == [IMAGE, ODOM, JOINT_STATES, BUMPERS]


def standing(
    *rays: tuple[float, float],
    turret_rad: float = 0.0,
    pan_rad: float = 0.0,
    tilt_rad: float = 0.0,
    pose: Pose2 = ORIGIN,
) -> Measurement:
    head = HeadAngles(turret_rad=turret_rad, pan_rad=pan_rad, tilt_rad=tilt_rad)
    return Measurement(head=head, pose=pose, rays=np.array(rays).reshape(-1, 2))


def at(*bearings_rad: float, tilt_rad: float = 0.0) -> list[tuple[float, float]]:
    return [(math.tan(bearing), math.tan(tilt_rad)) for bearing in bearings_rad]


MOTIONS: dict[str, tuple[float, float, str]] = {
    'a joint that turns the other way': (-TURN_RAD, -TURN_RAD, 'the sign is wrong'),
    'a joint that does not move': (0.001, TURN_RAD, 'is it enabled?'),
    'a joint in degrees': (10.0, TURN_RAD, 'radians, not degrees'),
    'a joint of half the scale': (0.5 * TURN_RAD, TURN_RAD, 'the scale is wrong'),
    'a joint of twice the scale': (2.0 * TURN_RAD, TURN_RAD, 'the scale is wrong'),
    'a joint of neither radians nor degrees': (1e3 * TURN_RAD, TURN_RAD, 'the scale is wrong'),
    'a joint that turns half and the other way': (-0.5 * TURN_RAD, TURN_RAD, 'the sign is wrong'),
    'a mirrored camera': (TURN_RAD, -TURN_RAD, 'mirrored'),
    'a focal length of half': (TURN_RAD, 0.5 * TURN_RAD, 'K be wrong'),
}


@pytest.mark.parametrize(('reported', 'seen', 'words'), MOTIONS.values(), ids=MOTIONS)
def test_a_wrong_sign_or_scale_is_named(reported: float, seen: float, words: str) -> None:
    before = standing(*at(-0.1, 0.2), turret_rad=0.3)
    after = standing(*at(seen - 0.1, seen + 0.2), turret_rad=0.3 + reported)
    verdicts = judge_motion('turret_joint', before, after)
    (wrong,) = [verdict for verdict in verdicts if verdict.level == WRONG]
    assert words in wrong.cure


def levels(subject: str, before: Measurement, after: Measurement) -> list[str]:
    return [verdict.level for verdict in judge_motion(subject, before, after)]


def test_motions_as_commanded_have_no_fault() -> None:
    before, two_leds = standing(*at(-0.1, 0.2)), at(TURN_RAD - 0.1, TURN_RAD + 0.2)
    turned = standing(*two_leds, turret_rad=TURN_RAD)
    reported, _ = judge_motion('turret_joint', before, turned)
    assert reported.text == 'reported +0.175 rad of +0.175'
    assert levels('turret_joint', before, turned) == ['ok', 'ok']
    up = standing(*at(-0.1, 0.2, tilt_rad=TURN_RAD), tilt_rad=TURN_RAD)
    assert levels('tilt_joint', before, up) == ['ok', 'ok']
    left = replace(ORIGIN, heading_rad=TURN_RAD)
    assert levels(TURN, before, standing(*two_leds, pose=left)) == ['ok', 'ok']
    before = standing(*at(-0.1, 0.2), turret_rad=0.3, pan_rad=0.2)
    against = standing(*at(-0.1, 0.2), turret_rad=0.1, pan_rad=0.4 - TURN_RAD, pose=left)
    assert levels(TURN, before, against) == ['ok', 'ok']


@pytest.mark.parametrize(
    ('subject', 'before', 'after', 'seen'),
    [
        ('turret_joint', 0, 0, [WARN]),
        ('turret_joint', 1, 1, ['ok']),
        ('turret_joint', 1, 2, [WARN]),
        ('turret_joint', 2, 1, [WARN]),
        (TURN, 1, 1, ['ok']),
        (DRIVE, 1, 1, [WARN]),
        (DRIVE, 2, 2, []),
    ],
)
def test_a_motion_is_seen_where_the_same_leds_are_visible(
    subject: str, before: int, after: int, seen: list[str]
) -> None:
    turn_rad = 0.0 if subject == DRIVE else TURN_RAD
    pose = replace(ORIGIN, x_m=0.1, heading_rad=turn_rad)
    turret_rad = TURN_RAD if subject == 'turret_joint' else 0.0
    moved = standing(*at(turn_rad, turn_rad + 0.1)[:after], turret_rad=turret_rad, pose=pose)
    assert levels(subject, standing(*at(0.0, 0.1)[:before]), moved) == ['ok', *seen]


def test_leds_that_move_together_while_it_drives_ahead_are_a_fault() -> None:
    far, near = at(-0.1, 0.1), at(-0.105, 0.105)
    ahead = replace(ORIGIN, x_m=0.1)
    assert levels(DRIVE, standing(*far), standing(*near, pose=ahead)) == ['ok']
    assert levels(DRIVE, standing(*near), standing(*far, pose=ahead)) == ['ok', WRONG]
    noise = at(-0.0999, 0.0999)  # 0.1 %: less than it takes to tell
    assert levels(DRIVE, standing(*far), standing(*noise, pose=ahead)) == ['ok']
    back = replace(ORIGIN, x_m=-0.1)  # one fault, told once
    assert levels(DRIVE, standing(*near), standing(*far, pose=back)) == [WRONG]
    # tan(0.1) / tan(0.105) = 0.952
    assert '4.8%' in [*judge_motion(DRIVE, standing(*near), standing(*far, pose=ahead))][1].text


def test_a_drive_is_measured_along_the_heading() -> None:
    before = Pose2(x_m=1.0, y_m=2.0, heading_rad=1.0)
    x_m, y_m = 1.0 + 0.12 * math.cos(1.0), 2.0 + 0.12 * math.sin(1.0)
    after = replace(before, x_m=x_m, y_m=y_m)
    reported, _ = judge_motion(DRIVE, standing(pose=before), standing(pose=after))
    assert (reported.level, reported.text) == ('ok', 'reported +0.120 m of +0.100')
