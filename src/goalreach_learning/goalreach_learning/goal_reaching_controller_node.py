"""The `goal_reaching_controller` node: Q-learning and driving, crisp or fuzzy."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from goalreach_learning.behaviors import GOAL, Opinion, Surroundings
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig, MissionConfig, RobotConfig
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.ros.opinions import opinion_markers, opinions_to_raw
from goalreach_learning.ros.placement import ConditionWait, RobotPlacement
from goalreach_learning.steering import STANDING
from goalreach_learning.training import arena_of, policy_for_goal, train
from goalreach_msgs_py import topics
from goalreach_msgs_py.alignment import InputAligner, Interpolation, either_pressed
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import (
    learner_to_raw,
    q_table_to_raw,
    state_from_raw,
    transition_to_raw,
)
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError
from goalreach_msgs_py.pose_messages import odometry_from_raw, path_to_raw, twist_to_raw
from goalreach_msgs_py.regions import RegionConfig, parse_region, region_name
from goalreach_msgs_py.ros.acknowledgement import Acknowledger, is_subscribed
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    LATCHED_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    AlignedInputs,
    InputReporter,
    StampedReply,
    advertise,
    frame_prefix,
    resolved_name,
    steady_timer,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.sensor_messages import bumpers_from_raw, scan_from_raw
from goalreach_msgs_py.values import Confidence, Pose2, RegionState, Twist2

_THROTTLE_S = 5.0
_BUMPER_WAIT_S = 0.1
"""Bumpers further than this from a state, either way, are not of its time. Chosen."""
_LIVE = ('mode', 'goal')
_PATH_TICKS = 25
_POSE_TICKS = 5
_STUCK_TICKS = 25
_STOP_CHECK_S = 0.1
_STOP_SENT_S = 0.5
_SETTLE_NS = 1_000_000_000
"""Time in which the localizer notices that somebody has placed the robot elsewhere. Chosen."""


class GoalReachingControllerNode(Node):
    """Adapter of one `GoalReachingController`, driving path after path.

    Publishes: `/cmd_vel` with the stamp of the state it answers, `/q_learning/transition`,
    `/q_learning/q_table` (latched), `/q_learning/model` (latched, of learners that keep more than
    a table), `/path` (about 1 Hz, while subscribed to), `/diagnostics`.
    Where more behaviours than goal-reaching are at work, `/behaviors` and `/behaviors/markers`.
    Subscribes: `/state`, `/bumpers`, and for behaviours `/odom` and `/sonar`; processes a state
    with the values of its time.
    Calls: `/nomad200/set_parameters`, `/nomad200/reset`, `/nomad200/pause`, if it has starts;
    else the service that the parameter `placement_service` names, if any.
    Serves: `~/start`, if nothing places the robot: begins the path that waits for it.
    Parameters: the fields of `ControllerConfig`, `RobotConfig`, `MissionConfig` and `RegionConfig`
    (for a new policy); `mode` and `goal` may change while it drives: for a
    new goal it learns a policy within a fraction of a second, and keeps it.
    """

    _opinions: Sequence[Opinion] = ()
    _acknowledger: Acknowledger | None = None

    def __init__(self) -> None:
        super().__init__(topics.CONTROLLER)
        self._mission = NodeConfig(self, MissionConfig).value
        config = NodeConfig(self, ControllerConfig, live=_LIVE, on_change=self._on_config)
        rng = np.random.default_rng([self._mission.seed, self._mission.first_path])
        policy = self._policy(rng, learn=config.value.learn)
        self._controller = GoalReachingController(config.value, policy, rng)
        self._policies = {policy.regions.goal: policy}
        self._robot = NodeConfig(self, RobotConfig).value
        self._pressed: tuple[bool, ...] = ()
        required = self._required_inputs(config.value)
        self._inputs = InputAligner(topics.STATE, required, wait_s=_BUMPER_WAIT_S)
        self._reporter = InputReporter(self, [topics.STATE, *required], self._inputs.missing)
        self._aligned = AlignedInputs(self, self._inputs, self._on_inputs)
        self._reply = StampedReply()
        self._prefix = frame_prefix(self)
        self._diagnostics = Diagnostics(self, self._reply)
        self._placement = RobotPlacement(self, self._mission.placement_service)
        kind = TwistStamped if self._robot.stamped_cmd_vel else Twist
        self._drive = advertise(self, kind, topics.CMD_VEL, RELIABLE_QOS)
        self._transitions = advertise(self, DiagnosticArray, topics.TRANSITION, DEEP_QOS)
        consumer = self._mission.consumer
        self._subscription = ConditionWait(
            self,
            lambda: not consumer or is_subscribed(self, consumer, self._transitions),
            f'the first path waits for {consumer} to subscribe to {topics.TRANSITION}',
        )
        self._q_table = advertise(self, Float64MultiArray, topics.Q_TABLE, LATCHED_QOS)
        if config.value.learn and config.value.learner != 'paper':
            self._model = advertise(self, String, topics.MODEL, LATCHED_QOS)
        self._path = advertise(self, Path, topics.PATH, RELIABLE_QOS)
        self._q_table.publish(q_table_to_raw(self._controller.policy.q))
        self._on_config(config.value)
        self._next_path = self._mission.first_path
        self._driving = self._finished = self._waits = self._busy = False
        self._stamp_ns, self._commanded_s, self._moving = 0, 0.0, False
        self._placed, self._settled_ns = False, 0
        self._trail: list[tuple[int, Pose2]] = []
        self._ticks = self._pressed_ticks = 0
        self._listen()

    def _listen(self) -> None:
        self._subscribe(DiagnosticArray, topics.STATE, self._state_from_raw, RELIABLE_QOS)
        self._subscribe(LaserScan, topics.BUMPERS, bumpers_from_raw)
        if self._drive.topic_name.endswith(topics.DISCONNECTED_CMD_VEL):  # another node drives
            self._acknowledger = Acknowledger(self, window_ticks=1)
        if not (self._mission.starts or self._mission.placement_service):
            self.create_service(Trigger, '~/start', self._on_start)
        if self._robot.stop_after_s:
            steady_timer(self, _STOP_CHECK_S, self._stop_if_silent)

    def _state_from_raw(self, raw: bytes) -> RegionState:
        state, shape = state_from_raw(raw), self._controller.policy.regions.shape
        if (columns_rows := (len(state.mu_x), len(state.mu_y))) != shape:
            raise MessageError(f'{columns_rows} columns and rows: the policy has {shape}')
        return state

    def _required_inputs(self, config: ControllerConfig) -> dict[str, Interpolation | None]:
        """Return what is needed with a state; behaviours look around, and publish proposals."""
        bumpers = {topics.BUMPERS: either_pressed} if self._robot.bumpers == 'required' else {}
        if config.behaviors == GOAL:
            return {**bumpers}
        self._subscribe(Odometry, topics.ODOM, lambda raw: odometry_from_raw(raw).pose)
        self._behaviors = advertise(self, DiagnosticArray, topics.BEHAVIORS, RELIABLE_QOS)
        self._arrows = advertise(self, MarkerArray, topics.BEHAVIOR_MARKERS, RELIABLE_QOS)
        if self._robot.sonar == 'none':
            return {**bumpers, topics.ODOM: None}
        self._subscribe(LaserScan, topics.SONAR, scan_from_raw)
        return {**bumpers, topics.ODOM: None, topics.SONAR: None}

    def _policy(self, rng: np.random.Generator, *, learn: bool) -> Policy:
        if self._mission.policy:
            return read_policy(self._mission.policy)
        regions = NodeConfig(self, RegionConfig).value.region_map
        if learn:
            return Policy.unlearned(regions)
        self.get_logger().info('no policy given: learning one')
        return train(arena_of(regions), rng=rng).policy

    def _save_policy(self, path: int) -> None:
        """Write the policy after a path, if it is learned."""
        if not (self._mission.policy_out and self._controller.actor.config.learn):
            return
        policy = self._controller.policy
        learning = {**policy.learning, 'paths_driven': path + 1, 'seed': self._mission.seed}
        try:
            write_policy(self._mission.policy_out, replace(policy, learning=learning))
        except FileFormatError as error:
            self.get_logger().error(str(error))

    def _on_config(self, config: ControllerConfig) -> None:
        self._controller.actor.config = config
        first = next(iter(self._policies.values()))
        goal = first.regions.goal
        if config.goal and not config.learn:
            try:
                goal = parse_region(config.goal, first.regions.shape)
                if goal not in self._policies:
                    rng = np.random.default_rng([self._mission.seed, *goal])
                    self._policies[goal] = policy_for_goal(first, goal, rng)
            except ConfigurationError as error:
                self.get_logger().error(f'goal: {error}')
                return
        if goal != self._controller.policy.regions.goal:
            self._controller.aim(self._policies[goal])
            self._q_table.publish(q_table_to_raw(self._policies[goal].q))

    def _subscribe(
        self,
        message_type: type[Any],
        topic: str,
        from_raw: Callable[[bytes], Any],
        qos: QoSProfile = SENSOR_QOS,
    ) -> None:
        """Collect an input for the states of its time; of optional bumpers the last one counts."""

        def collect(stamp_ns: int, raw: bytes) -> None:
            self._reporter.received(topic, stamp_ns)
            if topic == topics.BUMPERS and self._robot.bumpers == 'optional':
                self._pressed = from_raw(raw)
            else:
                self._aligned.add(topic, stamp_ns, from_raw(raw))

        subscribe_raw(self, message_type, topic, collect, qos)

    def _on_inputs(self, stamp_ns: int, inputs: Mapping[str, Any]) -> None:
        if self._busy or not self._reply.begin(stamp_ns):
            return
        around = Surroundings(
            pressed=inputs.get(topics.BUMPERS, self._pressed),
            scan=inputs.get(topics.SONAR),
            odometry=inputs.get(topics.ODOM),
        )
        ticks = self._pressed_ticks = self._pressed_ticks + 1 if any(around.pressed) else 0
        if ticks and ticks % _STUCK_TICKS == 0:
            which = ', '.join(str(i) for i, on in enumerate(around.pressed) if on)
            line = f'bumper {which} has been pressed for {ticks} ticks: stuck, or at a wall'
            self.get_logger().warning(line, throttle_duration_sec=_THROTTLE_S)
        self._process(stamp_ns, inputs[topics.STATE], around)

    def _process(self, stamp_ns: int, state: RegionState, around: Surroundings) -> None:
        self._stamp_ns = stamp_ns
        if self._placed:
            self._placed, self._settled_ns = False, stamp_ns + _SETTLE_NS
        if self._finished or self._waits or stamp_ns < self._settled_ns:
            self._command(STANDING, stamp_ns)
            return
        if not self._driving:
            self._busy = True
            self._subscription.run(lambda: self._begin_next_path(stamp_ns))
            return
        unsure, head = state.confidence is Confidence.UNCERTAIN, topics.HEAD_COMMAND
        step = self._controller.step(
            time_ns=stamp_ns,
            state=state,
            bumped=any(around.pressed),
            around=around,
            head_turns=not unsure or self.count_publishers(resolved_name(self, head)) > 0,
        )
        policy = self._controller.policy
        if step.policy_changed:
            self._reply.send(self._q_table, q_table_to_raw(policy.q))
            if policy.learner:
                self._reply.send(self._model, learner_to_raw(policy.learner))
        if step.transition is not None:
            raw = transition_to_raw(step.transition, stamp_ns, policy.regions.shape)
            self._reply.send(self._transitions, raw)
            if step.transition.outcome is not None:
                self._report(stamp_ns, state)
                self._save_policy(step.transition.path)
                self._begin_next_path(stamp_ns)
                return
        self._publish_opinions(state.pose, stamp_ns)
        self._command(step.command, stamp_ns)
        self._report(stamp_ns, state)

    def _publish_opinions(self, pose: Pose2, stamp_ns: int) -> None:
        """Publish what the behaviours proposed, if they were asked."""
        opinions = self._controller.opinions
        if opinions and opinions is not self._opinions:
            self._opinions = opinions
            self._reply.send(self._behaviors, opinions_to_raw(opinions, stamp_ns))
            if self._arrows.get_subscription_count():
                self._arrows.publish(opinion_markers(opinions, pose, stamp_ns, self._prefix))

    def _command(self, twist: Twist2, stamp_ns: int) -> None:
        stamped = stamp_ns if self._robot.stamped_cmd_vel else None
        self._reply.send(self._drive, twist_to_raw(twist, stamped, self._prefix))
        if self._acknowledger and stamp_ns:
            self._acknowledger.acknowledge(stamp_ns)
        self._commanded_s, self._moving = time.monotonic(), twist != STANDING

    def _stop_if_silent(self) -> None:
        silent_s = time.monotonic() - self._commanded_s
        if self._moving and silent_s > self._robot.stop_after_s:
            line = f'{topics.STATE}: nothing for {silent_s:.1f} s: the robot is stopped'
            self.get_logger().warning(line)
            self._command(STANDING, 0)

    def destroy_node(self) -> None:
        """Stop a robot that does not stop by itself."""
        if self._robot.stop_after_s:
            self._command(STANDING, 0)
            self._drive.wait_for_all_acked(Duration(seconds=_STOP_SENT_S))
        super().destroy_node()

    def _on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._waits
        if self._waits:
            self._waits = False
            self._begin_next_path(self._stamp_ns, placed=True)
        else:
            response.message = 'no path waits for its start'
        return response

    def _begin_next_path(self, stamp_ns: int, *, placed: bool = False) -> None:
        """Start the next path; `/cmd_vel` is published only after the robot has been placed.

        A simulator in lockstep, which waits for that command, is thus placed between two ticks.
        Other robots are commanded to stand meanwhile.
        """
        order = self._mission.path_order(self._next_path)

        def answer() -> None:
            self._busy = False
            self._command(STANDING, stamp_ns)

        self._placed = placed or bool(self._mission.placement_service)
        if not self._mission.starts:
            self._finished = order is None
            self._waits = order is not None and order.waits and not placed
            if self._finished or self._waits:
                answer()
                return
        if order is None:
            self._finished = self._busy = True
            self._placement.pause(answer)
            return
        self._next_path += 1
        self._driving = True
        self._trail.clear()
        self._controller.begin_path(start=order.start, path=order.path, trial=order.trial)
        self._busy = True
        if order.start is not None:
            self._placement.place(order.start, answer)
        elif self._mission.placement_service and not self._mission.resumes(order.path):
            self._command(STANDING, stamp_ns)
            self._placement.place_anywhere(answer)
        else:
            answer()

    def _report(self, stamp_ns: int, state: RegionState) -> None:
        self._ticks += 1
        if self._ticks % _POSE_TICKS == 0:
            self._trail.append((stamp_ns, state.pose))
        if self._ticks % _PATH_TICKS == 0 and self._path.get_subscription_count():
            self._reply.send(self._path, path_to_raw(self._trail, stamp_ns, self._prefix))
        self._diagnostics.tick(
            stamp_ns,
            f'path {self._next_path}',
            lambda: {
                'region': region_name(state.region, (len(state.mu_x), len(state.mu_y))),
                'mode': self._controller.actor.config.mode,
                'confidence': state.confidence.value,
            },
        )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(topics.CONTROLLER, [GoalReachingControllerNode]))


if __name__ == '__main__':
    main()
