"""Drives paths in the MuJoCo world: starts it and the other nodes, and judges by its truth."""

from collections.abc import Callable, Iterator, Sequence
import math
from pathlib import Path
import time
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped
import rclpy
from sensor_msgs.msg import LaserScan

from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.path_evaluator import PathEvaluator
from goalreach_bringup.launch.plan import plan_parameters
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_evaluation.path_metrics import PathResult
from goalreach_lab.localization.frame_log import pose_error, pose_nees
from goalreach_lab.rigs.graph_test_rig import GraphTestRig
from goalreach_learning.policy_file import find_policy, read_policy
from goalreach_msgs_py.alignment import InputAligner
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.diagnostic_messages import state_from_raw
from goalreach_msgs_py.parameter_file import NodeParameters, merge_parameters, write_parameters
from goalreach_msgs_py.pose_messages import estimate_from_raw
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.ros.messaging import DEEP_QOS, subscribe_raw
from goalreach_msgs_py.sensor_messages import bumpers_from_raw
from goalreach_msgs_py.topics import BUMPERS, CONTROLLER, GROUND_TRUTH, MONITOR, POSE, STATE
from goalreach_msgs_py.values import Confidence, Pose2

WORLD: Final = Path(__file__).parents[3] / 'examples' / 'mujoco_world' / 'mujoco_world.py'
_NODES: Final = (
    'goalreach_perception.landmark_localizer_node',
    'goalreach_perception.state_estimator_node',
    'goalreach_learning.goal_reaching_controller_node',
)
_PLACED_M: Final = 0.01
_SILENCE_S: Final = 30.0
"""Wall time without a tick after which none is expected any more. Chosen."""


class _Monitor(RunMonitor):
    """Also compares each certain pose with the covariance: (error in m, NEES) by tick.

    And counts how often a bumper is pressed anew, since the robot was placed at the start.
    """

    def __init__(
        self, starts: Sequence[Pose2], on_path: Callable[[PathResult | None], None]
    ) -> None:
        policy = read_policy('paper')
        super().__init__(PathEvaluator(starts, policy.regions), policy, 'fuzzy', on_path)
        self._starts = starts
        self.begin()
        self.ticked_s = time.monotonic()
        followers = {GROUND_TRUTH: _lost, POSE: _lost}
        self._poses = InputAligner(STATE, followers, wait_s=math.inf, depth=200)
        subscribe_raw(self, PoseWithCovarianceStamped, POSE, self._on_pose, DEEP_QOS)
        subscribe_raw(self, LaserScan, BUMPERS, self._on_bumpers, DEEP_QOS)

    def begin(self) -> None:
        """Forget what was found on the path before."""
        self.errors: list[tuple[float, float]] = []
        self.bumps, self._pressed = 0, False

    @property
    def found(self) -> dict[str, Any]:
        """What was found on the path so far."""
        return {'errors': self.errors, 'bumps': self.bumps, 'ends_pressed': self._pressed}

    def _on_bumpers(self, _: int, raw: bytes) -> None:
        before, self._pressed = self._pressed, any(bumpers_from_raw(raw))
        self.bumps += self._pressed and not before

    def _on_pose(self, stamp_ns: int, raw: bytes) -> None:
        self._compare(POSE, stamp_ns, raw)

    def _on_tick(self, stamp_ns: int, truth: Pose2 | None, raw_state: bytes) -> None:
        start = self._starts[self.progress.path % len(self._starts)]
        if truth and math.hypot(truth.x_m - start.x_m, truth.y_m - start.y_m) < _PLACED_M:
            self.bumps = 0
        self._compare(GROUND_TRUTH, stamp_ns, truth)
        self._compare(STATE, stamp_ns, raw_state)
        super()._on_tick(stamp_ns, truth, raw_state)

    def _compare(self, topic: str, stamp_ns: int, value: object) -> None:
        self.ticked_s = time.monotonic()
        for _, inputs in self._poses.add(topic, stamp_ns, value, self.ticked_s):
            truth, raw_pose = inputs[GROUND_TRUTH], inputs[POSE]
            if truth is None or raw_pose is None:
                continue
            if state_from_raw(inputs[STATE]).confidence is not Confidence.OK:
                continue
            estimate = estimate_from_raw(raw_pose)
            error_m = math.hypot(*pose_error(estimate.pose, truth)[:2])
            self.errors.append((round(error_m, 5), round(pose_nees(estimate, truth), 3)))


def _lost(_one: Any, _other: Any, _fraction: float) -> None:
    """Return nothing between two samples: both topics have one at each stamp of `/state`."""


def drive(
    world: Sequence[str], told: NodeParameters, starts: Sequence[Pose2], *, seed: int
) -> Iterator[dict[str, Any]]:
    """Drive from some starts in turn; yield what is known of each path when it ends.

    That is its `PathResult`, `errors`, the number of `bumps` and whether it `ends_pressed`.
    Where no tick comes any more, the remaining paths have the outcome `silent`.

    Args:
        world: Options of the world.
        told: Parameters of the nodes, beyond the defaults.
        starts: The starts.
        seed: Seed of the world's errors of construction.
    """
    done: list[dict[str, Any]] = []

    def on_path(path: PathResult | None) -> None:
        if path is not None:
            done.append({**path.to_json(), **monitor.found})

    use_profile(fast_dds_profile())
    with GraphTestRig.open() as rig, rig.run(_commands(world, told, starts, seed, rig.folder)):
        rclpy.init(args=[], domain_id=rig.domain)
        try:
            monitor = _Monitor(starts, on_path)
            for number in range(len(starts)):
                while not done[number:] and time.monotonic() - monitor.ticked_s < _SILENCE_S:
                    rclpy.spin_once(monitor, timeout_sec=0.1)
                yield done[number] if done[number:] else {'outcome': 'silent', **monitor.found}
                monitor.begin()
        finally:
            rclpy.try_shutdown()


def _commands(
    world: Sequence[str], told: NodeParameters, starts: Sequence[Pose2], seed: int, folder: Path
) -> list[tuple[str, ...]]:
    """Return the Python command line of each node; write its parameters."""
    options = RunOptions(seed=seed, clock='lockstep', start_poses=tuple(starts), paths=len(starts))
    policy, path = str(find_policy('paper')), folder / 'nodes.yaml'
    planned = plan_parameters(options, arena=Arena(), starts=starts, policy_path=policy, user={})
    watched: NodeParameters = {CONTROLLER: {'consumer': MONITOR}}
    write_parameters(path, merge_parameters(planned, watched, told))
    ours = [('-m', module, '--ros-args', '--params-file', str(path)) for module in _NODES]
    return [(str(WORLD), '--lockstep', '--seed', str(seed), *world), *ours]
