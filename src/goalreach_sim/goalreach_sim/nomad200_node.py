"""The `nomad200` node: the simulated robot in its arena behind ROS topics."""

from __future__ import annotations

from dataclasses import fields

from geometry_msgs.msg import TwistStamped
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.ros.common_messages import MessageError
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.ros.raw_robot import head_from_raw, twist_from_raw
from goalreach_msgs_py.ros.subscribe_raw import LATCHED_QOS, RELIABLE_QOS, subscribe_raw
from goalreach_msgs_py.topics import CMD_VEL, HEAD_COMMAND, MARKERS, PAUSE_SERVICE, RESET_SERVICE
from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_sim.ros.command_guard import CommandGuard
from goalreach_sim.ros.frame_publisher import FramePublisher
from goalreach_sim.ros.lockstep import LockstepClock
from goalreach_sim.ros.markers import arena_markers
from goalreach_sim.ros.realtime import RealtimeClock
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import (
    FaultParameters,
    SimulatedFaults,
    SimulatorConfig,
    TimeConfig,
)

_NAME = 'nomad200'
_THROTTLE_S = 5.0


class Nomad200Node(Node):
    """Adapter of one `Simulator`.

    Publishes: `/clock`, `/camera/image_raw`, `/camera/camera_info`, `/odom`, `/joint_states`,
    `/bumpers`, `/ground_truth/odom` once in a camera period; `/camera/image_raw/compressed` (JPEG)
    at most ten times a second of the wall clock, while somebody subscribes to it; `/arena/markers`
    once (latched); `/diagnostics`; and `/tf`, `/tf_static` where tf2_msgs is installed.
    Subscribes: `/cmd_vel`, `/head/command`, and of each of the parameter `consumers` the
    acknowledgements (see `AcknowledgementGate`).
    Services: `/nomad200/reset` (to the parameter `start_pose`), `/nomad200/pause`.
    Parameters: the fields of `SimulatorConfig`, `RegionConfig`, `TimeConfig` and, as `faults.*`,
    `SimulatedFaults`; `start_pose`, `speed`, `noise.*` and the faults may change while it runs.
    Other noise is another robot in the place of this one, its errors drawn anew.
    """

    def __init__(self) -> None:
        """Declare, build and start the clock."""
        super().__init__(_NAME)
        live = ['start_pose', *(f'noise.{field.name}' for field in fields(NoiseModel))]
        self._config = NodeConfig(self, SimulatorConfig, live=live, on_change=self._on_config)
        self._time = NodeConfig(self, TimeConfig, live=('speed',), on_change=self._on_time)
        names = [f'faults.{field.name}' for field in fields(SimulatedFaults)]
        NodeConfig(self, FaultParameters, live=names, on_change=self._on_faults)
        regions = NodeConfig(self, RegionConfig).value
        config, timing = self._config.value, self._time.value
        self._simulator = Simulator(config, np.random.default_rng(timing.seed))
        period_s = self._simulator.period_ns * 1e-9
        self._frames = FramePublisher(
            self,
            body_radius_m=config.body_radius_m,
            camera_height_m=config.camera_height_m,
            period_s=period_s,
        )
        self._diagnostics = Diagnostics(self)
        self._markers = self.create_publisher(MarkerArray, MARKERS, LATCHED_QOS)
        self._markers.publish(arena_markers(config, regions.region_map))
        subscribe_raw(self, TwistStamped, CMD_VEL, self._on_drive, RELIABLE_QOS)
        subscribe_raw(self, JointState, HEAD_COMMAND, self._on_head, RELIABLE_QOS)
        self.create_service(Trigger, RESET_SERVICE, self._on_reset)
        self.create_service(SetBool, PAUSE_SERVICE, self._on_pause)
        lockstep = timing.clock == 'lockstep'
        self._guard = CommandGuard(
            self,
            limit_s=config.watchdog_s,
            brakes_after_s=config.brakes_after_s,
            silence=not lockstep,
        )
        self._head_target: HeadAngles | None = None
        self._placed = False
        self._lockstep: LockstepClock | None = None
        self._realtime: RealtimeClock | None = None
        if lockstep:
            self._lockstep = LockstepClock(
                self,
                timeout_s=timing.answer_timeout_s,
                consumers=timing.consumer_names,
                period_ns=self._simulator.period_ns,
                tick=self._tick,
                repeat=self._repeat,
            )
        else:
            self._realtime = RealtimeClock(
                self,
                period_ns=self._simulator.period_ns,
                speed=timing.speed,
                tick=self._tick,
                consumers=timing.consumer_names,
            )

    def _tick(self) -> int:
        self._move_head()
        self._placed = False
        self._simulator.advance()
        frame = self._simulator.sense()
        stamp_ns = self._stamp_ns
        self._frames.publish(frame, stamp_ns)
        twist = frame.truth.twist
        moving = twist.linear_m_per_s != 0.0 or twist.steering_rad_per_s != 0.0
        self._guard.tick(stamp_ns, moving=moving)
        self._diagnostics.tick(
            stamp_ns,
            'driving',
            lambda: {'sim_time_s': stamp_ns * 1e-9, 'bumpers': sum(frame.bumpers)},
        )
        return stamp_ns

    @property
    def _stamp_ns(self) -> int:
        return self._time.value.start_time_ns + self._simulator.time_ns

    def _repeat(self) -> None:
        self._frames.repeat(self._stamp_ns)

    def _on_drive(self, stamp_ns: int, raw: bytes) -> None:
        try:
            command = twist_from_raw(raw)
        except MessageError as error:
            self._complain(CMD_VEL, error)
            return
        if self._is_due(CMD_VEL, stamp_ns):
            self._simulator.command_drive(command, self._guard.age_s(stamp_ns))
            self._note(CMD_VEL)

    def _on_head(self, stamp_ns: int, raw: bytes) -> None:
        try:
            target = head_from_raw(raw)
        except MessageError as error:
            self._complain(HEAD_COMMAND, error)
            return
        if self._is_due(HEAD_COMMAND, stamp_ns):
            self._head_target = target
            if self._lockstep is None:
                self._move_head()
            self._note(HEAD_COMMAND)

    def _move_head(self) -> None:
        """Take the head's target; in lockstep not before the tick, and not after a reset.

        A target that was worked out before the robot was placed elsewhere would count or not,
        as it arrived before the reset or after it.
        """
        target, self._head_target = self._head_target, None
        if target is not None and not self._placed:
            self._simulator.command_head(target)

    def _is_due(self, topic: str, stamp_ns: int) -> bool:
        if self._lockstep is None:
            return self._guard.accepts(topic, stamp_ns)
        return self._guard.accepts(topic, stamp_ns) and self._lockstep.accepts(topic, stamp_ns)

    def _note(self, topic: str) -> None:
        if self._lockstep is not None:
            self._lockstep.answered(topic)

    def _complain(self, topic: str, error: MessageError) -> None:
        self.get_logger().error(f'{topic}: {error}', throttle_duration_sec=_THROTTLE_S)

    def _on_config(self, config: SimulatorConfig) -> None:
        if config.noise != self._simulator.config.noise:
            self._simulator.change_noise(config.noise)
            self._placed = self._lockstep is not None

    def _on_time(self, timing: TimeConfig) -> None:
        if self._realtime is not None:
            self._realtime.set_speed(timing.speed)

    def _on_faults(self, parameters: FaultParameters) -> None:
        self._simulator.faults = parameters.faults

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        x_m, y_m, heading_rad = self._config.value.start_pose
        try:
            self._simulator.reset(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad))
        except ConfigurationError as error:
            response.message = str(error)
            return response
        self._placed = self._lockstep is not None
        response.success = True
        response.message = f'at {x_m:.3f} m, {y_m:.3f} m, {heading_rad:.3f} rad'
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        clock = self._lockstep or self._realtime
        if clock is not None:
            clock.paused = request.data
        response.success = True
        response.message = 'paused' if request.data else 'running'
        self.get_logger().info(response.message)
        return response


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(_NAME, [Nomad200Node]))


if __name__ == '__main__':
    main()
