"""A robot in an arena that shares no code with goalreach: MuJoCo's physics and MuJoCo's images.

It takes the place of the node `nomad200`; see README.md. The robots are the XML files beside it.
Metres, radians counter-clockwise; `_dn` are grey values; a step is a millisecond.
"""

import argparse
from array import array
from collections import defaultdict
from contextlib import suppress
from ctypes.util import find_library
import math
import os
from pathlib import Path
import signal
import time
from typing import Any

import cv2
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, LaserScan
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
import yaml

os.environ.setdefault('MUJOCO_GL', 'egl' if find_library('EGL') else 'osmesa')
import mujoco  # chooses its renderer by that variable when it is imported
from obstacles import FARTHEST_M, OCCLUDERS, ROOM, Obstacles, add_obstacles
from sensor import Sensor, blur_and_shrink
from surfaces import add_lights, add_surfaces, paint_walls
from wheels import fit_wheels

HERE, STEP_S = Path(__file__).parent, 0.001
BODY_M, EYE_M, WHEEL_M, AXLE_M = 0.225, 1.1, 0.06, 0.16  # radii, height, half of the track
BRIGHTEST_DN = 1200.0  # the brightest light
TILE, EDGE_PX, LIGHTS = 256, 128, 3  # sizes of tile and border; group of geoms
TYRES = {'hard': 0.004, 'soft': 0.025}  # solref: a bend of 1 m/s^2 slips at half of it, m/s
SENDS = {
    '/clock': Clock, '/ground_truth/odom': Odometry, '/odom': Odometry, '/bumpers': LaserScan,
    '/joint_states': JointState, '/camera/camera_info': CameraInfo, '/sonar': LaserScan,
}  # fmt: skip
TAKES = {'/cmd_vel': TwistStamped, '/head/command': JointState}
OPTIONS = {
    'ambient': 0, 'blur': 1.2, 'exposure': 2, 'led-radius': 5, 'lens-offset': 0, 'camera-hz': 25,
    'odom-hz': 0, 'joints-hz': 0, 'jitter-ms': 0, 'delay-ms': 0, 'late-ms': 0,
}  # fmt: skip


def build(options: argparse.Namespace, arena: dict[str, Any], rng: Any) -> Any:
    """Return the MuJoCo model of robot and arena, with errors of construction."""
    spec = mujoco.MjSpec.from_file(str(HERE / f'{options.base}.xml'))
    add_lights(spec, arena, options, rng)
    add_surfaces(spec, arena, rng)
    add_obstacles(spec, arena)
    spec.material('floor').reflectance = 0.15 * options.reflections
    spec.camera('eye').pos = [options.lens_offset / 1000, 0, 0]
    spec.body('mast').pos[2] += rng.normal(0, 0.0063)
    spec.body('head').quat = [1, 0, *rng.normal(0, 0.0013, 2)]  # halves of tilt and pan
    fit_wheels(spec, TYRES[options.tyres], rng)
    return spec.compile()


