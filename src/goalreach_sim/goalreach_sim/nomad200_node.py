"""The `nomad200` node: the simulated robot in its arena behind ROS topics."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import TwistStamped
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from goalreach_msgs_py import topics
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import parameter_infos
from goalreach_msgs_py.pose_messages import twist_from_raw
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.ros.messaging import (
    LATCHED_QOS,
    RELIABLE_QOS,
    StampedReply,
    advertise,
    frame_prefix,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.sensor_messages import head_from_raw
from goalreach_msgs_py.values import HeadAngles, Twist2
from goalreach_sim.ros.clocks import LockstepClock, RealtimeClock
from goalreach_sim.ros.command_guard import CommandGuard
from goalreach_sim.ros.publishers import FramePublisher, arena_markers, obstacle_markers
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import FaultParameters, SimulatorConfig, TimeConfig

_MARKER_TICKS = 5


class Nomad200Node(Node):
    """Adapter of one `Simulator`.

    Publishes: `/clock`, `/camera/image_raw`, `/camera/camera_info`, `/odom`, `/joint_states`,
    `/bumpers`, `/ground_truth/odom` and, with the parameter `sonar`, `/sonar` once in a camera
    period; `/camera/image_raw/compressed` (JPEG) at most ten times a second of the wall clock,
    while subscribed to; `/arena/markers` once (latched), moving obstacles with every fifth image;
    `/diagnostics`; and `/tf`, `/tf_static` where tf2_msgs is installed.
    Subscribes: `/cmd_vel`, `/head/command`, and the acknowledgements of each node in the parameter
    `consumers` (see `AcknowledgementGate`).
    Services: `/nomad200/reset` (to the parameter `start_pose`), `/nomad200/pause`,
    `/nomad200/step` (one tick, while paused).
    Parameters: the fields of `SimulatorConfig`, `RegionConfig`, `TimeConfig` and, as `faults.*`,
    `SimulatedFaults`; `start_pose`, `speed`, `goal_region`, `noise.*` and the faults may change
    while it runs.
    A change of the noise replaces the robot by one with newly drawn errors.
    """

    def __init__(self) -> None:
        super().__init__(topics.ROBOT)
        live = ['start_pose', *parameter_infos(NoiseModel, 'noise.')]
        self._config = NodeConfig(self, SimulatorConfig, live=live, on_change=self._on_config)
        self._time = NodeConfig(self, TimeConfig, live=('speed',), on_change=self._on_time)
        live = list(parameter_infos(FaultParameters))
        faults = NodeConfig(self, FaultParameters, live=live, on_change=self._on_faults).value
        live = ['goal_region']
        regions = NodeConfig(self, RegionConfig, live=live, on_change=self._on_regions).value
        config, timing = self._config.value, self._time.value
        self._simulator = Simulator(config, np.random.default_rng(timing.seed))
        self._on_faults(faults)
        self._lockstep = timing.clock == 'lockstep'
        self._reply = StampedReply()
        self._diagnostics = Diagnostics(self, self._reply)
        self._frames = FramePublisher(self, config, self._reply)
        self._markers = advertise(self, MarkerArray, topics.MARKERS, LATCHED_QOS)
        self._on_regions(regions)
        self._guard = CommandGuard(
            node=self,
            limit_s=config.watchdog_s,
            brakes_after_s=config.brakes_after_s,
            reports_silence=not self._lockstep,
        )
        self._obstacles_move = any(one.track_m for one in config.obstacle_list)
        self._ticks = 0
        self._head_target: HeadAngles | None = None
        self._was_placed = False
        self._subscribe(TwistStamped, topics.CMD_VEL, twist_from_raw, self._drive)
        self._subscribe(JointState, topics.HEAD_COMMAND, head_from_raw, self._turn_head)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(SetBool, '~/pause', self._on_pause)
        self.create_service(Trigger, '~/step', self._on_step)
        self._tick_clock = self._start_clock(timing)

    def _start_clock(self, timing: TimeConfig) -> LockstepClock | RealtimeClock:
        period_ns, tick = self._simulator.period_ns, self._tick
        if not self._lockstep:
            return RealtimeClock(node=self, timing=timing, period_ns=period_ns, tick=tick)

        def repeat() -> None:
            self._reply.begin(self._stamp_ns)

        return LockstepClock(
            node=self, timing=timing, period_ns=period_ns, tick=tick, repeat=repeat
        )

    def _tick(self) -> int:
        self._apply_head_target()
        self._was_placed = False
        self._simulator.advance()
        frame = self._simulator.sense()
        stamp_ns = self._stamp_ns
        self._frames.publish(frame, stamp_ns)
        self._ticks += 1
        if self._obstacles_move and self._ticks % _MARKER_TICKS == 0:
            obstacles = self._simulator.robot.walls.obstacles
            moved = obstacle_markers(obstacles, frame_prefix(self)).markers
            still = [one for one in self._arena.markers if one.ns != moved[0].ns]
            self._markers.publish(MarkerArray(markers=still + moved))
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

    def _subscribe(
        self,
        message_type: type[Any],
        topic: str,
        decode: Callable[[bytes], Any],
        execute: Callable[[Any, int], None],
    ) -> None:
        """Subscribe to commands, of which those that guard and clock accept are executed."""

        def on_command(stamp_ns: int, raw: bytes) -> None:
            command = decode(raw)
            if self._guard.accepts(topic, stamp_ns) and self._tick_clock.accepts(topic, stamp_ns):
                execute(command, stamp_ns)
                self._tick_clock.answered(topic)

        subscribe_raw(self, message_type, topic, on_command, RELIABLE_QOS)

    def _drive(self, command: Twist2, stamp_ns: int) -> None:
        if not self._was_placed:  # by a node that commands it for the pose before
            self._simulator.command_drive(command, self._guard.age_s(stamp_ns))

    def _turn_head(self, target: HeadAngles, _stamp_ns: int) -> None:
        self._head_target = target
        if not self._lockstep:
            self._apply_head_target()

    def _apply_head_target(self) -> None:
        """Command the head: in lockstep at the tick, and not after the robot was placed.

        A target computed for the pose before the reset would otherwise take effect or not,
        depending on which message arrived first.
        """
        if self._head_target is not None and not self._was_placed:
            self._simulator.command_head(self._head_target)
        self._head_target = None

    def _on_config(self, config: SimulatorConfig) -> None:
        if config.noise != self._simulator.config.noise:
            self._simulator.change_noise(config.noise)
            self._was_placed = self._lockstep

    def _on_regions(self, regions: RegionConfig) -> None:
        """Show the regions with their goal; nothing else here depends on them."""
        config, prefix = self._config.value, frame_prefix(self)
        self._arena = arena_markers(config, regions.region_map, prefix)
        self._markers.publish(self._arena)

    def _on_time(self, timing: TimeConfig) -> None:
        self._tick_clock.set_speed(timing.speed)

    def _on_faults(self, parameters: FaultParameters) -> None:
        self._simulator.faults = parameters.faults

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        start = self._config.value.start
        try:
            self._simulator.reset(start)
        except ConfigurationError as error:
            response.message = str(error)
            return response
        self._was_placed = self._lockstep
        response.success = True
        response.message = f'at {start.x_m:.3f} m, {start.y_m:.3f} m, {start.heading_rad:.3f} rad'
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._tick_clock.pause(on=request.data)
        response.success = True
        response.message = 'paused' if request.data else 'running'
        self.get_logger().info(response.message)
        return response

    def _on_step(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._tick_clock.step()
        response.message = 'advanced' if response.success else 'not paused, or not answered yet'
        return response


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(topics.ROBOT, [Nomad200Node]))


if __name__ == '__main__':
    main()
