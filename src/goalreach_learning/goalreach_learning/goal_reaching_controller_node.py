"""The `goal_reaching_controller` node: Q-learning and driving, crisp or fuzzy."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Path
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64MultiArray

from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.mission import MissionConfig
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.ros.placement import ConditionWait, RobotPlacement
from goalreach_learning.steering import STANDING
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.diagnostic_messages import q_table_to_raw, state_from_raw, transition_to_raw
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.inputs import StampSynchronizer
from goalreach_msgs_py.pose_messages import path_to_raw, twist_to_raw
from goalreach_msgs_py.regions import RegionConfig, region_name
from goalreach_msgs_py.ros.acknowledgement import is_subscribed
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    LATCHED_QOS,
    RELIABLE_QOS,
    InputReporter,
    StampedReply,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.sensor_messages import bumpers_from_raw
from goalreach_msgs_py.topics import BUMPERS, CMD_VEL, CONTROLLER, PATH, Q_TABLE, STATE, TRANSITION
from goalreach_msgs_py.values import Pose2, RegionState, Twist2

_THROTTLE_S = 5.0
_PATH_TICKS = 25
_POSE_TICKS = 5
_STUCK_TICKS = 25


class GoalReachingControllerNode(Node):
    """Adapter of one `GoalReachingController`, driving path after path.

    Publishes: `/cmd_vel` with the stamp of the state it answers, `/q_learning/transition`,
    `/q_learning/q_table` (latched), `/path` (about 1 Hz, while subscribed to), `/diagnostics`.
    Subscribes: `/state`, `/bumpers`; processes a stamp when both have arrived.
    Calls: `/nomad200/set_parameters`, `/nomad200/reset`, `/nomad200/pause`, if it has starts.
    Parameters: the fields of `ControllerConfig`, `MissionConfig` and `RegionConfig` (for a new
    policy); `mode` may change while it drives.
    """

    def __init__(self) -> None:
        super().__init__(CONTROLLER)
        self._mission = NodeConfig(self, MissionConfig).value
        config = NodeConfig(self, ControllerConfig, live=('mode',), on_change=self._on_config)
        rng = np.random.default_rng([self._mission.seed, self._mission.first_path])
        policy = self._policy(rng, learn=config.value.learn)
        self._controller = GoalReachingController(config.value, policy, rng)
        self._inputs = StampSynchronizer([STATE, BUMPERS])
        self._reporter = InputReporter(self, [STATE, BUMPERS], self._inputs.missing)
        self._reply = StampedReply()
        self._diagnostics = Diagnostics(self)
        self._placement = RobotPlacement(self)
        self._drive = self.create_publisher(TwistStamped, CMD_VEL, RELIABLE_QOS)
        self._transitions = self.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)
        consumer = self._mission.consumer
        self._subscription = ConditionWait(
            self,
            lambda: not consumer or is_subscribed(self, consumer, self._transitions),
            f'the first path waits for {consumer} to subscribe to {TRANSITION}',
        )
        self._q_table = self.create_publisher(Float64MultiArray, Q_TABLE, LATCHED_QOS)
        self._path = self.create_publisher(Path, PATH, RELIABLE_QOS)
        self._q_table.publish(q_table_to_raw(self._controller.policy.q))
        self._next_path = self._mission.first_path
        self._driving = False
        self._finished = False
        self._busy = False
        self._trail: list[tuple[int, Pose2]] = []
        self._ticks = self._pressed_ticks = 0
        on_state = self._collector(STATE, state_from_raw)
        on_bumpers = self._collector(BUMPERS, bumpers_from_raw)
        subscribe_raw(self, DiagnosticArray, STATE, on_state, RELIABLE_QOS)
        subscribe_raw(self, LaserScan, BUMPERS, on_bumpers, RELIABLE_QOS)

    def _policy(self, rng: np.random.Generator, *, learn: bool) -> Policy:
        if self._mission.policy:
            return read_policy(self._mission.policy)
        regions = NodeConfig(self, RegionConfig).value.region_map
        if learn:
            return Policy.unlearned(regions)
        self.get_logger().info('no policy given: learning one')
        return train(Arena(), rng=rng).policy

    def _save_policy(self, path: int) -> None:
        """Write the policy after a path, if it is learned."""
        if not (self._mission.policy_out and self._controller.config.learn):
            return
        policy = self._controller.policy
        learning = {**policy.learning, 'paths_driven': path + 1, 'seed': self._mission.seed}
        try:
            write_policy(self._mission.policy_out, replace(policy, learning=learning))
        except FileFormatError as error:
            self.get_logger().error(str(error))

    def _on_config(self, config: ControllerConfig) -> None:
        self._controller.config = config

    def _collector(
        self, topic: str, from_raw: Callable[[bytes], object]
    ) -> Callable[[int, bytes], None]:
        def collect(stamp_ns: int, raw: bytes) -> None:
            self._reporter.received(topic, stamp_ns)
            inputs = self._inputs.add(topic, stamp_ns, from_raw(raw))
            if inputs is None or self._busy or not self._reply.begin(stamp_ns):
                return
            self._note_bumpers(inputs[BUMPERS])
            self._process(stamp_ns, inputs[STATE], bumped=any(inputs[BUMPERS]))

        return collect

    def _note_bumpers(self, pressed: Sequence[bool]) -> None:
        """Warn of a bumper that stays pressed."""
        self._pressed_ticks = self._pressed_ticks + 1 if any(pressed) else 0
        if self._pressed_ticks and self._pressed_ticks % _STUCK_TICKS == 0:
            which = ', '.join(str(i) for i, on in enumerate(pressed) if on)
            self.get_logger().warning(
                f'bumper {which} has been pressed for {self._pressed_ticks} ticks: stuck, or '
                'the robot is at a wall',
                throttle_duration_sec=_THROTTLE_S,
            )

    def _process(self, stamp_ns: int, state: RegionState, *, bumped: bool) -> None:
        if self._finished:
            self._command(STANDING, stamp_ns)
            return
        if not self._driving:
            self._busy = True
            self._subscription.run(lambda: self._begin_next_path(stamp_ns))
            return
        step = self._controller.step(time_ns=stamp_ns, state=state, bumped=bumped)
        if step.policy_changed:
            self._reply.send(self._q_table, q_table_to_raw(self._controller.policy.q))
        if step.transition is not None:
            self._reply.send(self._transitions, transition_to_raw(step.transition, stamp_ns))
            if step.transition.outcome is not None:
                self._report(stamp_ns, state)
                self._save_policy(step.transition.path)
                self._begin_next_path(stamp_ns)
                return
        self._command(step.command, stamp_ns)
        self._report(stamp_ns, state)

    def _command(self, twist: Twist2, stamp_ns: int) -> None:
        self._reply.send(self._drive, twist_to_raw(twist, stamp_ns))

    def _begin_next_path(self, stamp_ns: int) -> None:
        """Start the next path; `/cmd_vel` is published only after the robot has been placed.

        A simulator in lockstep, which waits for that command, is thus placed between two ticks.
        """
        order = self._mission.path_order(self._next_path)

        def answer() -> None:
            self._busy = False
            self._command(STANDING, stamp_ns)

        if order is None:
            self._finished = self._busy = True
            self._placement.pause(answer)
            return
        self._next_path += 1
        self._driving = True
        self._trail.clear()
        self._controller.begin_path(start=order.start, path=order.path, trial=order.trial)
        if order.start is None:
            answer()
            return
        self._busy = True
        self._placement.place(order.start, answer)

    def _report(self, stamp_ns: int, state: RegionState) -> None:
        self._ticks += 1
        if self._ticks % _POSE_TICKS == 0:
            self._trail.append((stamp_ns, state.pose))
        if self._ticks % _PATH_TICKS == 0 and self._path.get_subscription_count():
            self._reply.send(self._path, path_to_raw(self._trail, stamp_ns))
        self._diagnostics.tick(
            stamp_ns,
            f'path {self._next_path}',
            lambda: {
                'region': region_name(state.region),
                'mode': self._controller.config.mode,
                'confidence': state.confidence.value,
            },
        )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(CONTROLLER, [GoalReachingControllerNode]))


if __name__ == '__main__':
    main()