class Robot:
    """The base, its head, their encoders and the camera, in MuJoCo."""

    def __init__(self, options: argparse.Namespace, arena: dict[str, Any]) -> None:
        self.options, self.synchro = options, options.base == 'nomad200'
        rng = np.random.default_rng(options.seed)
        self.model = model = build(options, arena, rng)
        self.data, roll, turn = mujoco.MjData(model), 1 / WHEEL_M, AXLE_M / WHEEL_M
        mix = [[roll, 0]] * 3 + [[0, 1]] * 3 if self.synchro else [[roll, -turn], [roll, turn]]
        self.mix = np.array(mix, float)  # from speed and turning rate to those of the motors
        self.unmix = np.linalg.pinv(self.mix)
        self.driven = model.jnt_qposadr[model.actuator_trnid[: len(mix), 0]]
        self.columns, self.rows = model.cam_resolution[0].tolist()
        self.calibrated_px = self.rows / 2 / math.tan(math.radians(model.cam_fovy[0]) / 2)
        self.focal_px = self.calibrated_px * rng.normal(1, 0.003)
        paint_walls(model, options, rng)
        self.whole, self.view = mujoco.Renderer(model, self.rows, self.columns), mujoco.MjvOption()
        self.tile = mujoco.Renderer(model, TILE, TILE)
        self.lights = np.flatnonzero(model.geom_group == LIGHTS)
        self.obstacles = Obstacles(model, self.data, arena, options.seed)
        self.reset([arena['width_m'] / 2, 0.8 * arena['length_m'], -math.pi / 2])

    def reset(self, start: list[float]) -> None:
        """Put the robot at a pose, at rest; odometry begins there."""
        mujoco.mj_resetData(self.model, self.data)
        self.obstacles.restart()
        self.pressed = self.data.sensordata > 0  # since they were read last
        self.data.qpos[[0, 1, 3, 6]] = *start[:2], math.cos(start[2] / 2), math.sin(start[2] / 2)
        self.wanted, self.speed, self.head = np.zeros(2), np.zeros(2), np.zeros(3 * self.synchro)
        self.age_s, self.odometry, self.turned = math.inf, np.array(start), 0.0

    def steered(self) -> float:
        """Drive heading relative to the base."""
        return float(self.data.qpos[self.driven][3:].sum() / 3)

    def truth(self) -> list[float]:
        """Pose of the drive heading in `map`."""
        x, y, _, w, _, _, z = self.data.qpos[:7].tolist()
        return [x, y, 2 * math.atan2(z, w) + self.steered()]

    def step(self) -> None:
        """Simulate a step: set points, physics, wheel encoders."""
        moving = self.age_s < 0.4  # so that it stands half a second after the last command
        self.age_s += STEP_S
        change = STEP_S * np.array([0.762 if moving else 5.08, 0.524 if self.synchro else 2.0])
        wanted = np.clip(self.wanted * moving, (-0.508, -1.047), (0.508, 1.047))
        self.speed += np.clip(wanted - self.speed, -change, change)
        self.data.ctrl[:] = [*self.mix @ self.speed, *8 * (self.head - self.data.act[3:])]
        self.obstacles.move(STEP_S)
        mujoco.mj_step(self.model, self.data)
        self.pressed |= self.data.sensordata > 0
        turned, heading = self.data.qpos[self.driven], self.odometry[2]
        (ahead, turn), self.turned = self.unmix @ (turned - self.turned), turned
        self.odometry += ahead * math.cos(heading), ahead * math.sin(heading), turn

    def render(self) -> Any:
        """Return the light on each pixel now, (rows, columns) in grey values."""
        mujoco.mj_kinematics(self.model, self.data)  # a step leaves places as they were before it
        mujoco.mj_camlight(self.model, self.data)
        sigma_px = max(self.options.blur, 0.01)
        image = np.zeros((self.rows + 2 * EDGE_PX, self.columns + 2 * EDGE_PX), np.float32)
        inside = image[EDGE_PX:-EDGE_PX, EDGE_PX:-EDGE_PX]
        if self.options.ambient:
            inside[:] = self.shoot(self.whole, [ROOM], 0, 0, self.rows)[..., 0]
            inside[:] = cv2.GaussianBlur(inside, (0, 0), sigma_px)
        offsets = self.data.geom_xpos[self.lights] - self.data.cam_xpos[0]
        points = offsets @ self.data.cam_xmat[0].reshape(3, 3)  # right, up, backward
        for (x, y, z), radius in zip(points, self.model.geom_size[self.lights, 0], strict=True):
            scale = self.focal_px / max(-z, 0.01)
            half = 2 ** math.ceil(math.log2(max(8, 2 + 4 * sigma_px + scale * radius)))
            left, top = self.columns / 2 + scale * x, self.rows / 2 - scale * y
            if half < EDGE_PX and 0 <= left < self.columns and 0 <= top < self.rows:
                left, top, size = round(left) - half, round(top) - half, 2 * half
                fine = self.shoot(self.tile, [LIGHTS, OCCLUDERS], left, top, size)
                light = blur_and_shrink(fine, TILE / size * sigma_px, size)
                window = image[EDGE_PX + top :, EDGE_PX + left :][:size, :size]
                window += BRIGHTEST_DN * light[..., 0] - light[..., 1] * window
        return inside

    def shoot(self, renderer: Any, groups: list[int], left: int, top: int, size: int) -> Any:
        """Return red, green and blue of groups of geoms in `size` rows of pixels."""
        self.view.geomgroup[:] = np.isin(np.arange(6), groups)
        renderer.update_scene(self.data, 'eye', self.view)
        for camera in renderer.scene.camera:
            scale, width = camera.frustum_near / self.focal_px, size * renderer.width
            camera.frustum_center = scale * (left + width / renderer.height / 2 - self.columns / 2)
            camera.frustum_top = scale * (self.rows / 2 - top)
            camera.frustum_bottom = scale * (self.rows / 2 - top - size)
        return renderer.render()


class World:
    """The node: sensors by their clocks, commands, services; in lockstep or in real time."""

    def __init__(self, options: argparse.Namespace, arena: dict[str, Any]) -> None:
        self.options, self.robot = options, Robot(options, arena)
        self.rng, robot = np.random.default_rng([options.seed, 1]), self.robot
        self.sensor = Sensor((robot.rows, robot.columns, 3)[: 3 - robot.synchro], self.rng)
        self.node = node = rclpy.create_node('nomad200')
        self.image = '/camera/image_raw' + '/compressed' * options.compressed
        sends = {**SENDS, self.image: CompressedImage if options.compressed else Image}
        self.out = {topic: node.create_publisher(kind, topic, 10) for topic, kind in sends.items()}
        for topic, kind in TAKES.items():
            node.create_subscription(kind, topic, lambda m, t=topic: self._on_command(t, m), 10)
        self.takes = [node.resolve_topic_name(topic) for topic in TAKES][: 1 + self.robot.synchro]
        node.declare_parameter('start_pose', self.robot.truth())
        mount = [options.lens_offset / 1000, 0.0, EYE_M, 0.0, 0.0, 0.0]
        node.declare_parameter('camera_mount', mount)
        node.create_service(Trigger, '~/reset', self._on_reset)
        node.create_service(SetBool, '~/pause', self._on_pause)
        self.steps, self.stamp_ns, self.due_s = 0, -1, time.monotonic()
        self.paused, self.placed, self.missing = False, False, set[str]()
        self.agenda, self.last = defaultdict[int, list[Any]](list), dict[str, Any]()
        self.with_image = [lambda: self._send_pose('/ground_truth/odom', self.robot.truth())]
        clocks = {self._send_base: options.odom_hz, self._send_joints: options.joints_hz}
        for send, hz in clocks.items():
            if hz:
                self._plan_sensor(send, self.rng.uniform(), hz)
            else:
                self.with_image.append(send)
        self._plan_image(1)

    def _when(self, sample: float, hz: float) -> int:
        at = sample / hz / STEP_S + self.rng.uniform(-1, 1) * self.options.jitter_ms
        return int(max(round(at), self.steps + math.ceil(self.options.exposure / 2) + 1))

    def _plan_sensor(self, send: Any, n: float, hz: float) -> None:
        self.agenda[self._when(n, hz)] += [send, lambda: self._plan_sensor(send, n + 1, hz)]

    def _plan_image(self, sample: int) -> None:
        """Plan an image: its exposures, what is read at its stamp, and when it is out."""
        half, film, hz = self.options.exposure / 2, list[Any](), self.options.camera_hz
        if not self.options.lockstep:  # an image that would be late is left out
            late_s = max(time.monotonic() - self.due_s, 0)
            sample = max(sample, math.ceil((self.steps * STEP_S + late_s) * hz))
        step = self._when(sample, hz)
        for offset in np.linspace(-half, half, 2 * math.ceil(half / 4) + 1):
            self.agenda[step + round(offset)].append(lambda: film.append(self.robot.render()))
        stamp, end = step + round(self.options.late_ms), step + round(half)
        self.agenda[stamp] += self.with_image
        out = max(stamp, step + round(half + self.options.delay_ms))
        self.agenda[end].append(lambda: self._plan_image(sample + 1))
        self.agenda[out].append(lambda: self._send_image(film, stamp))

    def act(self) -> None:
        """Simulate until an image is out, in real time only to now; repeat what may be lost."""
        now_s, lockstep = time.monotonic(), self.options.lockstep
        if lockstep and self.stamp_ns < 0 and not all(map(self.node.count_publishers, self.takes)):
            self.due_s = now_s + 0.5  # the two ends of a topic find each other one by one
        if self.paused:
            self.due_s = now_s
        elif self.missing and now_s > self.due_s + 1:
            for topic, message in self.last.items():
                self.out[topic].publish(message)
            self.due_s = now_s
        elif not self.missing and now_s >= self.due_s:
            stamp_ns, self.missing = self.stamp_ns, set(list(TAKES)[: lockstep * len(self.takes)])
            while self.stamp_ns == stamp_ns and (lockstep or self.due_s <= now_s):
                self.robot.step()
                self.steps, self.due_s = self.steps + 1, self.due_s + STEP_S
                for action in self.agenda.pop(self.steps, ()):
                    action()
            self.due_s = now_s if lockstep else max(self.due_s, now_s - 1)

    def _on_command(self, topic: str, message: Any) -> None:
        """Take a command; in lockstep only one that answers the last image."""
        stamp_ns = Time.from_msg(message.header.stamp).nanoseconds
        if self.options.lockstep and (stamp_ns != self.stamp_ns or topic not in self.missing):
            return
        self.missing.discard(topic)
        if topic == '/cmd_vel':
            self.robot.wanted[:] = message.twist.linear.x, message.twist.angular.z
            self.robot.age_s = max(0, self.steps * STEP_S - stamp_ns / 1e9) if stamp_ns else 0
        elif self.robot.synchro and not self.placed:  # else it was computed for another place
            targets = dict(zip(message.name, message.position, strict=False))
            turret, pan, tilt = (targets[f'{name}_joint'] for name in ('turret', 'pan', 'tilt'))
            turn = turret + self.robot.steered() - (now := self.robot.data.act[3])  # from the base
            self.robot.head[:] = now + math.remainder(turn, math.tau), pan, tilt

    def _on_reset(self, _: Any, response: Any) -> Any:
        """Put the robot at `start_pose`, if it is x, y, heading on the free floor."""
        start = self.node.get_parameter('start_pose').value.tolist()
        response.success = self.placed = len(start) == 3 and self.robot.obstacles.leave(*start[:2])
        if response.success:
            self.robot.reset(start)
        return response

    def _on_pause(self, request: Any, response: Any) -> Any:
        self.paused, response.success = request.data, True
        return response

    def _send(self, topic: str, message: Any) -> None:
        self.last[topic] = message
        self.out[topic].publish(message)

    def _header(self, frame: str, step: int = 0) -> Header:
        stamp = Time(nanoseconds=(step or self.steps) * 10**6).to_msg()
        return Header(frame_id=frame, stamp=stamp)

    def _send_pose(self, topic: str, pose: list[float]) -> None:
        header = self._header('odom' if topic == '/odom' else 'map')
        message = Odometry(header=header, child_frame_id='base_link')
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        at.x, at.y, turn.z, turn.w = pose[:2] + [math.sin(pose[2] / 2), math.cos(pose[2] / 2)]
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.robot.speed.tolist()
        self._send(topic, message)

    def _send_base(self) -> None:
        self._send_pose('/odom', self.robot.odometry.tolist())
        pressed = np.where(self.robot.pressed, BODY_M, math.inf).tolist()
        self.robot.pressed[:] = False
        self._send_scan('/bumpers', pressed, 2 * BODY_M)
        if self.robot.obstacles.sonar:
            self._send_scan('/sonar', self.robot.obstacles.hear(), FARTHEST_M)

    def _send_scan(self, topic: str, ranges: list[float], most: float) -> None:
        scan = LaserScan(header=self._header('bumper_link'), ranges=ranges, range_max=most)
        scan.angle_increment = math.tau / len(ranges)
        scan.angle_max = math.tau - scan.angle_increment
        self._send(topic, scan)

    def _send_joints(self) -> None:
        model, data = self.robot.model, self.robot.data
        names = [model.joint(i).name for i in range(model.njnt) if '_' in model.joint(i).name]
        angles = np.array([data.joint(name).qpos[0] for name in names])
        if self.robot.synchro:
            angles += self.rng.normal(0, (0, 0.0009, 0.0009))
            angles[0] = math.remainder(angles[0] - self.robot.steered(), math.tau)
        header, position = self._header('base_link'), angles.tolist()
        self._send('/joint_states', JointState(header=header, name=names, position=position))

    def _send_image(self, film: list[Any], step: int) -> None:
        """Send the mean of some exposures, and the calibration of the lens."""
        pixels = self.sensor.expose(film)
        (rows, columns), header = pixels.shape[:2], self._header('camera_optical_frame', step)
        info = CameraInfo(header=header, height=rows, width=columns, distortion_model='plumb_bob')
        f, cx, cy = self.robot.calibrated_px, (columns - 1) / 2, (rows - 1) / 2
        info.d, info.k = [0.0] * 5, [f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]
        image = Image(header=header, height=rows, width=columns)
        image.encoding, image.step = 'mono8' if self.robot.synchro else 'bgr8', pixels[0].size
        image.data = array('B', pixels.tobytes())
        if self.options.compressed:
            image = CompressedImage(header=header, format='jpeg')
            image.data = array('B', cv2.imencode('.jpg', pixels)[1].tobytes())
        self._send('/clock', Clock(clock=self._header('').stamp))
        self._send('/camera/camera_info', info)
        self._send(self.image, image)
        self.stamp_ns, self.placed = step * 10**6, False


def main() -> None:
    """Run the world until Ctrl-C or SIGTERM."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--arena', type=Path, default=HERE / 'arena.yaml', help='YAML file')
    parser.add_argument('--base', choices=('nomad200', 'differential'), default='nomad200')
    parser.add_argument('--tyres', choices=tuple(TYRES), default='hard')
    parser.add_argument('--seed', type=int, default=0, help='of all errors and noise')
    for flag in ('texture', 'lamps', 'reflections', 'lockstep', 'compressed'):
        parser.add_argument(f'--{flag}', action='store_true')
    for name, value in OPTIONS.items():
        parser.add_argument(f'--{name}', type=float, default=value, help=f'default {value}')
    options = parser.parse_args(remove_ros_args()[1:])
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        world = World(options, yaml.safe_load(options.arena.read_text(encoding='utf-8')))
    except (OSError, LookupError, TypeError, ValueError, yaml.YAMLError) as error:
        line = f'{options.arena}: {type(error).__name__}: {error}'
        raise SystemExit(' '.join(line.split())) from None
    with suppress(KeyboardInterrupt):
        while True:
            world.act()
            rclpy.spin_once(world.node, timeout_sec=0.005)
    world.robot.whole.close()
    world.robot.tile.close()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
